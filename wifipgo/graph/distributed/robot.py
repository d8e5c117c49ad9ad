"""One robot of the distributed method: it owns its poses and solves for them, and for nothing else."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csr_array

from wifipgo.graph.chordal import (
    GENERATORS,
    Links,
    Normal,
    Poses,
    assembled,
    chosen,
    moved,
    nearest_rotations,
    pose_normal,
    rotation_normal,
)
from wifipgo.graph.distributed.channel import Message
from wifipgo.graph.factorised import Solver, factorised

RIDGE = 1e-9  # holds poses that nothing known reaches yet where they are
UNKNOWN = -1  # stamp of a neighbour that was never heard
LATEST = int(
    np.iinfo(np.int64).max
)  # stamp of what never grows old: a robot without neighbours uses no value


class Knowledge(NamedTuple):
    """What a robot is given: nothing here is another robot's estimate.

    Attributes:
        number: Which robot this is.
        start: Its own poses where the search starts.
        fixed: Rows of its poses that stay.
        links: Measurements that touch its poses. Rows below ``len(start.R)`` are its own poses, those
            from there on separators: poses of neighbours that a measurement ties to its own.
        separator_of: Whose each separator is, grouped by robot.
        told_to: Rows of its own poses that each neighbour wants to know.
        before: Robots whose turn is before its own.
    """

    number: int
    start: Poses
    fixed: Int[np.ndarray, " fixed"]
    links: Links
    separator_of: Int[np.ndarray, " separators"]
    told_to: dict[int, Int[np.ndarray, " told"]]
    before: frozenset[int]


class _Problem(NamedTuple):
    """What a stage is about: its name, and its normal equations."""

    stage: str
    normal: Callable[[Links], Normal]


@dataclass(slots=True)
class Record:
    """What is reported of a robot, which itself does without.

    Attributes:
        told_rotations: Rotations of its separators, as the last stage began with them.
        others: Its separators, as it knew them at the end of the last stage.
        seconds: That it has computed.
    """

    told_rotations: Float[np.ndarray, "separators d d"]
    others: Poses
    seconds: float = 0.0


class Robot:
    """Solves its block with the latest values of its neighbours' separators held.

    Attributes:
        knowledge: What it was given.
        estimate: Its poses after the last stage.
        record: What is reported of it.
        x: Unknowns of this stage, one block a pose.
        moved: How far they went in the last solve (Frobenius norm).
        oldest: Stamp of the oldest value that the last solve used, or `UNKNOWN`.
        stamp: Round of the latest value of each neighbour, or `UNKNOWN`.
    """

    def __init__(self, knowledge: Knowledge) -> None:
        """Take what the robot knows; it has heard nobody."""
        self.knowledge, self.estimate = knowledge, knowledge.start
        none = Poses(knowledge.start.R[:0], knowledge.start.t_m[:0])
        self.record = Record(none.R, none)
        self._begin("", np.zeros((len(knowledge.start.R), 1, 1)), rotation_normal)

    @property
    def number(self) -> int:
        """Which robot this is."""
        return self.knowledge.number

    def begin_rotations(self) -> None:
        """Unknowns are the transposed rotations, any matrices."""
        self._begin("rotations", np.swapaxes(self.estimate.R, 1, 2), rotation_normal)

    def end_rotations(self) -> None:
        """Project what was found on rotations, and offer these to the neighbours."""
        self.estimate = Poses(nearest_rotations(np.swapaxes(self.x, 1, 2)), self.estimate.t_m)

    def offer_rotations(self, stage: str) -> None:
        """Unknowns are rotations that do not change any more: neighbours need them to begin with poses."""
        self._begin(stage, self.estimate.R, rotation_normal)

    def begin_poses(self, stage: str, *, warm: bool) -> None:
        """Unknowns are turns from the rotations, and positions: those of the estimate if warm, else zero.

        Neighbours' rotations are those that the stage before offered.
        """
        (n, d), R = self.estimate.t_m.shape, np.concatenate([self.estimate.R, self._told])
        x = np.zeros((n, len(GENERATORS[d]) + d, 1))
        rows = slice(None) if warm else self.knowledge.fixed
        x[rows, -d:, 0] = self.estimate.t_m[rows]
        self.record.told_rotations = self._told
        self._begin(stage, x, partial(pose_normal, R=R))

    def end_poses(self) -> None:
        """Turn by what was found."""
        self.estimate = moved(self.estimate.R, self.x[..., 0])
        self.record.others = moved(self.record.told_rotations, self._told[..., 0])

    def _begin(self, stage: str, x: Float[np.ndarray, "n k c"], normal: Callable[[Links], Normal]) -> None:
        """Begin a stage at ``x``, having heard nobody; messages of other stages are not listened to."""
        self._problem, self.x = _Problem(stage, normal), x
        self._told = np.zeros((len(self.knowledge.separator_of), *x.shape[1:]))
        self.stamp = dict.fromkeys(self.knowledge.told_to, UNKNOWN)
        self.moved, self.oldest = np.inf, UNKNOWN
        self._block: _Block | None = None

    def receive(self, messages: list[Message]) -> None:
        """Take what neighbours told, unless something newer is known."""
        for message in messages:
            known = self.stamp.get(message.sender, UNKNOWN)
            if message.stage == self._problem.stage and message.stamp > known:
                self.stamp[message.sender] = message.stamp
                self._told[self.knowledge.separator_of == message.sender] = message.values
                if known == UNKNOWN:
                    self._block = None

    def message(self, receiver: int, stamp: int) -> Message:
        """What a neighbour wants to know."""
        return Message(self.number, self._problem.stage, stamp, self.x[self.knowledge.told_to[receiver]])

    def solve(self, relaxation: float, stamp: int) -> None:
        """Minimise over its own unknowns, and go ``relaxation`` times as far.

        Measurements of neighbours that were never heard are left out (flagged
        initialisation), and the first step that all neighbours have a part in is a plain one.
        No step goes too far that uses a value older than need be in round ``stamp``, and
        none is taken that is not finite.
        """
        begin = time.thread_time()
        if self._block is None:
            heard = [self.stamp[robot] != UNKNOWN for robot in self.knowledge.separator_of.tolist()]
            self._block = _block(self.knowledge, self._problem.normal, self.x, np.array(heard, dtype=bool))
        before = self.knowledge.before
        late = any(known < stamp - (robot not in before) for robot, known in self.stamp.items())
        factor = min(relaxation, 1.0) if late else relaxation
        factor = factor if self.oldest != UNKNOWN else 1.0
        step = factor * (self._block.solve(self._told) - self.x)
        self.moved = float(np.linalg.norm(step)) if np.isfinite(step).all() else np.inf
        self.x = self.x + step if np.isfinite(self.moved) else self.x
        self.oldest = min(self.stamp.values(), default=LATEST)
        self.record.seconds += time.thread_time() - begin


class _Block(NamedTuple):
    """The robot's normal equations, factorised: free rows of H x = g - C separators."""

    x: Float[np.ndarray, "n k c"]
    free: Int[np.ndarray, " free"]
    g: Float[np.ndarray, "unknowns c"]
    coupling: csr_array
    factor: Solver

    def solve(self, separators: Float[np.ndarray, "separators k c"]) -> Float[np.ndarray, "n k c"]:
        """Unknowns that are best beside these separators."""
        out = self.x.copy()
        if len(self.free):
            rhs = self.g - self.coupling @ separators.reshape(-1, self.x.shape[2])
            out[self.free] = self.factor(rhs).reshape(len(self.free), *self.x.shape[1:])
        return out


def _block(
    know: Knowledge,
    normal: Callable[[Links], Normal],
    x: Float[np.ndarray, "n k c"],
    heard: Bool[np.ndarray, " separators"],
) -> _Block:
    """Assemble and factorise what the measurements of known poses say."""
    (n, k, c), m = x.shape, len(know.separator_of)
    known = np.concatenate([np.ones(n, dtype=bool), heard])
    used = known[know.links.tail] & known[know.links.head]
    links = chosen(know.links, used)
    H, g = assembled(normal(links), links, n + m)
    free = np.setdiff1d(np.arange(n), know.fixed)
    rows = (free[:, None] * k + np.arange(k)).ravel()
    H = csr_array(H)[rows]
    ridge = 0.0 if heard.all() else RIDGE
    held = x.copy()
    held[free] = 0.0
    g = g[rows] - H[:, : n * k] @ held.reshape(-1, c) + ridge * x[free].reshape(-1, c)
    return _Block(x, free, g, H[:, n * k :], factorised(H[:, rows], ridge))
