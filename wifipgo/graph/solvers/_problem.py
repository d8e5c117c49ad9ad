"""Which measurements some robots solve for, and the factors made of them (paper Eq. 3)."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import gtsam
import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.errors import pick, require
from wifipgo.graph.edges import Edges, select
from wifipgo.graph.solvers._factors import add, add_anchors, between_factors, told_factors

# What an edge to a robot outside the solve does: whether it holds its tail to the pose that was told.
THIRD_PARTY: Mapping[str, bool] = MappingProxyType({"fixed_told": True, "ignore": False})
ANCHOR_SIGMA = 1e-5  # of first poses, m and rad: far below any sensor, and 1 / sigma^2 still well conditioned
KNOWN_START = (ANCHOR_SIGMA, ANCHOR_SIGMA)
UNKNOWN_START = (
    100.0,
    10.0,
)  # m, rad: pulls next to nothing, and nothing floats
NOTHING = 1e-30  # weights up to here leave no information that rounding would not lose
REPORTED_SIGMA = (0.6, 0.2)  # m, rad: least error over random walks of 4 and 10 robots, of 0.001 to 1.5 m


class Chains(NamedTuple):
    """Trajectories of groups that share nothing, and the measurements among them.

    Attributes:
        start: Poses where a search starts, group by group.
        group: Number of the group of each.
        first: First pose of each trajectory, which is known, and other poses that are.
        first_sigma: How well.
        inner: Rows of edges between poses of one group.
        outer: Rows of edges to poses outside, which tie their tails to what was told.
        tail: Pose at the tail of each inner row, then of each outer one.
        head: Pose at the head of each inner row.
        told_sigma: Uncertainty of what was told.
    """

    start: Float[np.ndarray, "poses 3"]
    group: Int[np.ndarray, " poses"]
    first: Int[np.ndarray, " known"]
    first_sigma: Float[np.ndarray, "known 2"]
    inner: Int[np.ndarray, " inner"]
    outer: Int[np.ndarray, " outer"]
    tail: Int[np.ndarray, " rows"]
    head: Int[np.ndarray, " inner"]
    told_sigma: Float[np.ndarray, "outer 2"]


class Problem(NamedTuple):
    """Who takes part, with which of the measurements: one group of robots, or several that share nothing.

    Attributes:
        team: Robots, group by group, sorted within each.
        group: Number of the group of each.
        first_key: Row of the first pose of each robot that takes part; -1 of others.
        start: Poses where the search starts.
        start_sigma: How well the first poses are known.
        fixed: Other poses that are known.
        rows: Edges in the order of their factors, which come after those that hold known poses.
        inner: The first of them, between robots of one group.
        outer: The others, to robots outside it.
        tail: Pose at the tail of each row.
        head: Pose at the head of each inner row.
        told_sigma: Uncertainty of what outsiders told.
        doubted: Rows other than odometry.
    """

    team: list[int]
    group: Int[np.ndarray, " team"]
    first_key: Int[np.ndarray, " robots"]
    start: Float[np.ndarray, "poses 3"]
    start_sigma: Float[np.ndarray, "team 2"]
    fixed: Int[np.ndarray, " fixed"]
    rows: Int[np.ndarray, " rows"]
    inner: Int[np.ndarray, " inner"]
    outer: Int[np.ndarray, " outer"]
    tail: Int[np.ndarray, " rows"]
    head: Int[np.ndarray, " inner"]
    told_sigma: Float[np.ndarray, "outer 2"]
    doubted: Bool[np.ndarray, " rows"]

    @property
    def known(self) -> Int[np.ndarray, " known"]:
        """Poses that are held: the first of each trajectory, then the fixed ones."""
        return np.concatenate([self.first_key[self.team], self.fixed])

    @property
    def known_sigma(self) -> Float[np.ndarray, "known 2"]:
        """How well they are known."""
        return np.concatenate([self.start_sigma, np.tile(KNOWN_START, (len(self.fixed), 1))])

    @property
    def chains(self) -> Chains:
        """What of it plain squares are made of."""
        group = self.group.repeat(len(self.start) // len(self.team))
        return Chains(
            self.start,
            group,
            self.known,
            self.known_sigma,
            self.inner,
            self.outer,
            self.tail,
            self.head,
            self.told_sigma,
        )


def posed(
    poses: Float[np.ndarray, "robots times 3"],
    edges: Edges,
    *,
    groups: Sequence[Sequence[int]],
    third_party: str,
    told_sigma: Float[np.ndarray, "#edges 2"] | tuple[float, float],
    start_sigma: Float[np.ndarray, "#robots 2"] | tuple[float, float],
    fixed: Int[np.ndarray, "fixed 2"] | None = None,
) -> Problem:
    """Check who takes part and sort out what they use; what a group gets is what it would get alone."""
    told_is_used = pick(THIRD_PARTY, third_party, "third-party option")
    team = [robot for group in groups for robot in sorted(group)]
    whole = len(set(team)) == len(team) and min(map(len, groups), default=0) > 0
    require(whole, "robots", "one or more, each once", groups if len(groups) != 1 else groups[0])
    group = np.repeat(np.arange(len(groups)), [len(robots) for robots in groups])
    first_key = np.full(len(poses), -1)
    first_key[team] = np.arange(len(team)) * poses.shape[1]
    group_of = np.full(len(poses), -1)
    group_of[team] = group
    rows, n_inner = _rows(edges, first_key, group_of, times=poses.shape[1], told=told_is_used)
    told = np.broadcast_to(np.asarray(told_sigma, dtype=np.float64), (len(edges), 2))
    known = np.broadcast_to(np.asarray(start_sigma, dtype=np.float64), (len(poses), 2))
    ends = edges.tail.take(rows, axis=0), edges.head.take(rows, axis=0)
    tail, head = (first_key.take(end[:, 0]) + end[:, 1] for end in ends)
    start = poses[team].reshape(-1, 3)
    finite = np.isfinite(start).all(axis=1)
    require(bool(finite.all()), "poses of those who take part", "finite", start[~finite])
    held, loose = _held(fixed, first_key, poses.shape[1]), np.ones(len(start), dtype=bool)
    loose[first_key[team]] = loose[held] = loose[tail] = loose[head[:n_inner]] = False
    require(not loose.any(), "poses without any measurement", "none", int(loose.sum()))
    inner, outer = rows[:n_inner], rows[n_inner:]
    doubted, used = ~_odometry(*ends), told[outer]
    ends_of = (tail, head[:n_inner], used, doubted)
    return Problem(team, group, first_key, start, known[team], held, rows, inner, outer, *ends_of)


def _held(
    fixed: Int[np.ndarray, "fixed 2"] | None, first_key: Int[np.ndarray, " robots"], times: int
) -> Int[np.ndarray, " fixed"]:
    """Rows of known poses, given as (robot, index)."""
    if fixed is None:
        return np.zeros(0, dtype=np.int64)
    robot, index = fixed.T
    there = (robot >= 0) & (robot < len(first_key)) & (index >= 0) & (index < times)
    there[there] = first_key[robot[there]] >= 0
    rule = "(robot, index) of poses of robots that take part"
    require(bool(there.all()), "fixed", rule, fixed[~there].tolist())
    rows: np.ndarray = np.unique(first_key[robot] + index)
    return rows


def odometry(edges: Edges) -> Bool[np.ndarray, " edges"]:
    """Which measurements are of a robot's next pose: trusted by every outlier method."""
    return _odometry(edges.tail, edges.head)


