"""What a robot observes: one table of blocks, each with the function that its numbers come from.

Layout, spaces, documentation and numbers are all made from `BLOCKS`: another block is another row. A row
reads a `Belief`, which holds no truth.
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int, Shaped

from envs.directions import N_BINS
from wifipgo.graph.covariance import spread_m
from wifipgo.radio.channel.bands import band_of
from wifipgo.rendezvous import NOBODY
from wifipgo.scenarios import Scenario
from wifipgo.state import Belief
from wifipgo.world.coverage_belief import N_BINS as N_BINS_ROOM
from wifipgo.world.lidar import N_LIDAR_RAYS

# A share that can grow without bound is cut here.
_CEILING = 10.0
_ESNR_UNIT_DB = 30.0
_SLOT = "slot/"

Numbers = Shaped[np.ndarray, "robots ..."]


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """One row of the table.

    Attributes:
        name: ``own/...`` or a plain name; ``slot/...`` is there once for each neighbour in a slot.
        size: How many numbers.
        low, high: Bounds, which ``of`` keeps.
        unit: What one unit is.
        meaning: In words.
        of: The numbers of all robots: (robots, size), of a slot (robots, slots, size), without the last
            axis where ``size`` is 1. What it gives for an empty slot does not count.
    """

    name: str
    size: int
    low: float
    high: float
    unit: str
    meaning: str
    of: Callable[[Belief, Scenario], Numbers]


@dataclass(frozen=True, slots=True, kw_only=True)
class Field:
    """One named block of the flat observation.

    Attributes:
        name: ``own/...``, ``lidar``, ``survey`` or ``slot<k>/...``.
        start: Index of its first number.
        size: How many numbers.
        low, high: Bounds.
        unit: What one unit is.
        meaning: In words.
    """

    name: str
    start: int
    size: int
    low: float
    high: float
    unit: str
    meaning: str

    @property
    def where(self) -> slice:
        """Indices of the block."""
        return slice(self.start, self.start + self.size)


def _capped(value: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
    """What is not negative anyway, within bounds."""
    return np.minimum(value, _CEILING)


def _within(value: Float[np.ndarray, "..."], low: float, high: float) -> Float[np.ndarray, "..."]:
    return np.minimum(np.maximum(value, low), high)  # np.clip takes thrice as long


def _called(belief: Belief, _: Scenario) -> Shaped[np.ndarray, " robots"]:
    """Robots whom a call reaches."""
    callee, rate_mbit_s = belief.team.calls.callee, belief.radio.rate_mbit_s
    called = np.zeros(len(callee), dtype=bool)
    calling = (callee != NOBODY).nonzero()[0]
    if len(calling):
        heard = calling[rate_mbit_s[calling, callee[calling]] > 0.0]
        called[_places(*rate_mbit_s.shape).first[heard, 0] + callee[heard]] = True
    return called


def _unit_vector(azimuth_rad: Float[np.ndarray, " robots"]) -> Float[np.ndarray, "robots 2"]:
    out = np.empty((len(azimuth_rad), 2))
    np.cos(azimuth_rad, out=out[:, 0])
    np.sin(azimuth_rad, out=out[:, 1])
    return out


def _sighted_bearing(belief: Belief, _: Scenario) -> Float[np.ndarray, "robots 2"]:
    """Direction of the nearest robot in sight."""
    sighted = belief.sensed.sighted
    return (sighted[:, :1] > 0.0) * _unit_vector(sighted[:, 1])


def _neighbours(belief: Belief) -> Int[np.ndarray, "robots slots"]:
    """Index of each slot's neighbour in a flattened pair table."""
    return belief.radio.slots + _places(*belief.radio.esnr_db.shape).pair


def _neighbour_rows(belief: Belief) -> Int[np.ndarray, "robots slots"]:
    """Row of each slot's neighbour."""
    return belief.radio.slots + _places(*belief.radio.esnr_db.shape).first


class _Places(NamedTuple):
    """Of each row: where it begins in a flattened pair table, the first row of its world, its own number."""

    pair: Int[np.ndarray, "robots 1"]
    first: Int[np.ndarray, "robots 1"]
    number: Int[np.ndarray, "robots 1"]


@functools.lru_cache(maxsize=8)
def _places(n_rows: int, n_robots: int) -> _Places:
    row = np.arange(n_rows)[:, None]
    return _Places(n_robots * row, row - row % n_robots, row % n_robots)


