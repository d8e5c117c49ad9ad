"""Teams driven in every way that an action allows, with a look at all that comes out, for thousands of steps.

Run as a program, it plays all `GROUPS` and prints how many steps that were. Type checks of the test run make
a step several times as slow, so the tests run most steps in a process of their own.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from gymnasium import spaces
from jaxtyping import Float

from envs.rendezvous_v0 import RendezvousVectorEnv, vector_env
from wifipgo.scenarios import SCENARIOS

STRETCH, N_STRETCHES = 10, 5  # steps that a team keeps to one way of driving, and ways in an episode

Poses = Float[np.ndarray, "robots 3"]
Drive = Callable[[Poses, float, np.random.Generator], np.ndarray]


def anywhere(poses: Poses, size_m: float, rng: np.random.Generator) -> np.ndarray:
    return rng.uniform(-1.0, 1.0, (len(poses), 3))


def one_corner(poses: Poses, size_m: float, rng: np.random.Generator) -> np.ndarray:
    """A corner of the action box, the same for all."""
    return np.tile(rng.choice([-1.0, 1.0], 3), (len(poses), 1))


def own_corners(poses: Poses, size_m: float, rng: np.random.Generator) -> np.ndarray:
    return rng.choice([-1.0, 0.0, 1.0], (len(poses), 3))


def beyond(poses: Poses, size_m: float, rng: np.random.Generator) -> np.ndarray:
    """Finite, far outside the action box, and next to nothing."""
    return rng.choice([-3e38, 1e30, 1e-40, -0.0], (len(poses), 3))


def stand_and_call(poses: Poses, size_m: float, rng: np.random.Generator) -> np.ndarray:
    return np.tile([0.0, 0.0, 1.0], (len(poses), 1))


def at_each_other(poses: Poses, size_m: float, rng: np.random.Generator) -> np.ndarray:
    """Everyone drives at the next robot, and calls."""
    return towards(poses, np.roll(poses[:, :2], 1, axis=0))


def into_the_corner(poses: Poses, size_m: float, rng: np.random.Generator) -> np.ndarray:
    """Everyone drives through the walls of one corner, and calls."""
    return towards(poses, np.tile(rng.choice([-1.0, size_m + 1.0], 2), (len(poses), 1)))


def towards(poses: Poses, goals_m: np.ndarray) -> np.ndarray:
    """Full steps towards true goals, in the true body frame."""
    gap = goals_m - poses[:, :2]
    bearing = np.arctan2(gap[:, 1], gap[:, 0]) - poses[:, 2]
    return np.stack([np.cos(bearing), np.sin(bearing), np.ones(len(poses))], axis=1)


DRIVES: tuple[Drive, ...] = (
    anywhere,
    one_corner,
    own_corners,
    beyond,
    stand_and_call,
    at_each_other,
    into_the_corner,
)


@dataclass(frozen=True)
class Trial:
    """Worlds of one environment side by side, each by another seed and plan."""

    scenario: str
    n_worlds: int
    changes: dict[str, Any] = field(default_factory=dict)
    observation: str = "flat"

    def play(self, place: int) -> int:
        """Run the episodes at this place of a list and look at all that comes out; returns their steps."""
        env = vector_env(self.scenario, n_worlds=self.n_worlds, observation=self.observation, **self.changes)
        rngs = [np.random.default_rng([place, k]) for k in range(self.n_worlds)]
        plans = [rng.integers(len(DRIVES), size=N_STRETCHES) for rng in rngs]
        env.reset(seed=[int(rng.integers(2**32)) for rng in rngs])
        n_steps, size_m = 0, env.scenario.arena.size_m
        for stretch in np.repeat(np.arange(N_STRETCHES), STRETCH):
            if env.over.all():
                break
            n_steps += int((~env.over).sum())
            drives = zip(plans, poses_of(env), rngs, strict=True)
            rows = [DRIVES[plan[stretch]](poses, size_m, rng) for plan, poses, rng in drives]
            check_step(env, np.stack(rows).astype(np.float32))
        return n_steps


def poses_of(env: RendezvousVectorEnv) -> Float[np.ndarray, "worlds robots 3"]:
    """Where the robots of all worlds truly are."""
    (cohort,) = env.cohorts
    return cohort.episode.tick.truth.poses[:, -1].reshape(env.n_worlds, env.n_robots, 3)


def check_step(env: RendezvousVectorEnv, actions: np.ndarray) -> None:
    """Take a step; observations and state are in their spaces, rewards finite, and no robot is in a wall."""
    step = env.step(actions)
    check_within(env.single_observation_space, step.observations)
    check_within(env.state_space, env.state())
    assert np.isfinite(step.rewards).all()
    p_m, arena = poses_of(env)[..., :2], env.scenario.arena
    hull_m = arena.robot_radius_m / 2.0
    assert hull_m < p_m.min() <= p_m.max() < arena.size_m - hull_m, "through a wall"


def check_within(space: spaces.Space[Any], rows: Any) -> None:
    """What `space.contains` says of each row of an array whose last axes are those of the space."""
    if isinstance(space, spaces.Dict):
        assert rows.keys() == space.keys()
        for name, part in space.items():
            check_within(part, rows[name])
        return
    assert isinstance(space, spaces.Box)
    assert (rows.shape[rows.ndim - len(space.shape) :], rows.dtype) == (space.shape, space.dtype)
    inside = (rows >= space.low) & (rows <= space.high)  # False for nan
    assert inside.all(), f"{rows[~inside]} at {np.argwhere(~inside).tolist()}"


CUP = ((3.0, 3.0), (7.0, 3.0), (7.0, 4.0), (4.0, 4.0), (4.0, 5.0), (7.0, 5.0), (7.0, 6.0), (3.0, 6.0))
HARD: tuple[dict[str, Any], ...] = (
    {"size_m": 4.0, "clearance_m": 0.5},
    {"tx_power_dbm": 30.0, "n_obstacles": 6},
    {"tx_power_dbm": -60.0},
    {"sigma_t_m": 2.0, "sigma_r_rad": 1.5, "outlier_share": 0.9},
    {"estimator": "every_step", "err_weights": "information", "outliers": "bearing"},
    {"estimator": "every_step", "aoa_factors": True},
    {"backend": "distributed", "message_loss": 0.3},
    {"packet_loss": 0.9, "agc": True, "int8": True},
    {"obstacles_m": (CUP,), "size_m": 10.0},
    {"n_robots": 4, "n_slots": 3, "size_m": 5.0},
)
SMALL = [name for name, scenario in SCENARIOS.items() if scenario.n_robots == 2]
WHOLE = {"max_measurements": 0}  # episodes that nothing ends early
CROWD = {"size_m": 12.0, "clearance_m": 0.3, "n_steps": 20}
GROUPS = {
    "small": [Trial(name, 15, WHOLE, ("flat", "dict")[k % 2]) for k, name in enumerate(SMALL)],
    "hard": [Trial("paper-hw-2", 4, HARD[k], ("flat", "dict")[k % 2]) for k in range(len(HARD))],
    "many": [Trial("paper-sim-50", 1), Trial("paper-sim-50", 1, CROWD, "dict")],
}


def play_all() -> dict[str, int]:
    """Steps of each group."""
    return {name: sum(trial.play(k) for k, trial in enumerate(trials)) for name, trials in GROUPS.items()}


if __name__ == "__main__":
    print(json.dumps(play_all()))
