"""The interface ``rays``: sixteen directions around the robot, some numbers for each, a choice among them.

A robot drives along one of the rays of its lidar as far as the way is free, or stays; and it calls or not.
What it is shown of each direction is the same in every direction, turned with its body: free way, how much
of the room would be new there, whether that way leads home, and how strongly the neighbour is heard. So one
small network scores all directions, and nothing has to be learned sixteen times.

All of it is computed from what the robot observes, nothing from elsewhere.
"""

import functools

import numpy as np
from jaxtyping import Float, Shaped

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


class Rays:
    """Sixteen directions and a stop, times a call.

    Shown, in this order: `N_WHOLE` numbers of the robot, then `N_DIRECTION` blocks of one number for each
    direction, counter-clockwise from ahead. Any number of neighbours will do: it heeds one at a time.
    """

    reads: tuple[str, ...] = READS
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

    def shown(self, rows: Rows) -> Shown:
        """Numbers of the robot, then those of each direction; float32."""
        heading_rad = np.arctan2(*self._block(rows, "own/heading").T[::-1])
        to_start = self._steps_per_room * (self._block(rows, "own/start") - self._block(rows, "own/position"))
        home_steps, home_rad = np.hypot(*to_start.T), np.arctan2(*to_start.T[::-1]) - heading_rad
        new = self._new(rows)
        slot = self._heeded(rows)
        whole = [self._whole(rows, home_steps, slot), new.mean(axis=(1, 2))[:, None]]
        blocks = [*self._free(rows), *self._ahead(rows, new, heading_rad)]
        blocks += [*_homeward(home_rad, home_steps), *self._heard(rows, slot)]
        return np.concatenate([*whole, *blocks], axis=1, dtype=np.float32, casting="same_kind")

    def commands(self, answers: Shaped[np.ndarray, "rows 2"], rows: Rows) -> Actions:
        """Drive along the chosen ray as far as a step or what is in the way allows; call or not."""
        motion, call = np.asarray(answers).T
        request = np.where(call > 0, 1.0, -1.0)
        return np.column_stack([waypoints_of(motion, self._free_steps(rows)), request]).astype(np.float32)

    def answers(self, actions: Actions) -> Shaped[np.ndarray, "rows 2"]:
        """Nearest ray of a waypoint, a stop for one that is very near; and the call."""
        x, y, request = actions.T
        ray = np.rint(np.arctan2(y, x) / (2.0 * np.pi / N_LIDAR_RAYS)).astype(np.int64) % N_LIDAR_RAYS
        return np.stack([np.where(np.hypot(x, y) < 0.05, STAY, ray), (request > 0.0).astype(np.int64)], 1)

    def _block(self, rows: Rows, name: str) -> np.ndarray:
        return rows[:, pick(self._fields, name, "block of the observation").where].astype(np.float64)

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
        return self._steps_per_range * self._block(rows, "lidar")

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
        around = _disc(side, self._seen_steps / self._steps_per_room * side)
        gain = (new.reshape(len(new), -1) @ around).reshape(-1, side, side)
        angle_rad = heading_rad[:, None] + ray_azimuths()
        unit = np.stack([np.cos(angle_rad), np.sin(angle_rad)], axis=-1) / self._steps_per_room
        here = self._block(rows, "own/position")[:, None]
        return [_sampled(gain, side * (here + reach * unit)) for reach in _REACHES]

    def _heard(self, rows: Rows, slot: np.ndarray) -> list[np.ndarray]:
        """The neighbour's signal from each direction, and a robot in sight there."""
        profile = self._slot(rows, "profile", slot)
        loudest = np.maximum(profile.max(axis=1, keepdims=True), 1e-9)
        sector = np.rint(bin_azimuths() / (2.0 * np.pi / N_LIDAR_RAYS)).astype(np.int64) % N_LIDAR_RAYS
        heard = np.stack([profile[:, sector == k].max(axis=1) for k in range(N_LIDAR_RAYS)], axis=1)
        cosine, sine = self._block(rows, "own/sighted_bearing").T[:, :, None]
        seen = cosine * np.cos(ray_azimuths()) + sine * np.sin(ray_azimuths())
        return [heard / loudest, seen]


def _homeward(home_rad: np.ndarray, home_steps: np.ndarray) -> list[np.ndarray]:
    """Whether a direction leads to the start, and how much nearer a step that way comes to it."""
    towards = np.cos(ray_azimuths() - home_rad[:, None])
    after = np.sqrt(np.maximum(home_steps[:, None] ** 2 - 2.0 * home_steps[:, None] * towards + 1.0, 0.0))
    return [towards * (home_steps[:, None] > 0.0), home_steps[:, None] - after]


@functools.lru_cache(maxsize=8)
def _disc(side: int, radius_bins: float) -> Float[np.ndarray, "squares squares"]:
    """Weight of each square for what is seen from another: 1 in range, and all together 1 in the open."""
    middle = np.stack(np.meshgrid(np.arange(side), np.arange(side), indexing="ij"), -1).reshape(-1, 2)
    near = np.hypot(*(middle[:, None] - middle[None]).T) <= radius_bins
    return near / near.sum(axis=0).max()


def _sampled(gain: Float[np.ndarray, "rows side side"], p_bins: np.ndarray) -> Float[np.ndarray, "rows rays"]:
    """Values at points, linear between the middles of squares; 0 outside the room."""
    side = gain.shape[1]
    padded = np.pad(gain, ((0, 0), (1, 1), (1, 1)))
    p = np.clip(p_bins + 0.5, 0.0, side + 0.999)
    low = np.floor(p).astype(np.int64)
    share = p - low
    row = np.arange(len(gain))[:, None]
    out = np.zeros(p.shape[:2])
    for dx in (0, 1):
        for dy in (0, 1):
            weight = np.abs(1 - dx - share[..., 0]) * np.abs(1 - dy - share[..., 1])
            x, y = np.minimum(low[..., 0] + dx, side + 1), np.minimum(low[..., 1] + dy, side + 1)
            out += weight * padded[row, x, y]
    return out
