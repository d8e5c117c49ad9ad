"""What a user sees at a prompt: what is not there yet is no error, and a repr says what it is."""

import pickle
from collections.abc import Callable, Mapping
from typing import Any

import gymnasium
import pytest

from baselines.policies import POLICIES, make_policy
from envs import rendezvous_v0
from envs.puffer_env import RendezvousPufferEnv
from train import TranslatedEnv
from wifipgo.scenarios import SCENARIOS, Scenario, scenario_named

SHORT: dict[str, Any] = {"n_steps": 3}
TEAM = "wifipgo/RendezvousTeam-v0"
MAKERS: Mapping[str, Callable[[], Any]] = {
    "parallel": lambda: rendezvous_v0.parallel_env(**SHORT),
    "turn-based": lambda: rendezvous_v0.env(**SHORT),
    "turn-based, unchecked": lambda: rendezvous_v0.raw_env(**SHORT),
    "many worlds": lambda: rendezvous_v0.vector_env(n_worlds=2, **SHORT),
    "team": lambda: rendezvous_v0.RendezvousTeamEnv(**SHORT),
    "many teams": lambda: rendezvous_v0.RendezvousTeamVectorEnv(num_envs=2, **SHORT),
    "gymnasium's team": lambda: gymnasium.make(TEAM, **SHORT).unwrapped,
    "gymnasium's many teams": lambda: gymnasium.make_vec(TEAM, num_envs=2, **SHORT),
    "rows": lambda: RendezvousPufferEnv(num_worlds=2, **SHORT),
    "as a network meets it": lambda: TranslatedEnv("paper-hw-2", **SHORT),
}
OF_AN_EPISODE = ("tick", "world", "over", "cohorts")

kinds = pytest.mark.parametrize("kind", MAKERS)


@kinds
def test_nothing_that_is_asked_for_before_a_reset_is_an_error(kind: str) -> None:
    """What is not there yet is not there: ``hasattr`` says so, ``getattr`` takes its default."""
    env = MAKERS[kind]()
    assert not any(hasattr(env, name) for name in OF_AN_EPISODE)
    for name in (*dir(env), *OF_AN_EPISODE, "nothing_of_that_name"):
        getattr(env, name, None)


@kinds
def test_an_environment_says_what_it_is_and_where_it_stands(kind: str) -> None:
    env = MAKERS[kind]()
    assert "'paper-hw-2', 2 robots" in repr(env)
    assert "not reset" in repr(env)
    env.reset(seed=7)
    assert "not reset" not in repr(env)
    assert "iteration 0 of 3" in repr(env)
    assert "2 worlds" in repr(env) or "seed 7" in repr(env)
    assert "\n" not in repr(env)


def test_seed_episode_and_iteration_are_those_that_are_played() -> None:
    env = rendezvous_v0.parallel_env(**SHORT)
    env.reset(seed=3)
    env.reset()
    env.step({agent: env.action_space(agent).sample() for agent in env.agents})
    assert repr(env) == "RendezvousEnv('paper-hw-2', 2 robots, seed 3, episode 1, iteration 1 of 3)"
    assert str(rendezvous_v0.env(**SHORT)) == "CheckedActionsWrapper<rendezvous_v0>"


def test_worlds_that_began_later_are_earlier() -> None:
    env = rendezvous_v0.vector_env(n_worlds=2, **SHORT)
    env.reset(seed=3)
    for _ in range(2):
        env.step([[env.single_action_space.sample()] * 2] * 2)
    env.reset(options={"reset_mask": [True, False]})
    assert repr(env) == "RendezvousVectorEnv('paper-hw-2', 2 robots, 2 worlds, iterations 0 to 2 of 3)"


@pytest.mark.parametrize(("name", "scenario"), SCENARIOS.items())
def test_a_scenario_says_what_is_changed_in_it(name: str, scenario: Scenario) -> None:
    assert repr(scenario) == f"Scenario({name!r})"
    other = scenario.with_overrides(err_threshold=7.5, n_steps=9)
    assert repr(other) == f"Scenario({name!r}, n_steps=9, err_threshold=7.5)"
    assert pickle.loads(pickle.dumps(other)) == other


def test_a_scenario_of_ones_own_is_beside_the_defaults() -> None:
    room = Scenario(name="room", source="ours", n_robots=3)
    assert repr(room) == "Scenario('room', n_robots=3)"
    many = room.with_overrides(obstacles_m=[[[x, 1], [x + 0.2, 1], [x, 1.2]] for x in range(1, 19)])
    assert len(repr(many)) < 1500


@pytest.mark.parametrize("name", POLICIES)
def test_a_policy_says_how_it_is_called(name: str) -> None:
    """Made by name it says the name; made by hand its class."""
    scenario = scenario_named("paper-hw-2")
    made = repr(make_policy(name, scenario))
    assert repr(name) in made
    assert "'paper-hw-2'" in made
    assert " object at 0x" not in repr(POLICIES[name](scenario))


def test_parameters_of_a_policy_are_told() -> None:
    made = make_policy("active:err_threshold=2", scenario_named("paper-hw-2"))
    assert repr(made) == "<ActiveRendezvous 'active:err_threshold=2' for 'paper-hw-2'>"