def _odometry(
    tail: Int[np.ndarray, "edges 2"], head: Int[np.ndarray, "edges 2"]
) -> Bool[np.ndarray, " edges"]:
    return (head[:, 0] == tail[:, 0]) & (head[:, 1] == tail[:, 1] + 1)


def _rows(
    edges: Edges,
    first_key: Int[np.ndarray, " robots"],
    group_of: Int[np.ndarray, " robots"],
    *,
    times: int,
    told: bool,
) -> tuple[Int[np.ndarray, " rows"], int]:
    """Rows within groups, then to outsiders if ``told``, by tail, head and z; how many come first."""
    ours = np.flatnonzero((first_key >= 0).take(edges.tail[:, 0]))
    ours = ours[edges.weight.take(ours) > NOTHING]
    tail, head = edges.tail.take(ours, axis=0), edges.head.take(ours, axis=0)
    outside = group_of.take(head[:, 0]) != group_of.take(tail[:, 0])
    at = first_key.take(tail[:, 0]) + tail[:, 1]  # by group, too
    columns = (outside, at, head[:, 0] * times + head[:, 1], *edges.z.take(ours, axis=0).T)
    order = np.lexsort(columns[::-1])  # gtsam repeats itself to the bit only for one order of edges
    n_inner = len(ours) - int(outside.sum())
    return ours[order[: None if told else n_inner]], n_inner


def build(problem: Problem, edges: Edges, *, huber: bool) -> gtsam.NonlinearFactorGraph:
    """What the participants know of each other's relative poses."""
    graph, key = gtsam.NonlinearFactorGraph(), problem.first_key
    add_anchors(graph, problem.start, problem.known, problem.known_sigma)
    doubted = problem.doubted[: len(problem.inner)] & huber
    add(graph, between_factors(select(edges, problem.inner), key, doubted))
    add(graph, told_factors(select(edges, problem.outer), problem.told_sigma, key, doubted=huber))
    return graph


def name_of(problem: Problem, edges: Edges, key: int) -> str:
    """A pose, and the surest of its measurements: where digits end, it is the one that is too sure."""
    robot, index = divmod(key, len(problem.start) // len(problem.team))
    place = f"pose {index} of robot {problem.team[robot]}"
    touching = problem.tail == key
    touching[: len(problem.head)] |= problem.head == key
    rows = problem.rows[touching]
    if not len(rows):
        return place
    row = int(rows[(edges.sigma[rows] / np.sqrt(edges.weight[rows])[:, None]).min(axis=1).argmin()])
    (i, k), (j, m) = edges.tail[row].tolist(), edges.head[row].tolist()
    sigma = "sigma {:.3g} m, {:.3g} rad".format(*edges.sigma[row])
    return f"{place}, whose surest measurement is from {(i, k)} to {(j, m)} ({sigma})"
