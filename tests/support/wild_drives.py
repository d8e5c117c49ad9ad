"""Teams driven in every way that an action allows, with a look at all that comes out, for thousands of steps.

Run as a program, it plays one of `GROUPS` and prints how many steps that were. Type checks of the test
run make a step several times as slow, so the tests run most steps in a process of their own.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from gymnasium import spaces
from hypothesis import given, seed, settings
from hypothesis import strategies as st

from envs.rendezvous_v0 import RendezvousEnv, parallel_env
from wifipgo.scenarios import SCENARIOS
from wifipgo.state import Tick

STRETCH, N_STRETCHES = 10, 5  # steps that a team keeps to one way of driving, and ways in an episode

Drive = Callable[[Tick, float, np.random.Generator], np.ndarray]


def anywhere(tick: Tick, size_m: float, rng: np.random.Generator) -> np.ndarray:
    return rng.uniform(-1.0, 1.0, (len(tick.belief.err), 3))


def one_corner(tick: Tick, size_m: float, rng: np.random.Generator) -> np.ndarray:
    """A corner of the action box, the same for all."""
    return np.tile(rng.choice([-1.0, 1.0], 3), (len(tick.belief.err), 1))


def own_corners(tick: Tick, size_m: float, rng: np.random.Generator) -> np.ndarray:
    return rng.choice([-1.0, 0.0, 1.0], (len(tick.belief.err), 3))


def beyond(tick: Tick, size_m: float, rng: np.random.Generator) -> np.ndarray:
    """Finite, far outside the action box, and next to nothing."""
    return rng.choice([-3e38, 1e30, 1e-40, -0.0], (len(tick.belief.err), 3))


def stand_and_call(tick: Tick, size_m: float, rng: np.random.Generator) -> np.ndarray:
    return np.tile([0.0, 0.0, 1.0], (len(tick.belief.err), 1))


def at_each_other(tick: Tick, size_m: float, rng: np.random.Generator) -> np.ndarray:
    """Everyone drives at the next robot, and calls."""
    return towards(tick, np.roll(tick.truth.poses[:, -1, :2], 1, axis=0))


def into_the_corner(tick: Tick, size_m: float, rng: np.random.Generator) -> np.ndarray:
    """Everyone drives through the walls of one corner, and calls."""
    return towards(tick, np.tile(rng.choice([-1.0, size_m + 1.0], 2), (len(tick.belief.err), 1)))


def towards(tick: Tick, goals_m: np.ndarray) -> np.ndarray:
    """Full steps towards true goals, in the true body frame."""
    pose = tick.truth.poses[:, -1]
    gap = goals_m - pose[:, :2]
    bearing = np.arctan2(gap[:, 1], gap[:, 0]) - pose[:, 2]
    return np.stack([np.cos(bearing), np.sin(bearing), np.ones(len(pose))], axis=1)


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
    """Episodes of one environment, each by another seed and plan."""

    scenario: str
    n_episodes: int
    changes: dict[str, Any] = field(default_factory=dict)
    observation: str = "flat"

    def play(self, place: int) -> int:
        """Run the episodes that hypothesis thinks of at this place of a list; returns their steps."""
        env = parallel_env(self.scenario, observation=self.observation, **self.changes)
        plans, done = st.lists(st.sampled_from(DRIVES), min_size=N_STRETCHES, max_size=N_STRETCHES), []

        @seed(place)
        @settings(max_examples=self.n_episodes, deadline=None, database=None)
        @given(world=st.integers(0, 2**32 - 1), plan=plans)
        def episodes(world: int, plan: list[Drive]) -> None:
            done.append(play_episode(env, world, plan))

        episodes()
        return sum(done)


def play_episode(env: RendezvousEnv, world: int, plan: list[Drive]) -> int:
    """Run an episode by plan and look at everything that comes out; returns its steps."""
    rng, n_steps = np.random.default_rng(world), 0
    env.reset(seed=world)
    box, size_m = env.observation_space("robot_0"), env.scenario.arena.size_m
    for drive in plan:
        for _ in range(STRETCH):
            if not env.agents:
                return n_steps
            rows = drive(env.tick, size_m, rng).astype(np.float32)
            observations, rewards, *_ = env.step(dict(zip(env.agents, rows, strict=True)))
            n_steps += 1
            check_within(box, list(observations.values()))
            check_within(env.state_space, [env.state()])
            assert np.isfinite(list(rewards.values())).all()
            p_m, hull_m = env.tick.truth.poses[:, -1, :2], env.scenario.arena.robot_radius_m / 2.0
            assert hull_m < p_m.min() <= p_m.max() < size_m - hull_m, "through a wall"
    return n_steps


def check_within(space: spaces.Space[Any], rows: list[Any]) -> None:
    """What `space.contains` says of each row, for all rows at once."""
    if isinstance(space, spaces.Dict):
        assert all(row.keys() == space.keys() for row in rows)
        for name, part in space.items():
            check_within(part, [row[name] for row in rows])
        return
    assert isinstance(space, spaces.Box)
    assert {(row.shape, row.dtype) for row in rows} == {(space.shape, space.dtype)}
    values = np.stack(rows)
    inside = (values >= space.low) & (values <= space.high)  # False for nan
    assert inside.all(), f"{values[~inside]} at {np.argwhere(~inside).tolist()}"


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
    "flat": [Trial(name, 16, WHOLE) for name in SMALL],
    "dict": [Trial(name, 7, WHOLE, "dict") for name in SMALL],
    "hard": [Trial("paper-hw-2", 4, HARD[k], ("flat", "dict")[k % 2]) for k in range(len(HARD))],
    "many": [Trial("paper-sim-50", 1), Trial("paper-sim-50", 1, CROWD, "dict")],
}


if __name__ == "__main__":
    print(sum(trial.play(place) for place, trial in enumerate(GROUPS[sys.argv[1]])))
