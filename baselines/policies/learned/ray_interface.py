"""The interface ``rays``: sixteen directions around the robot, some numbers for each, a choice among them.

A robot drives along one of the rays of its lidar as far as the way is free, or stays; and it calls or not.
What it is shown of each direction is the same in every direction, turned with its body: free way, how much
of the room would be new there, whether that way leads home, and how strongly the neighbour is heard. So one
small network scores all directions, and nothing has to be learned sixteen times.

All of it is computed from what the robot observes, nothing from elsewhere.
"""

import functools
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int, Shaped

from envs.directions import N_MOTIONS, STAY, ray_azimuths, waypoints_of
from envs.rendezvous_v0 import bin_azimuths, layout
from wifipgo.errors import pick
from wifipgo.scenarios import Scenario
from wifipgo.world.lidar import N_LIDAR_RAYS

# Distances, in step lengths, at which a direction is asked how much would be new there.
_REACHES = (1.0, 2.0, 3.0, 5.0, 8.0)
# Free way beyond this many steps is all the same.
_FREE_STEPS = 2.0
# Numbers of one direction, of which the lidar has three, and of the robot as a whole.
N_DIRECTION = 3 + len(_REACHES) + 4
_OWN = ("elapsed", "since_met", "err", "spread", "recorded_spread", "calling", "called", "sighted")
_SLOT = ("present", "esnr", "rate", "discrepancy", "err", "calls_me", "i_call", "observed")
N_WHOLE = len(_OWN) + len(_SLOT) + 5
_PLACE = ("heading", "position", "start", "sighted_bearing")
# Blocks that are read; of further slots the same as of the first.
READS = (
    *(f"own/{name}" for name in (*_OWN, *_PLACE)),
    *("lidar", "survey"),
    *(f"slot0/{name}" for name in (*_SLOT, "profile")),
)

Rows = Float[np.ndarray, "rows numbers"]
Shown = Float[np.ndarray, "rows shown"]
Actions = Float[np.ndarray, "rows 3"]
Begins = Bool[np.ndarray, " rows"] | None