def _profile(belief: Belief, _: Scenario) -> Float[np.ndarray, "robots slots bins"]:
    """Highest share of power in each bin."""
    fine = belief.radio.profile.reshape(*belief.radio.slots.shape, N_BINS, -1)
    each = (fine[..., k] for k in range(fine.shape[-1]))
    return functools.reduce(np.maximum, each)  # a short axis reduces slowly


BLOCKS: tuple[Block, ...] = (
    Block(
        *("own/err", 1, 0.0, _CEILING, "err_threshold", "own Err_i (Eq. 4)"),
        of=lambda b, s: _capped(b.err / s.rendezvous.err_threshold),
    ),
    Block(
        *("own/since_met", 1, 0.0, 1.0, "n_steps", "iterations since the last rendezvous"),
        of=lambda b, s: np.minimum((b.t - b.team.last_met) / s.n_steps, 1.0),
    ),
    Block(
        *("own/heading", 2, -1.0, 1.0, "cos, sin", "own estimated heading in the world"),
        of=lambda b, _: _unit_vector(b.paths.estimate[:, -1, 2]),
    ),
    Block(
        *("own/position", 2, -1.0, 2.0, "size_m", "own estimated position in the world"),
        of=lambda b, s: _within(b.paths.estimate[:, -1, :2] / s.arena.size_m, -1.0, 2.0),
    ),
    Block(
        *("own/calling", 1, 0.0, 1.0, "0 or 1", "a call of one's own is up"),
        of=lambda b, _: b.team.calls.callee != NOBODY,
    ),
    Block("own/called", 1, 0.0, 1.0, "0 or 1", "somebody calls and a ping passes", of=_called),
    Block(
        *("own/elapsed", 1, 0.0, 1.0, "n_steps", "iterations done"),
        of=lambda b, s: np.full(len(b.err), min(b.t / s.n_steps, 1.0)),
    ),
    Block(
        *("own/spread", 1, 0.0, _CEILING, "m"),
        "standard deviation of the own position in the estimate as it stands",
        of=lambda b, _: _capped(spread_m(b.paths.covariance)),
    ),
    Block(
        *("own/recorded_spread", 1, 0.0, _CEILING, "m", "the same once what was recorded is optimised"),
        of=lambda b, _: _capped(spread_m(b.paths.predicted_covariance[:, -1])),
    ),
    Block(
        *("own/start", 2, 0.0, 1.0, "size_m", "where the robot started"),
        of=lambda b, s: _within(b.paths.estimate[:, 0, :2] / s.arena.size_m, 0.0, 1.0),
    ),
    Block(
        *("own/sighted", 1, 0.0, 1.0, "visual_range_m", "distance of the nearest robot in sight, 0 if none"),
        of=lambda b, s: b.sensed.sighted[:, 0] / (s.visual_range_m or 1.0),
    ),
    Block(
        *("own/sighted_bearing", 2, -1.0, 1.0, "cos, sin"),
        "its bearing in the body frame, 0 and 0 if none",
        of=_sighted_bearing,
    ),
    Block(
        *("lidar", N_LIDAR_RAYS, 0.0, 1.0, "lidar_range_m", "free distance, counter-clockwise from ahead"),
        of=lambda b, s: b.sensed.lidar_m / s.arena.lidar_range_m,
    ),
    Block(
        *("survey", N_BINS_ROOM**2, 0.0, 1.0, "probability"),
        "chance that a square of the room, 16 x 16 of them, y fastest, is in place; 0: not seen, not told",
        of=lambda b, _: b.coverage.known.reshape(-1, N_BINS_ROOM**2),
    ),
    Block(
        *("slot/present", 1, 0.0, 1.0, "0 or 1"),
        "a robot is in this slot; if not, the rest of the slot is 0",
        of=lambda b, _: b.radio.slots != NOBODY,
    ),
    Block(
        *("slot/esnr", 1, -1.0, 2.0, "30 dB", "effective SNR of the link"),
        of=lambda b, _: _within(b.radio.esnr_db.take(_neighbours(b)) / _ESNR_UNIT_DB, -1.0, 2.0),
    ),
    Block(
        *("slot/rate", 1, 0.0, 1.0, "top rate"),
        "rate of the link, rho_ij, of 65 Mb/s (20 MHz) or 135 Mb/s (40 MHz)",
        of=lambda b, s: (
            b.radio.rate_mbit_s.take(_neighbours(b)) / band_of(s.radio.bandwidth_hz).top_rate_mbit_s
        ),
    ),
    Block(
        *("slot/discrepancy", 1, 0.0, _CEILING, "1"),
        "service discrepancy w_ij (Eq. 1) at the caller's current demand",
        of=lambda b, _: _capped(b.radio.discrepancy.take(_neighbours(b))),
    ),
    Block(
        *("slot/err", 1, 0.0, _CEILING, "err_threshold", "the neighbour's Err_j, sent with its ping"),
        of=lambda b, s: _capped(b.err.take(_neighbour_rows(b)) / s.rendezvous.err_threshold),
    ),
    Block(
        *("slot/calls_me", 1, 0.0, 1.0, "0 or 1", "the neighbour calls this robot"),
        of=lambda b, s: (
            b.team.calls.callee.take(_neighbour_rows(b)) == _places(len(b.err), s.n_robots).number
        ),
    ),
    Block(
        *("slot/i_call", 1, 0.0, 1.0, "0 or 1", "this robot calls the neighbour"),
        of=lambda b, _: b.team.calls.callee[:, None] == b.radio.slots,
    ),
    Block(
        *("slot/observed", 1, 0.0, _CEILING, "kappa", "relative poses of each other since the pair last met"),
        of=lambda b, s: _capped(b.team.observed.take(_neighbours(b)) / s.rendezvous.kappa),
    ),
    Block(
        *("slot/profile", N_BINS, 0.0, 1.0, "share of power"),
        "AOA profile (Eq. 5, normalised) from the back, body frame",
        of=_profile,
    ),
)


