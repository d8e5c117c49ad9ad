"""Rounds of the distributed method: who solves and tells when, and when it is over."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from wifipgo.errors import pick, require
from wifipgo.graph.distributed.channel import Channel
from wifipgo.graph.distributed.robot import UNKNOWN, Robot

SCHEMES: Mapping[str, str] = MappingProxyType(
    {
        "gauss_seidel": "robots in turn, each with the latest values",
        "jor": "all at once, with those of the last round",
    }
)
# On grids of 16 and 49 robots a factor of 1 left up to 4.4 % of the least cost at a threshold of 0.1, 1.4 up
# to 1.0 % after one or two rounds more: what moves little a round, and far in all, is what a factor helps.
RELAXATION: Mapping[str, float] = MappingProxyType({"gauss_seidel": 1.4, "jor": 0.7})
DIVERGED = 1e9  # a robot that moves so far will not come back


@dataclass(frozen=True, slots=True, kw_only=True)
class DistributedConfig:
    """How the robots iterate.

    Attributes:
        threshold: A stage ends when no robot's unknowns have moved further (Euclidean norm) since the
            oldest value that any robot still uses.
        scheme: One of `SCHEMES`.
        relaxation: Factor on each step; below 2, and for "jor" below 1, or rounds may diverge. If left out,
            that of `RELAXATION`. More than 1 holds for poses only, where they are not refined, and only
            while values come in time: rotations and refinements settle soon without, and what is late
            would be overshot.
        warm: Whether the start is near the optimum, as the last one is after a few new measurements. Then
            the robots tell each other their starts and begin with the second stage. Otherwise each
            begins with the measurements of those that have begun before (flagged initialisation).
        refinements: How often the second stage is repeated, at the rotations found; 0 is the paper's method.
            Ours is 1: a few rounds more, and most of what the two stages leave of the least cost is gone.
        max_rounds: Of each stage.
    """

    threshold: float = 0.01
    scheme: str = "gauss_seidel"
    relaxation: float | None = None
    warm: bool = False
    refinements: int = 1
    max_rounds: int = 1000

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        require(self.threshold > 0.0, "DistributedConfig.threshold", "> 0", self.threshold)
        factor = self.relaxation
        require(factor is None or 0.0 < factor < 2.0, "DistributedConfig.relaxation", "in (0, 2)", factor)
        require(self.refinements >= 0, "DistributedConfig.refinements", ">= 0", self.refinements)
        require(self.max_rounds >= 1, "DistributedConfig.max_rounds", ">= 1", self.max_rounds)
        pick(SCHEMES, self.scheme, "scheme")

    @property
    def factor(self) -> float:
        """On each step, as given or as is usual."""
        return RELAXATION[self.scheme] if self.relaxation is None else self.relaxation


class Stage(NamedTuple):
    """How a stage went."""

    rounds: int
    converged: bool


def run_stage(
    robots: list[Robot],
    channel: Channel,
    config: DistributedConfig,
    *,
    first_round: int,
    most: float = 2.0,
) -> Stage:
    """Rounds until no robot has moved further than the threshold since the oldest value still in use.

    With every message there at once that value is of the round before, so the last round
    counts, as in the paper. After losses or delays more rounds count: a robot that hears
    nothing moves little, and must not be taken for one that has arrived. Rounds before
    ``first_round`` never count as the last, and no step has a factor of more than ``most``.
    """
    moved: list[list[float]] = []
    factor = min(config.factor, 1.0 if channel.delay_rounds else most)
    for stamp in range(1, config.max_rounds + 1):
        _round(robots, channel, config.scheme, factor, stamp)
        moved.append([robot.moved for robot in robots])
        oldest = min(robot.oldest for robot in robots)
        if max(moved[-1], default=0.0) > DIVERGED:
            return Stage(stamp, converged=False)
        recent = moved[min(oldest, stamp - 1) :] if oldest != UNKNOWN else None
        if stamp >= first_round and recent is not None and np.sum(recent, axis=0).max() <= config.threshold:
            return Stage(stamp, converged=True)
    return Stage(config.max_rounds, converged=False)


def tell_all(robots: list[Robot], channel: Channel, max_rounds: int) -> bool:
    """Tell the neighbours the start of a stage, again until all have heard; whether they have."""
    due = [(robot, receiver) for robot in robots for receiver in robot.knowledge.told_to]
    for _ in range(max_rounds):
        due = [(r, receiver) for r, receiver in due if not channel.send(receiver, r.message(receiver, 0))]
        for robot in robots:
            robot.receive(channel.collect(robot.number))
        if not due and all(UNKNOWN not in robot.stamp.values() for robot in robots):
            return True
        channel.now += 1
    return False


def _round(robots: list[Robot], channel: Channel, scheme: str, factor: float, stamp: int) -> None:
    """Every robot listens, solves and tells; by "jor" none tells before all have solved."""
    groups = [robots] if scheme == "jor" else [[robot] for robot in robots]
    for group in groups:
        for robot in group:
            robot.receive(channel.collect(robot.number))
            robot.solve(factor, stamp)
        for robot in group:
            for receiver in robot.knowledge.told_to:
                channel.send(receiver, robot.message(receiver, stamp))
    channel.now += 1
