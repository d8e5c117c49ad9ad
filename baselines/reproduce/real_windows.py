"""Windows of a recorded run, and what sightings are worth in them: which are used, and when they are told."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from baselines.evaluation.kept_arrays import KeptArrays
from wifipgo.data import public_data
from wifipgo.datasets.cut_run import cut_run
from wifipgo.datasets.mrclam import read_mrclam
from wifipgo.datasets.team_run import TeamRun, known_ate
from wifipgo.graph.bearings import select_bearings
from wifipgo.graph.solvers.sightings import solve_sightings
from wifipgo.threads import one_thread

RUN = "mrclam6"
N_WINDOWS = 12  # a verdict needs ten; shorter ones have less drift to take away
FEWEST_KNOWN = 0.5  # share of a robot's poses in a window with a truth, from which on it takes part
# What is used of the sightings; Geman-McClure's loss begins at Huber's solution.
USED: Mapping[str, tuple[str, ...]] = {
    "bearings": ("bearings",),
    "ranges": ("ranges",),
    "both": ("bearings", "ranges"),
}
LOSSES = ("huber", "geman_mcclure")
SOLVED = tuple(f"{used}, {loss}" for used in USED for loss in LOSSES)
TOLD = ("at encounters", "at every step")


def data_folder(given: Path | None) -> Path | None:
    """The run: in the folder given, or under its name in that or in $WIFIPGO_DATA; none if not there."""
    root = given or public_data()
    return next((folder for folder in (root, root / RUN) if (folder / "Barcodes.dat").is_file()), None)


@cache
def run_in(folder: Path) -> TeamRun:
    """A run, read once by each process."""
    return read_mrclam(folder)


def window(run: TeamRun, k: int) -> TeamRun | None:
    """One of `N_WINDOWS` pieces that share no step, of robots whose truth is known; none if too few are."""
    edges = np.linspace(0, len(run.time_s) - 1, N_WINDOWS + 1).astype(int)
    first, last = int(edges[k]), int(edges[k + 1])
    known = run.known[:, first : last + 1]
    rows = np.flatnonzero(known[:, 0] & (known.mean(axis=1) >= FEWEST_KNOWN)).tolist()
    return cut_run(run, first, last, robots=rows) if len(rows) > 1 else None


@dataclass(frozen=True, slots=True)
class Window(KeptArrays):
    """One window, or the whole run, by every use of its sightings; the whole not at every step."""

    folder: Path
    number: int | None
    path: Path

    @property
    def label(self) -> str:
        """Which."""
        return "the whole run" if self.number is None else f"window {self.number}"

    @one_thread
    def compute(self) -> dict[str, np.ndarray]:
        """Eq. 12 by dead reckoning and after each solve, and as believed on the way; nan where none is."""
        run = run_in(self.folder)
        piece = run if self.number is None else window(run, self.number)
        if piece is None:
            return {"errors": np.full(1 + len(SOLVED), np.nan), "online": np.full((2, 2), np.nan)}
        errors = np.append(_error(piece.start, piece), _solved(piece))
        online = np.full((2, 2), np.nan) if self.number is None else _told(piece)
        return {"errors": errors, "online": online}


def _error(poses: Float[np.ndarray, "robots times 3"], piece: TeamRun) -> float:
    """Eq. 12, mean over robots."""
    return float(np.nanmean(known_ate(poses, piece.truth)[0]))


def _solved(piece: TeamRun) -> list[float]:
    """Errors after all that was seen is used at once, in the order of `SOLVED`."""
    errors = []
    for names in USED.values():
        poses = piece.start
        for loss in LOSSES:
            poses, _ = solve_sightings(
                poses,
                piece.odometry,
                bearings=piece.bearings if "bearings" in names else None,
                ranges=piece.ranges if "ranges" in names else None,
                robots=range(len(poses)),
                loss=loss,
            )
            errors.append(_error(poses, piece))
    return errors


def _told(piece: TeamRun) -> Float[np.ndarray, "ways 2"]:
    """Error at the end, and of poses as they were believed when they were new, for both of `TOLD`."""
    return np.array([_lived_through(piece, at_sight) for at_sight in (True, False)])


def _lived_through(piece: TeamRun, at_sight: bool) -> tuple[float, float]:
    """Go through a window. Robots that see each other tell what they know and solve it; or all do, always.

    What nobody who meets knows is not used; steps of odometry beyond what is known move no pose before them.
    """
    n, times = piece.start.shape[:2]
    belief = np.repeat(piece.start[None], n, axis=0)
    knows = np.zeros((n, n), dtype=np.int64)  # up to which pose of the other
    now = piece.start[:, :1].copy()
    for t in range(1, times):
        np.fill_diagonal(knows, t)
        for group in _groups(piece, t, at_sight):
            knows[group] = knows[group].max(axis=0)
            belief[group] = _with_known(piece, belief[group[0]], knows[group[0]])
        own = belief[np.arange(n), np.arange(n), t]
        now = np.concatenate([now, own[:, None]], axis=1)
    return _error(belief[np.arange(n), np.arange(n)], piece), _error(now, piece)


def _groups(piece: TeamRun, t: int, at_sight: bool) -> list[Int[np.ndarray, " group"]]:
    """Robots that are joined by sightings of a step; all of them if they need not see each other."""
    n = len(piece.start)
    seen = piece.bearings.observer[:, 1] == t
    if not seen.any():
        return []
    if not at_sight:
        return [np.arange(n)]
    ends = piece.bearings.observer[seen, 0], piece.bearings.target[seen, 0]
    label = connected_components(coo_array((np.ones(len(ends[0])), ends), shape=(n, n)), directed=False)[1]
    return [members for k in np.unique(label) if len(members := np.flatnonzero(label == k)) > 1]


def _with_known(
    piece: TeamRun, poses: Float[np.ndarray, "robots times 3"], knows: Int[np.ndarray, " robots"]
) -> Float[np.ndarray, "robots times 3"]:
    """Solve the bearings between poses that are known."""
    ends = piece.bearings.observer, piece.bearings.target
    inside: Bool[np.ndarray, " rows"] = np.logical_and(*(end[:, 1] <= knows[end[:, 0]] for end in ends))
    heard = select_bearings(piece.bearings, inside)
    return solve_sightings(poses, piece.odometry, bearings=heard, robots=range(len(poses)))[0]