class _Placed(NamedTuple):
    """Rows of the table in the columns of an observation, or of one slot in it."""

    fields: tuple[Field, ...]
    robot: tuple[tuple[Any, Block], ...]
    slot: tuple[tuple[Any, Block], ...]
    n_robot: int
    n_slot: int


@functools.lru_cache(maxsize=32)
def _placed(blocks: tuple[Block, ...], n_slots: int) -> _Placed:
    """Give each block its columns: those of the robot itself, then slot after slot."""
    robot = [block for block in blocks if not block.name.startswith(_SLOT)]
    slot = [block for block in blocks if block.name.startswith(_SLOT)]
    named = [(block.name, block) for block in robot]
    named += [(block.name.replace("slot", f"slot{k}", 1), block) for k in range(n_slots) for block in slot]
    starts = np.cumsum([0] + [block.size for _, block in named]).tolist()
    fields = tuple(
        Field(name=name, start=start, size=b.size, low=b.low, high=b.high, unit=b.unit, meaning=b.meaning)
        for start, (name, b) in zip(starts, named, strict=False)
    )
    n_robot, n_slot = (sum(block.size for block in group) for group in (robot, slot))
    return _Placed(fields, _columns(robot), _columns(slot), n_robot, n_slot)


def _columns(blocks: list[Block]) -> tuple[tuple[Any, Block], ...]:
    """Index of each block where blocks follow each other: of one number, or of a slice of them."""
    ends = np.cumsum([block.size for block in blocks]).tolist()
    return tuple(
        (end - 1 if block.size == 1 else slice(end - block.size, end), block)
        for end, block in zip(ends, blocks, strict=True)
    )


def layout(scenario: Scenario) -> tuple[Field, ...]:
    """Blocks of the flat observation, in order."""
    return _placed(BLOCKS, scenario.n_slots).fields


def observe(belief: Belief, scenario: Scenario) -> Float[np.ndarray, "robots numbers"]:
    """Flat observations of all robots, float32, one row each, within the bounds of `layout`."""
    placed, partner = _placed(BLOCKS, scenario.n_slots), belief.radio.slots
    out = np.empty((len(partner), placed.n_robot + partner.shape[1] * placed.n_slot), dtype=np.float32)
    slots = out[:, placed.n_robot :].reshape(*partner.shape, -1)
    for where, block in placed.robot:
        out[:, where] = block.of(belief, scenario)
    for where, block in placed.slot:
        slots[..., where] = block.of(belief, scenario)
    slots[partner == NOBODY] = 0.0
    return out
