"""What `wifipgo optimise` reports against the truth: ATE, RPE, and iATE as a graph grows."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.errors import require
from wifipgo.graph.ate import Compared, compared
from wifipgo.graph.files.g2o import Reading
from wifipgo.graph.files.trajectories import Team, read_team, team_of
from wifipgo.graph.optimise_figures import Outcome
from wifipgo.graph.posegraph import PoseGraph
from wifipgo.graph.subgraphs import of_poses, so_far
from wifipgo.graph.team_accuracy import TeamAccuracy, iate, team_accuracy

ALIGNMENT = "rigid"  # no measurement says where a team is


@runtime_checkable
class Solve(Protocol):
    """Optimises a graph some of whose rows are known."""

    def __call__(self, graph: PoseGraph, *, fixed: Int[np.ndarray, " fixed"]) -> Outcome:
        """Poses, and what else there is to say."""


class Against(NamedTuple):
    """Figures for the table by name, and all of them for the report."""

    table: dict[str, object]
    report: dict[str, object]


def truth_of(reading: Reading, reference: Path | None, steps: int) -> Team | None:
    """True trajectories: those of a file, else those that the graph's own file tells, if any.

    A lone trajectory is that of all robots that a graph was cut into: numbers of poses tell them apart.

    Raises:
        ValueError: Steps are asked for that cannot be, or without a truth.
    """
    require(steps >= 0, "steps", ">= 0; 0 for none", steps)
    known = reference is not None or reading.truth is not None
    require(steps == 0 or known, "steps", "given with a reference", steps)
    if reference is None:
        return None if reading.truth is None else team_of(reading.graph, reading.truth, reading.name)
    team = read_team(reference)
    lone = next(iter(team.values()))
    return team if len(team) > 1 else dict.fromkeys(reading.graph.robots.tolist(), lone)


def against_truth(truth: Team, reading: Reading, poses: Float[np.ndarray, "poses dims"]) -> Against:
    """ATE and RPE of the given and of the optimised poses, the team aligned as one.

    Raises:
        BadInputError: The truth is of no pose of the graph.
    """
    graph = reading.graph
    teams = [team_of(graph, rows, reading.name) for rows in (graph.poses, poses)]
    before, after = (_accuracy(compared(truth, team)) for team in teams)
    table: dict[str, object] = {
        "poses with a truth": after.team.poses,
        "ATE before, RMSE m": before.team.ate_m,
        "ATE after, RMSE m": after.team.ate_m,
        "ATE after, RMSE deg": float(np.rad2deg(after.team.ate_rad)),
        "RPE after, RMSE m": after.team.rpe_m,
        "RPE after, RMSE deg": float(np.rad2deg(after.team.rpe_rad)),
    }
    return Against(table, {"alignment": ALIGNMENT, "before": before.as_json(), "after": after.as_json()})


def incremental(truth: Team, reading: Reading, solve: Solve, *, steps: int) -> dict[str, object]:
    """IATE: the mean ATE of all poses so far, optimised anew at so many equal steps of every robot's way.

    Each step knows only the measurements among the poses so far.
    """
    found = iate(_steps(truth, reading, solve, steps), alignment=ALIGNMENT)
    return {"iATE, m": found.trans_m, "iATE, deg": float(np.rad2deg(found.rot_rad))}


def _steps(
    truth: Team, reading: Reading, solve: Solve, steps: int
) -> Iterator[tuple[Float[np.ndarray, "poses 7"], Float[np.ndarray, "poses 7"]]]:
    """Estimates of the poses so far and their truth."""
    for k in range(1, steps + 1):
        kept = so_far(reading.graph, k / steps)
        part = of_poses(reading.graph, kept)
        poses = solve(part, fixed=_among(kept, reading.fixed)).poses
        rows = compared(truth, team_of(part, poses, reading.name))
        yield rows.estimate, rows.reference


def _among(kept: Bool[np.ndarray, " poses"], rows: Int[np.ndarray, " fixed"]) -> Int[np.ndarray, " some"]:
    """Rows as they are counted among those that are kept."""
    return (np.cumsum(kept) - 1)[rows[kept[rows]]]


def _accuracy(rows: Compared) -> TeamAccuracy:
    return team_accuracy(rows.estimate, rows.reference, rows.robot, alignment=ALIGNMENT)