class Rays:
    """Sixteen directions and a stop, times a call.

    Shown, in this order: `N_WHOLE` numbers of the robot, then `N_DIRECTION` blocks of one number for each
    direction, counter-clockwise from ahead. Any number of neighbours will do: it heeds one at a time.
    """

    reads: tuple[str, ...] = READS
    n_whole = N_WHOLE
    n_shown = N_WHOLE + N_DIRECTION * N_LIDAR_RAYS
    n_choices: tuple[int, ...] = (N_MOTIONS, 2)

    def __init__(self, scenario: Scenario) -> None:
        """Learn the layout, the scale of the room and the length of an episode."""
        self._fields = {field.name: field for field in layout(scenario)}
        arena = scenario.arena
        # One step length for all: observations do not say which robot they are of.
        step_m = max(float(arena.steps_m(scenario.n_robots).mean()), 1e-6)
        self._n_slots = scenario.n_slots
        self._steps_per_range = arena.lidar_range_m / step_m
        self._steps_per_room = arena.size_m / step_m
        self._seen_steps = scenario.sensing.sensor_range_m / step_m
        self._n_steps = scenario.n_steps
        lengths = (self._steps_per_range, self._steps_per_room, self._seen_steps)
        self.scale: tuple[float, ...] = (*lengths, float(self._n_steps))

    def remembered(self, rows: Rows, memory: Any, begins: Begins = None) -> Any:
        """Nothing: all that it shows is observed."""
        return None

    def shown(self, rows: Rows, memory: Any = None) -> Shown:
        """Numbers of the robot, then those of each direction; float32."""
        whole, blocks = self._parts(rows.astype(np.float64))
        return np.concatenate([*whole, *blocks], axis=1, dtype=np.float32, casting="same_kind")

    def _parts(self, rows: Rows) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Numbers of the robot, and blocks of one number for each direction."""
        heading_rad = np.arctan2(*self._block(rows, "own/heading").T[::-1])
        to_start = self._steps_per_room * (self._block(rows, "own/start") - self._block(rows, "own/position"))
        home_steps, home_rad = np.hypot(*to_start.T), np.arctan2(*to_start.T[::-1]) - heading_rad
        new = self._new(rows)
        slot = self._heeded(rows)
        whole = [self._whole(rows, home_steps, slot), new.mean(axis=(1, 2))[:, None]]
        blocks = [*self._free(rows), *self._ahead(rows, new, heading_rad)]
        blocks += [*_homeward(home_rad, home_steps), *self._heard(rows, slot)]
        return whole, blocks

    def commands(self, answers: Shaped[np.ndarray, "rows 2"], rows: Rows) -> Actions:
        """Drive along the chosen ray as far as a step or what is in the way allows; call or not."""
        motion, call = np.asarray(answers).T
        request = np.where(call > 0, 1.0, -1.0)
        free_steps = self._free_steps(rows)
        return np.column_stack([waypoints_of(motion, free_steps), request]).astype(np.float32)

    def answers(self, actions: Actions) -> Shaped[np.ndarray, "rows 2"]:
        """Nearest ray of a waypoint, a stop for one that is very near; and the call."""
        x, y, request = actions.T
        ray = np.rint(np.arctan2(y, x) / (2.0 * np.pi / N_LIDAR_RAYS)).astype(np.int64) % N_LIDAR_RAYS
        return np.stack([np.where(np.hypot(x, y) < 0.05, STAY, ray), (request > 0.0).astype(np.int64)], 1)

    def _block(self, rows: Rows, name: str) -> np.ndarray:
        return rows[:, pick(self._fields, name, "block of the observation").where]

    def _slots(self, rows: Rows, name: str) -> np.ndarray:
        """A block of every neighbour, (rows, slots, numbers)."""
        return np.stack([self._block(rows, f"slot{k}/{name}") for k in range(self._n_slots)], axis=1)

    def _heeded(self, rows: Rows) -> np.ndarray:
        """Slot of one neighbour: one that calls, and of several the one that is heard best."""
        calls, present, esnr = (self._slots(rows, name)[..., 0] for name in ("calls_me", "present", "esnr"))
        return (100.0 * calls + 10.0 * present + esnr).argmax(axis=1)

    def _slot(self, rows: Rows, name: str, slot: np.ndarray) -> np.ndarray:
        """A block of the neighbour in one slot."""
        return self._slots(rows, name)[np.arange(len(rows)), slot]

    def _whole(self, rows: Rows, home_steps: np.ndarray, slot: np.ndarray) -> np.ndarray:
        """Numbers of the robot; errors on a scale that tells 0.5 from 1 and 5 from 10."""
        own = {name: self._block(rows, f"own/{name}")[:, 0] for name in _OWN}
        other = {name: self._slot(rows, name, slot)[:, 0] for name in _SLOT}
        for block in (own, other):
            block["err"] = np.log1p(block["err"])
        for name in ("spread", "recorded_spread"):
            own[name] = np.log1p(4.0 * own[name])
        gain = np.maximum(own["spread"] - own["recorded_spread"], 0.0)
        worse = own["err"] - other["err"]
        left = home_steps / np.maximum(self._n_steps * (1.0 - own["elapsed"]), 1.0)
        return np.stack([*own.values(), *other.values(), gain, worse, home_steps / 5.0, left], axis=1)

    def _free_steps(self, rows: Rows) -> np.ndarray:
        return self._steps_per_range * self._block(rows, "lidar").astype(np.float64)

    def _free(self, rows: Rows) -> list[np.ndarray]:
        """Free way along each ray and along its neighbours, in steps."""
        free = np.minimum(self._free_steps(rows), _FREE_STEPS)
        return [free, np.roll(free, 1, axis=1), np.roll(free, -1, axis=1)]

    def _new(self, rows: Rows) -> np.ndarray:
        """Doubt about each square of the room: 1 where it was not seen."""
        survey = self._block(rows, "survey")
        side = int(np.sqrt(survey.shape[1]))
        return 1.0 - survey.reshape(-1, side, side)

    def _ahead(self, rows: Rows, new: np.ndarray, heading_rad: np.ndarray) -> list[np.ndarray]:
        """How much is new around points along each direction; what is outside the room is not."""
        side = new.shape[1]
        gain = around(new, self._seen_steps / self._steps_per_room * side)
        angle_rad = heading_rad[:, None] + ray_azimuths()
        x, y = self._block(rows, "own/position").T[:, :, None, None]
        reaches = np.array(_REACHES)[:, None]
        x_bins = side * (x + reaches * (np.cos(angle_rad) / self._steps_per_room)[:, None])
        y_bins = side * (y + reaches * (np.sin(angle_rad) / self._steps_per_room)[:, None])
        return list(sampled(gain, x_bins, y_bins, side).transpose(1, 0, 2))

    def _heard(self, rows: Rows, slot: np.ndarray) -> list[np.ndarray]:
        """The neighbour's signal from each direction, and a robot in sight there."""
        profile = self._slot(rows, "profile", slot)
        loudest = np.maximum(profile.max(axis=1, keepdims=True), 1e-9)
        by_sector, begins = _sectors()
        heard = np.maximum.reduceat(profile[:, by_sector], begins, axis=1)
        cosine, sine = self._block(rows, "own/sighted_bearing").T[:, :, None]
        seen = cosine * np.cos(ray_azimuths()) + sine * np.sin(ray_azimuths())
        return [heard / loudest, seen]


