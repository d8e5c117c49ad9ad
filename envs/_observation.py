"""What a robot observes: names, indices, units and bounds, and the numbers themselves.

Everything comes from a `Belief`, which holds no truth. One table is the layout, the
space and the documentation at once.
"""

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium import spaces
from jaxtyping import Float, Int8

from wifipgo.graph.covariance import spread_m
from wifipgo.radio.channel.bands import band_of
from wifipgo.rendezvous import NOBODY
from wifipgo.scenarios import Scenario
from wifipgo.state import Belief
from wifipgo.world.coverage_belief import N_BINS as N_BINS_ROOM
from wifipgo.world.lidar import N_LIDAR_RAYS

N_BINS = 72
# A share that can grow without bound is cut here.
_CEILING = 10.0
_ESNR_DB = (-30.0, 60.0)


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


# name, size, low, high, unit, meaning
_Row = tuple[str, int, float, float, str, str]
_OWN: tuple[_Row, ...] = (
    ("err", 1, 0.0, _CEILING, "err_threshold", "own Err_i (Eq. 4)"),
    ("since_met", 1, 0.0, 1.0, "n_steps", "iterations since the last rendezvous"),
    ("heading", 2, -1.0, 1.0, "cos, sin", "own estimated heading in the world"),
    ("position", 2, -1.0, 2.0, "size_m", "own estimated position in the world"),
    ("calling", 1, 0.0, 1.0, "0 or 1", "a call of one's own is up"),
    ("called", 1, 0.0, 1.0, "0 or 1", "somebody calls and a ping passes"),
    ("elapsed", 1, 0.0, 1.0, "n_steps", "iterations done"),
    ("spread", 1, 0.0, _CEILING, "m", "standard deviation of the own position in the estimate as it stands"),
    ("recorded_spread", 1, 0.0, _CEILING, "m", "the same once what was recorded is optimised"),
    ("start", 2, 0.0, 1.0, "size_m", "where the robot started"),
    (
        "sighted",
        1,
        0.0,
        1.0,
        "visual_range_m",
        "distance of the nearest robot in sight, 0 if none",
    ),
    ("sighted_bearing", 2, -1.0, 1.0, "cos, sin", "its bearing in the body frame, 0 and 0 if none"),
)
_SURVEY: _Row = (
    "survey",
    N_BINS_ROOM**2,
    0.0,
    1.0,
    "probability",
    "chance that a square of the room, 16 x 16 of them, y fastest, is in place; 0: not seen, not told",
)
_SLOT: tuple[_Row, ...] = (
    ("present", 1, 0.0, 1.0, "0 or 1", "a robot is in this slot; if not, the rest of the slot is 0"),
    ("esnr", 1, -1.0, 2.0, "30 dB", "effective SNR of the link"),
    ("rate", 1, 0.0, 1.0, "top rate", "rate of the link, rho_ij, of 65 Mb/s (20 MHz) or 135 Mb/s (40 MHz)"),
    ("discrepancy", 1, 0.0, _CEILING, "1", "service discrepancy w_ij (Eq. 1) at the caller's current demand"),
    ("err", 1, 0.0, _CEILING, "err_threshold", "the neighbour's Err_j, sent with its ping"),
    ("calls_me", 1, 0.0, 1.0, "0 or 1", "the neighbour calls this robot"),
    ("i_call", 1, 0.0, 1.0, "0 or 1", "this robot calls the neighbour"),
    ("observed", 1, 0.0, _CEILING, "kappa", "relative poses of each other since the pair last met"),
    (
        "profile",
        N_BINS,
        0.0,
        1.0,
        "share of power",
        "AOA profile (Eq. 5, normalised) from the back, body frame",
    ),
)


def _width(rows: tuple[_Row, ...]) -> int:
    """Numbers in a block."""
    return sum(row[1] for row in rows)


_N_OWN, _N_SLOT = _width(_OWN), _width(_SLOT)


def layout(scenario: Scenario) -> tuple[Field, ...]:
    """Blocks of the flat observation, in order."""
    lidar: _Row = (
        "lidar",
        N_LIDAR_RAYS,
        0.0,
        1.0,
        "lidar_range_m",
        "free distance, counter-clockwise from ahead",
    )
    rows = [(f"own/{row[0]}", *row[1:]) for row in _OWN] + [lidar, _SURVEY]
    rows += [(f"slot{k}/{row[0]}", *row[1:]) for k in range(scenario.n_slots) for row in _SLOT]
    starts = np.cumsum([0] + [row[1] for row in rows]).tolist()
    return tuple(
        Field(name=name, start=start, size=size, low=low, high=high, unit=unit, meaning=meaning)
        for start, (name, size, low, high, unit, meaning) in zip(starts[:-1], rows, strict=True)
    )


def flat_space(fields: tuple[Field, ...]) -> spaces.Box:
    """Box of the flat observation."""
    low = np.concatenate([np.full(f.size, f.low, np.float32) for f in fields])
    high = np.concatenate([np.full(f.size, f.high, np.float32) for f in fields])
    return spaces.Box(low, high, dtype=np.float32)


def dict_space(fields: tuple[Field, ...]) -> spaces.Dict:
    """The same blocks by name."""
    return spaces.Dict({f.name: spaces.Box(f.low, f.high, (f.size,), np.float32) for f in fields})


