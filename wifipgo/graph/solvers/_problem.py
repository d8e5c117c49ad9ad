"""Which measurements some robots solve for, and the factors made of them (paper Eq. 3)."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import gtsam
import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.errors import pick, require
from wifipgo.graph.posegraph import Edges, select
from wifipgo.graph.solvers._factors import add_anchors, add_between, add_told

# What an edge to a robot outside the solve does: whether it holds its tail to the pose that was told.
THIRD_PARTY: Mapping[str, bool] = MappingProxyType({"fixed_told": True, "ignore": False})
ANCHOR_SIGMA = 1e-5  # of first poses, m and rad: far below any sensor, and 1 / sigma^2 still well conditioned
KNOWN_START = (ANCHOR_SIGMA, ANCHOR_SIGMA)
UNKNOWN_START = (
    100.0,
    10.0,
)  # m, rad: pulls next to nothing, and nothing floats
TOLD_SIGMA = (0.6, 0.2)  # m, rad: least error over random walks of 4 and 10 robots, of 0.001 to 1.5 m


class Problem(NamedTuple):
    """Who takes part, with which of the measurements."""

    team: list[int]
    first_key: Int[np.ndarray, " robots"]
    start: Float[np.ndarray, "poses 3"]
    start_sigma: Float[np.ndarray, "team 2"]
    inner: Int[np.ndarray, " inner"]
    outer: Int[np.ndarray, " outer"]
    told_sigma: Float[np.ndarray, "outer 2"]
    doubted: Bool[np.ndarray, " rows"]

    @property
    def rows(self) -> Int[np.ndarray, " rows"]:
        """Edges in the order of their factors, which come after those that hold the first poses."""
        return np.concatenate([self.inner, self.outer])


def posed(
    poses: Float[np.ndarray, "robots times 3"],
    edges: Edges,
    *,
    robots: Sequence[int],
    third_party: str,
    told_sigma: Float[np.ndarray, "#edges 2"] | tuple[float, float],
    start_sigma: Float[np.ndarray, "#robots 2"] | tuple[float, float],
) -> Problem:
    """Check who takes part and sort out what they use."""
    team = sorted(robots)
    require(len(set(team)) == len(team) > 0, "robots", "one or more, each once", robots)
    first_key = np.full(len(poses), -1)
    first_key[team] = np.arange(len(team)) * poses.shape[1]
    inner, outer = _split(edges, first_key, told=pick(THIRD_PARTY, third_party, "third-party option"))
    told = np.broadcast_to(np.asarray(told_sigma, dtype=np.float64), (len(edges), 2))
    known = np.broadcast_to(np.asarray(start_sigma, dtype=np.float64), (len(poses), 2))
    doubted = ~odometry(edges)[np.concatenate([inner, outer])]
    start = poses[team].reshape(-1, 3)
    finite = np.isfinite(start).all(axis=1)
    require(bool(finite.all()), "poses of those who take part", "finite", start[~finite])
    return Problem(team, first_key, start, known[team], inner, outer, told[outer], doubted)


def odometry(edges: Edges) -> Bool[np.ndarray, " edges"]:
    """Which measurements are of a robot's next pose: trusted by every outlier method."""
    return ~edges.between_robots & (edges.head[:, 1] == edges.tail[:, 1] + 1)


def _split(
    edges: Edges, first_key: Int[np.ndarray, " robots"], *, told: bool
) -> tuple[Int[np.ndarray, " inner"], Int[np.ndarray, " outer"]]:
    """Rows between participants, and rows to outsiders (none unless ``told``), sorted by tail, head and z."""
    ours = np.flatnonzero((first_key[edges.tail[:, 0]] >= 0) & (edges.weight > 0.0))
    columns = (*edges.tail[ours].T, *edges.head[ours].T, *edges.z[ours].T)
    ours = ours[np.lexsort(columns[::-1])]  # gtsam repeats itself to the bit only for one order of edges
    inside = first_key[edges.head[ours, 0]] >= 0
    return ours[inside], ours[~inside & told]


def build(problem: Problem, edges: Edges, *, huber: bool) -> gtsam.NonlinearFactorGraph:
    """What the participants know of each other's relative poses."""
    graph, key = gtsam.NonlinearFactorGraph(), problem.first_key
    add_anchors(graph, problem.start, problem.start_sigma)
    add_between(graph, select(edges, problem.inner), key, problem.doubted[: len(problem.inner)] & huber)
    add_told(graph, select(edges, problem.outer), problem.told_sigma, key, doubted=huber)
    n_loose = len(problem.start) - len(graph.keyVector())
    require(n_loose == 0, "poses without any measurement", "none", n_loose)
    return graph