def _homeward(home_rad: np.ndarray, home_steps: np.ndarray) -> list[np.ndarray]:
    """Whether a direction leads to the start, and how much nearer a step that way comes to it."""
    towards = np.cos(ray_azimuths() - home_rad[:, None])
    after = np.sqrt(np.maximum(home_steps[:, None] ** 2 - 2.0 * home_steps[:, None] * towards + 1.0, 0.0))
    return [towards * (home_steps[:, None] > 0.0), home_steps[:, None] - after]


@functools.cache
def _sectors() -> tuple[Int[np.ndarray, " bins"], Int[np.ndarray, " rays"]]:
    """Bins of a profile in the order of the rays that they are nearest to, and where each ray's begin."""
    sector = np.rint(bin_azimuths() / (2.0 * np.pi / N_LIDAR_RAYS)).astype(np.int64) % N_LIDAR_RAYS
    by_sector = np.argsort(sector, kind="stable")
    return by_sector, np.searchsorted(sector[by_sector], np.arange(N_LIDAR_RAYS))


def around(new: Float[np.ndarray, "rows side side"], radius_bins: float) -> Float[np.ndarray, "rows n n"]:
    """Sum over the squares in range of each, 1 where all are new in the open; zeros between the rooms.

    A disc is made of runs along y, each widened from a narrower one. Rooms lie one after the other with
    zeros between their lines, so a shift of the whole array shifts every line.
    """
    n_rows, side = new.shape[:2]
    half = _half_widths(side, radius_bins)
    most = len(half) - 1
    n = side + max(most, 1)
    wide = np.zeros(n_rows * n * n + 2 * most)
    lines = wide[most : most + n_rows * n * n]
    lines.reshape(n_rows, n, n)[:, :side, :side] = new
    runs = [lines]
    for h in range(1, half[0] + 1):
        runs.append(runs[-1] + wide[most - h :][: lines.size] + wide[most + h :][: lines.size])
    out = runs[half[0]].copy()
    for dx in range(1, most + 1):
        out[dx * n :] += runs[half[dx]][: -dx * n]
        out[: -dx * n] += runs[half[dx]][dx * n :]
    out /= _most_in_range(side, half)
    rooms = out.reshape(n_rows, n, n)
    rooms[:, side:] = rooms[:, :, side:] = 0.0
    return rooms


@functools.lru_cache(maxsize=8)
def _half_widths(side: int, radius_bins: float) -> tuple[int, ...]:
    """Squares of a disc to either side of its middle, in the line of the middle and those beside it."""
    offsets = np.arange(min(int(radius_bins), side - 1) + 1)
    inside = np.hypot(offsets[:, None], offsets) <= radius_bins
    return tuple((np.count_nonzero(inside, axis=1) - 1).tolist())


@functools.lru_cache(maxsize=8)
def _most_in_range(side: int, half: tuple[int, ...]) -> float:
    """Squares of the room in range of the square that has the most of them."""
    middle = np.arange(side)
    counts = np.zeros((side, side))
    for dx in range(-len(half) + 1, len(half)):
        inside = (middle + dx >= 0) & (middle + dx < side)
        run = np.minimum(middle, half[abs(dx)]) + np.minimum(side - 1 - middle, half[abs(dx)]) + 1
        counts += inside[:, None] * run
    return float(counts.max())


def sampled(
    gain: Float[np.ndarray, "rows n n"],
    x_bins: Float[np.ndarray, "rows reaches rays"],
    y_bins: Float[np.ndarray, "rows reaches rays"],
    side: int,
) -> Float[np.ndarray, "rows reaches rays"]:
    """Values at points, linear between the middles of squares; 0 outside a room of so many squares."""
    n = gain.shape[1]
    x, y = (np.clip(p + 0.5, 0.0, side + 0.999) for p in (x_bins, y_bins))
    x_low, y_low = x.astype(np.int64), y.astype(np.int64)
    x -= x_low
    y -= y_low
    x_left, y_left = 1.0 - x, 1.0 - y
    # One line and one square further; what lies before the first room is the end of the last: zeros too.
    last = x_low * n + y_low + np.arange(0, gain.size, n * n)[:, None, None]
    flat = gain.ravel()
    out = x_left * y_left * flat[last - n - 1]
    out += x_left * y * flat[last - n]
    out += x * y_left * flat[last - 1]
    out += x * y * flat[last]
    return out
