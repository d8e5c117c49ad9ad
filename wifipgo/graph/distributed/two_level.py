"""Most likely poses by the robots themselves: Gauss-Newton, each step by conjugate gradients in two levels.

A robot keeps its measurements and the factors of its own block, which precondition (as in RBCD); what blocks
leave, slow bends of the whole team, a second level takes: each trajectory in a few stretches that move as a
whole (Dryja and Widlund 1990, additive Schwarz; Nicolaides 1987). A round is one exchange of separators with
neighbours, and a few numbers a robot to a hub, one of the robots, and back. The cost is that of
`wifipgo.graph.solve_graph`, losses included, so both have the same optimum.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from wifipgo.arithmetic import harmless_underflow
from wifipgo.errors import pick, require
from wifipgo.graph.chordal import chordal_cost, links, matrices
from wifipgo.graph.distributed.channel import Channel, Message
from wifipgo.graph.distributed.parts import Column, Part, shares, tell
from wifipgo.graph.distributed.two_stage import DistributedReport
from wifipgo.graph.losses import LOSSES, truncation_chi2
from wifipgo.graph.posegraph import PoseGraph, normalised
from wifipgo.graph.residuals import chi_squares
from wifipgo.graph.solvers.linear_blocks import LinearBlocks, linear_blocks, stepped
from wifipgo.graph.solvers.starts import of_robots
from wifipgo.graph.subgraphs import held
from wifipgo.threads import one_thread

GROWTH = 1.4  # of the control parameter of graduated losses
SHORTEST = 1e-3  # share of a step below which none is tried
Rows = Float[np.ndarray, "poses dims"]


@dataclass(frozen=True, slots=True, kw_only=True)
class TwoLevelConfig:
    """How the robots iterate.

    Attributes:
        least_fall: It ends when a step lets the cost fall by a smaller share.
        accuracy: At which a step is left: its residual as a share of the first, in the metric of the blocks.
            On the eight robots in tunnels 0.3 leaves poses up to 1.1 m off the optimum, 0.1 up to 0.3 m.
        stretches: Of each trajectory, in the second level; 0 is blocks alone.
        max_rounds: Of each step.
        max_steps: Of Gauss-Newton.
    """

    least_fall: float = 1e-3
    accuracy: float = 0.1
    stretches: int = 4
    max_rounds: int = 200
    max_steps: int = 150

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        require(self.least_fall > 0.0, "TwoLevelConfig.least_fall", "> 0", self.least_fall)
        require(0.0 < self.accuracy < 1.0, "TwoLevelConfig.accuracy", "in (0, 1)", self.accuracy)
        require(self.stretches >= 0, "TwoLevelConfig.stretches", ">= 0", self.stretches)
        require(self.max_rounds >= 1, "TwoLevelConfig.max_rounds", ">= 1", self.max_rounds)
        require(self.max_steps >= 1, "TwoLevelConfig.max_steps", ">= 1", self.max_steps)


class _Team(NamedTuple):
    """What stays through all steps."""

    graph: PoseGraph
    known: Int[np.ndarray, " known"]
    stretch: Int[np.ndarray, " poses"]
    config: TwoLevelConfig
    channel: Channel


@one_thread
@harmless_underflow
def solve_two_level(
    graph: PoseGraph,
    start: Rows | None = None,
    *,
    fixed: Int[np.ndarray, " fixed"] | None = None,
    loss: str = "none",
    config: TwoLevelConfig | None = None,
    channel: Channel | None = None,
) -> tuple[Rows, DistributedReport, Float[np.ndarray, " edges"]]:
    """Poses that make the measurements most likely, by robots that tell each other values of separators only.

    Args:
        graph: Poses and measurements; those of weight zero are dropped.
        start: Where the search starts; if left out, the graph's own poses or the robots' odometry, under
            a graduated loss with frames aligned by votes, whichever fits better.
        fixed: Rows of poses that are known and stay, as does the first of each part without any.
        loss: A name in `wifipgo.graph.losses.LOSSES`, for all measurements but odometry.
        config: How to iterate.
        channel: Carries the messages; what is lost is sent again until it arrives.

    Returns:
        Pose rows; the report, with the rounds of each step; and what the loss left of each measurement.
    """
    pick(LOSSES, loss, "robust loss")
    config, channel = config or TwoLevelConfig(), channel or Channel()
    graduated = LOSSES[loss].graduated
    begin = of_robots(graph, fixed, graduated=graduated) if start is None else normalised(start)
    known = held(graph, fixed)
    team = _Team(graph, known, _stretches(graph, config.stretches), config, channel)
    rows, weight, rounds, converged = _descended(team, begin, loss)
    rows = np.where(np.isin(np.arange(len(rows)), known)[:, None], begin, rows)
    edges = links(graph)
    report = DistributedReport(
        converged=converged,
        rounds=rounds,
        cost_before=chordal_cost(matrices(begin), edges),
        cost_after=chordal_cost(matrices(rows), edges),
        bytes_sent=channel.bytes_sent,
        n_messages=channel.n_sent,
        n_lost=channel.n_lost,
        order=tuple(graph.robots.tolist()),
    )
    return rows, report, weight


def _stretches(graph: PoseGraph, each: int) -> Int[np.ndarray, " poses"]:
    """Number of the stretch of each pose; those of a robot are about as long as each other."""
    number = np.zeros(len(graph.poses), dtype=np.int64)
    for k, robot in enumerate(graph.robots.tolist()):
        own = np.flatnonzero(graph.robot == robot)
        number[own] = k * max(each, 1) + np.arange(len(own)) * max(each, 1) // len(own)
    return number


def _descended(
    team: _Team, rows: Rows, loss: str
) -> tuple[Rows, Float[np.ndarray, " edges"], tuple[int, ...], bool]:
    """Steps until one gains next to nothing and a graduated loss has decided."""
    graph, row, rounds = team.graph, LOSSES[loss], []
    doubted, limit = ~graph.odometry & (graph.weight > 0.0), truncation_chi2(graph.freedom)
    chi2, weight = _finite(graph, rows), np.ones(len(graph.tail))
    mu = limit / max(2.0 * float(chi2[doubted].max(initial=0.0)) - limit, 1e-9)
    for _ in range(team.config.max_steps):
        weight[doubted] = row.weight(chi2[doubted], limit, mu)
        before = float(weight @ chi2)
        step, n = _step(team, graph.with_weight(graph.weight * weight), rows)
        rounds.append(n)
        rows, chi2 = _along(team, rows, step, weight, before)
        mu *= GROWTH
        sharp = not row.graduated or bool(np.isin(weight, (0.0, 1.0)).all())
        after = float(weight @ chi2)
        if n < 0 or not np.isfinite(after):
            return rows, weight, tuple(rounds[:-1]), False
        if sharp and before - after <= team.config.least_fall * before:
            return rows, weight, tuple(rounds), True
    return rows, weight, tuple(rounds), False


def _finite(graph: PoseGraph, rows: Rows) -> Float[np.ndarray, " edges"]:
    with np.errstate(over="ignore", invalid="ignore"):
        return np.nan_to_num(chi_squares(graph, rows), nan=1e300, posinf=1e300)


def _along(
    team: _Team,
    rows: Rows,
    step: Float[np.ndarray, "poses d"],
    weight: Float[np.ndarray, " edges"],
    cost: float,
) -> tuple[Rows, Float[np.ndarray, " edges"]]:
    """As far along a step as the cost falls; every try is a number a robot to the hub and back."""
    share = 1.0
    while share >= SHORTEST:
        tried = stepped(rows, share * step)
        chi2 = _finite(team.graph, tried)
        _to_hub_and_back(team, up=1, down=1)
        if float(weight @ chi2) <= cost:
            return tried, chi2
        share *= 0.5
    return rows, _finite(team.graph, rows)


def _step(team: _Team, graph: PoseGraph, rows: Rows) -> tuple[Float[np.ndarray, "poses d"], int]:
    """A step of Gauss-Newton, and its rounds; -1 where messages did not get through."""
    parts, step = _parts(team, graph, rows), np.zeros((len(rows), graph.freedom))
    level = _Second(team, parts)
    x = [np.zeros_like(part.g) for part in parts]
    r, rounds = [part.g for part in parts], 0
    p, rest = level.preconditioned(r)
    enough = team.config.accuracy**2 * rest
    while rest > enough and rounds < team.config.max_rounds:
        if not tell(team.channel, parts, p, "direction", rounds):
            return step, -1
        q = [part.times(own) for part, own in zip(parts, p, strict=True)]
        length = rest / _dot(p, q)
        x = [a + length * b for a, b in zip(x, p, strict=True)]
        r = [a - length * b for a, b in zip(r, q, strict=True)]
        z, now = level.preconditioned(r)
        p = [a + now / rest * b for a, b in zip(z, p, strict=True)]
        rest, rounds = now, rounds + 1
    for part, own in zip(parts, x, strict=True):
        step[part.share.own] = own.reshape(-1, graph.freedom)
    return step, rounds


def _parts(team: _Team, graph: PoseGraph, rows: Rows) -> list[Part]:
    """Every robot's share at these poses; it hears its separators' poses for it."""
    blocks, parts, total = linear_blocks(graph, rows), [], int(team.stretch.max()) + 1
    used = np.flatnonzero(graph.weight > 0.0)
    for share in shares(graph, team.known):
        near = np.concatenate([share.own, share.separators])
        own = LinearBlocks(*(column[share.links[used]] for column in blocks))
        parts.append(Part(share, own, rows[near], (team.stretch[near], total)))
        for receiver, places in share.told_to.items():
            poses = rows[share.own[places]][..., None]
            team.channel.send(receiver, Message(share.number, "poses", 0, poses))
            team.channel.collect(receiver)
    return parts


class _Second:
    """Blocks, and stretches over them, whose system the hub has."""

    def __init__(self, team: _Team, parts: Sequence[Part]) -> None:
        """Gather the system of stretches; only what is not zero is sent."""
        self._team, self._parts = team, parts
        coarse = np.sum([part.coarse for part in parts], axis=0)
        self._inverse = np.linalg.pinv(0.5 * (coarse + coarse.T), rcond=1e-12, hermitian=True)
        self._each = team.graph.freedom * max(team.config.stretches, 1)
        if team.config.stretches:
            for part in parts:
                _send(team, part.share.number, int(np.count_nonzero(part.coarse)))

    def preconditioned(self, r: Sequence[Column]) -> tuple[list[Column], float]:
        """What blocks and stretches make of residuals, and its product with them."""
        z = [part.smoothed(own) for part, own in zip(self._parts, r, strict=True)]
        each = 0
        if self._team.config.stretches:
            y = self._inverse @ np.sum([part.pull(own) for part, own in zip(self._parts, r, strict=True)], 0)
            z = [a + part.carried(y) for part, a in zip(self._parts, z, strict=True)]
            each = self._each
        _to_hub_and_back(self._team, up=each + 2, down=each + 2)
        return z, _dot(r, z)


def _dot(a: Sequence[Column], b: Sequence[Column]) -> float:
    """Product over all robots: one number of each."""
    return float(sum(x @ y for x, y in zip(a, b, strict=True)))


def _to_hub_and_back(team: _Team, *, up: int, down: int) -> None:
    """Count numbers that every robot sends to the hub, and gets back."""
    for number in team.graph.robots.tolist():
        _send(team, number, up)
        _send(team, number, down)


def _send(team: _Team, number: int, numbers: int) -> None:
    """Carry numbers between a robot and the hub, the first robot; nothing on its own way to itself."""
    hub = int(team.graph.robot[0])
    if number != hub:
        team.channel.send(hub, Message(number, "hub", 0, np.zeros((1, numbers, 1))))
        team.channel.collect(hub)
