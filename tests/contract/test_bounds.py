"""Whatever robots are told to do, what comes back stays in its space: 13 000 observations."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from envs import rendezvous_v0
from wifipgo.scenarios import SCENARIOS
from wifipgo.state import Tick

SMALL = [name for name, scenario in SCENARIOS.items() if scenario.n_robots == 2]
STRETCH = 10  # steps that a team keeps to one way of driving

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
drives = st.lists(st.sampled_from(DRIVES), min_size=5, max_size=5)


def check_episode(env: rendezvous_v0.RendezvousEnv, seed: int, plan: list[Drive]) -> int:
    """Run an episode by plan and look at everything that comes out; returns its steps."""
    rng, n_steps = np.random.default_rng(seed), 0
    observations, _ = env.reset(seed=seed)
    box = env.observation_space("robot_0")
    size_m, radius_m = env.scenario.arena.size_m, env.scenario.arena.robot_radius_m
    for drive in plan:
        for _ in range(STRETCH):
            if not env.agents:
                return n_steps
            rows = drive(env.tick, size_m, rng).astype(np.float32)
            observations, rewards, *_ = env.step(dict(zip(env.agents, rows, strict=True)))
            n_steps += 1
            assert all(box.contains(row) for row in observations.values())
            assert np.isfinite(list(rewards.values())).all()
            assert env.state_space.contains(env.state())
            p_m = env.tick.truth.poses[:, -1, :2]
            assert (p_m > radius_m / 2).all(), "through a wall"
            assert (p_m < size_m - radius_m / 2).all(), "through a wall"
    return n_steps


@pytest.mark.parametrize("scenario", SMALL)
def test_two_robots_stay_in_bounds(scenario: str) -> None:
    env, done = rendezvous_v0.parallel_env(scenario, max_measurements=0), []

    @settings(max_examples=12)
    @given(seed=st.integers(0, 2**32 - 1), plan=drives)
    def run(seed: int, plan: list[Drive]) -> None:
        done.append(check_episode(env, seed, plan))

    run()
    assert sum(done) == 600


@pytest.mark.parametrize(
    "changes",
    [
        {"size_m": 4.0, "clearance_m": 0.5},
        {"tx_power_dbm": 30.0, "n_obstacles": 6},
        {"tx_power_dbm": -60.0},
        {"sigma_t_m": 2.0, "sigma_r_rad": 1.5, "outlier_share": 0.9},
        {"estimator": "every_step", "err_weights": "information", "outliers": "bearing"},
        {"packet_loss": 0.9},
    ],
    ids="-".join,
)
def test_hard_conditions_stay_in_bounds(changes: dict[str, Any]) -> None:
    env = rendezvous_v0.parallel_env("paper-hw-2", **changes)

    @settings(max_examples=2)
    @given(seed=st.integers(0, 2**32 - 1), plan=drives)
    def run(seed: int, plan: list[Drive]) -> None:
        check_episode(env, seed, plan)

    run()


def test_fifty_robots_stay_in_bounds() -> None:
    env = rendezvous_v0.parallel_env("paper-sim-50")
    assert check_episode(env, 0, [at_each_other, into_the_corner, beyond, stand_and_call, one_corner]) == 50
    crowd = rendezvous_v0.parallel_env("paper-sim-50", size_m=12.0, clearance_m=0.3, n_steps=20)
    assert check_episode(crowd, 0, [at_each_other, into_the_corner]) == 20