def space_of(fields: tuple[Field, ...], *, as_dict: bool, n_choices: int) -> spaces.Space[Any]:
    """Space of one robot; ``n_choices`` > 0 puts a mask beside the flat observation of a dict."""
    if not as_dict:
        return flat_space(fields)
    if not n_choices:
        return dict_space(fields)
    mask = spaces.Box(0, 1, (n_choices,), np.int8)
    return spaces.Dict({"observation": flat_space(fields), "action_mask": mask})


def by_agent(
    rows: Float[np.ndarray, "robots numbers"],
    agents: list[str],
    fields: tuple[Field, ...] | None,
    masks: Int8[np.ndarray, "robots choices"] | None,
) -> dict[str, Any]:
    """Observations as `space_of` has them: of dicts where there are ``fields``."""
    if fields is None:
        return dict(zip(agents, rows, strict=True))
    if masks is None:
        return {agent: by_name(row, fields) for agent, row in zip(agents, rows, strict=True)}
    pairs = zip(agents, rows, masks.copy(), strict=True)  # infos have the same masks
    return {agent: {"observation": row, "action_mask": mask} for agent, row, mask in pairs}


def by_name(
    row: Float[np.ndarray, " numbers"], fields: tuple[Field, ...]
) -> Mapping[str, Float[np.ndarray, " size"]]:
    """Cut a flat observation into its blocks."""
    return {f.name: row[f.where] for f in fields}


def bin_azimuths() -> Float[np.ndarray, " bins"]:
    """Direction at the middle of each profile bin, body frame, rad."""
    return -np.pi + 2.0 * np.pi / N_BINS * (np.arange(N_BINS) + 0.5)


def observe(belief: Belief, scenario: Scenario) -> Float[np.ndarray, "robots numbers"]:
    """Flat observations of all robots, float32, one row each, within the bounds of `layout`."""
    n, n_survey = scenario.n_robots, N_BINS_ROOM**2
    out = np.empty((n, _N_OWN + N_LIDAR_RAYS + n_survey + scenario.n_slots * _N_SLOT), dtype=np.float32)
    rest = out[:, _N_OWN:]
    _put_own(out[:, :_N_OWN], belief, scenario)
    rest[:, :N_LIDAR_RAYS] = belief.sensed.lidar_m / scenario.arena.lidar_range_m
    rest[:, N_LIDAR_RAYS:][:, :n_survey] = belief.coverage.known.reshape(n, -1)
    _put_slots(rest[:, N_LIDAR_RAYS + n_survey :].reshape(n, -1, _N_SLOT), belief, scenario)
    return out


def _capped(value: np.ndarray) -> np.ndarray:
    """What is not negative anyway, within bounds."""
    return np.minimum(value, _CEILING)


def _put_own(out: np.ndarray, belief: Belief, scenario: Scenario) -> None:
    """Columns of `_OWN`."""
    pose, t, callee = belief.paths.estimate[:, -1], belief.t, belief.team.calls.callee
    calling = callee != NOBODY
    out[:, 0] = _capped(belief.err / scenario.rendezvous.err_threshold)
    out[:, 1] = np.minimum((t - belief.team.last_met) / scenario.n_steps, 1.0)
    out[:, 2], out[:, 3] = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    out[:, 4:6] = np.minimum(np.maximum(pose[:, :2] / scenario.arena.size_m, -1.0), 2.0)
    out[:, 6], out[:, 7] = calling, 0.0
    if calling.any():
        heard = calling & (belief.radio.rate_mbit_s[np.arange(len(callee)), callee] > 0.0)
        out[callee[heard], 7] = 1.0
    out[:, 8] = min(t / scenario.n_steps, 1.0)
    out[:, 9] = _capped(spread_m(belief.paths.covariance))
    out[:, 10] = _capped(spread_m(belief.paths.predicted_covariance[:, -1]))
    out[:, 11:13] = np.minimum(np.maximum(belief.paths.estimate[:, 0, :2] / scenario.arena.size_m, 0.0), 1.0)
    distance_m, bearing_rad = belief.sensed.sighted.T
    seen = distance_m > 0.0
    out[:, 13] = distance_m / (scenario.visual_range_m or 1.0)
    out[:, 14], out[:, 15] = seen * np.cos(bearing_rad), seen * np.sin(bearing_rad)


def _put_slots(out: np.ndarray, belief: Belief, scenario: Scenario) -> None:
    """Columns of `_SLOT`, (robots, slots, numbers)."""
    partner, callee = belief.radio.slots, belief.team.calls.callee
    robot = np.arange(len(partner))[:, None]
    link = robot * len(partner) + partner
    low, high = (limit / 30.0 for limit in _ESNR_DB)
    out[..., 0] = 1.0
    out[..., 1] = np.minimum(np.maximum(belief.radio.esnr_db.take(link) / 30.0, low), high)
    out[..., 2] = belief.radio.rate_mbit_s.take(link) / band_of(scenario.radio.bandwidth_hz).top_rate_mbit_s
    out[..., 3] = _capped(belief.radio.discrepancy.take(link))
    out[..., 4] = _capped(belief.err.take(partner) / scenario.rendezvous.err_threshold)
    out[..., 5] = callee.take(partner) == robot
    out[..., 6] = callee[:, None] == partner
    out[..., 7] = _capped(belief.team.observed.take(link) / scenario.rendezvous.kappa)
    fine = belief.radio.profile.reshape(*partner.shape, N_BINS, -1)
    each = (fine[..., k] for k in range(fine.shape[-1]))
    out[..., 8:] = functools.reduce(np.maximum, each)  # a short axis reduces slowly
    out[partner == NOBODY] = 0.0
