"""Episodes are the same to the bit: again, in another environment, from a copy, in another process."""

import copy
import hashlib
import pickle
import subprocess
import sys

import numpy as np
import pytest
from support.small_teams import KINDS

from envs import rendezvous_v0
from wifipgo.scenarios import SCENARIOS

SEED = 11


def steps_of(scenario: str) -> int:
    """How far a trajectory is followed."""
    return 50 if SCENARIOS[scenario].n_robots == 2 else 6


def trajectory_hash(env: rendezvous_v0.RendezvousEnv, n_steps: int) -> str:
    """Hash of everything that a seeded run hands out under seeded actions, over the ends of episodes."""
    digest, rng = hashlib.sha256(), np.random.default_rng(SEED)
    observations, infos = env.reset(seed=SEED)
    for _ in range(n_steps):
        if not env.agents:
            observations, infos = env.reset()
        actions = {a: rng.uniform(-1.0, 1.0, 3).astype(np.float32) for a in env.agents}
        for agent, row in observations.items():
            digest.update(agent.encode() + row.tobytes())
        observations, *rest, infos = env.step(actions)
        digest.update(repr((rest, infos)).encode() + env.state().tobytes())
    return digest.hexdigest()


def hash_of(scenario: str) -> str:
    """The same in an environment of its own."""
    return trajectory_hash(rendezvous_v0.parallel_env(scenario=scenario), steps_of(scenario))


@pytest.fixture(scope="module")
def elsewhere() -> dict[str, str]:
    """Hashes of all scenarios from one other process, without checks of shapes."""
    code = (
        "import sys; sys.path[:0] = ['tests', 'tests/contract']\n"
        "from test_repeatable_episodes import KINDS, hash_of\n"
        "for name in KINDS: print(name, hash_of(name))"
    )
    lines = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    return dict(line.split() for line in lines.splitlines())


@pytest.mark.parametrize("scenario", KINDS)
def test_the_same_again_and_anywhere(scenario: str, elsewhere: dict[str, str]) -> None:
    env = rendezvous_v0.parallel_env(scenario=scenario)
    first = trajectory_hash(env, steps_of(scenario))
    assert trajectory_hash(env, steps_of(scenario)) == first, "a second reset(seed) gave another trajectory"
    assert elsewhere[scenario] == first, "another process gave another trajectory"


@pytest.mark.parametrize("observation", ["flat", "dict"])
@pytest.mark.parametrize("scenario", KINDS)
def test_copies_are_made_of_the_arguments(scenario: str, observation: str) -> None:
    env = rendezvous_v0.parallel_env(scenario, observation=observation, reward="team_error", n_obstacles=2)
    before = env.reset(seed=SEED)[0]["robot_1"]
    for twin in (pickle.loads(pickle.dumps(env)), copy.deepcopy(env)):
        assert twin.scenario == env.scenario
        assert twin.observation_space("robot_1") == env.observation_space("robot_1")
        assert not twin.agents  # a copy begins before the first reset
        after = twin.reset(seed=SEED)[0]["robot_1"]
        np.testing.assert_equal(after, before)


def test_a_copy_of_fewer_steps_goes_the_same_way() -> None:
    env = rendezvous_v0.parallel_env("paper-hw-2-obstacles", max_cycles=4, err_threshold=2.0)
    twin = pickle.loads(pickle.dumps(env))
    assert trajectory_hash(twin, 10) == trajectory_hash(env, 10)
