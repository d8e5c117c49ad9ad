"""Infos are tensors in waiting: the same keys, shapes and dtypes at meetings and ends as elsewhere."""

from typing import Any

import numpy as np
import pytest

from envs import rendezvous_v0

SMALL = {"size_m": 4.0, "n_steps": 12}  # robots see each other all the time, so they meet early
EPISODES: dict[str, dict[str, Any]] = {
    "two": SMALL,
    "dict": {**SMALL, "observation": "dict"},
    "discrete": {**SMALL, "actions": "discrete"},
    "masked": {**SMALL, "actions": "discrete", "observation": "dict"},
    "four": {**SMALL, "n_robots": 4, "n_slots": 2, "size_m": 6.0},
    "every_step": {**SMALL, "estimator": "every_step"},
    "ended": {**SMALL, "max_measurements": 9},
    "distributed": {**SMALL, "backend": "distributed"},
}


def form(info: dict[str, Any]) -> dict[str, tuple[Any, ...]]:
    """Key, type, shape and dtype of every entry."""
    return {name: (type(value), np.shape(value), np.asarray(value).dtype) for name, value in info.items()}


def drawn(env: Any, rng: np.random.Generator) -> dict[str, Any]:
    """An action for each agent; those who meet in the end have stood still before."""
    discrete = env.action_space("robot_0").shape == ()
    return {a: int(rng.integers(34)) if discrete else rng.uniform(-0.3, 0.3, 3) for a in env.agents}


@pytest.mark.parametrize("name", EPISODES)
def test_infos_keep_their_form_over_meetings_and_ends(name: str) -> None:
    env = rendezvous_v0.parallel_env(**EPISODES[name])
    rng, n_meetings = np.random.default_rng(0), 0
    _, infos = env.reset(seed=0)
    expected = form(infos["robot_0"])
    for _ in range(2):  # into the next episode
        while env.agents:
            agents = env.agents
            *_, infos = env.step(drawn(env, rng))
            assert list(infos) == agents
            assert all(form(info) == expected for info in infos.values())
            n_meetings += any(info["met"].any() for info in infos.values())
        _, infos = env.reset()
        assert all(form(info) == expected for info in infos.values())
    assert n_meetings > 0


def test_the_turn_based_form_keeps_them_too() -> None:
    env = rendezvous_v0.env(**SMALL)
    env.reset(seed=0)
    expected, n_meetings = form(env.infos["robot_0"]), 0
    for _ in env.agent_iter():
        *_, terminated, truncated, info = env.last()
        assert form(info) == expected
        n_meetings += bool(info["met"].any())
        env.step(None if terminated or truncated else np.zeros(3))
    assert n_meetings > 0


def test_met_says_with_whom() -> None:
    """It is the groups of the iteration as a table: symmetric, nobody with itself, all of a group."""
    env = rendezvous_v0.parallel_env(n_robots=4, n_slots=2, size_m=6.0, n_steps=30)
    env.reset(seed=1)
    sizes = set()
    while env.agents:
        *_, infos = env.step({a: np.zeros(3) for a in env.agents})
        table = np.stack([info["met"] for info in infos.values()])
        partners = {frozenset({i, *np.flatnonzero(row).tolist()}) for i, row in enumerate(table) if row.any()}
        assert partners == {frozenset(group) for group in env.tick.belief.team.met}
        assert not table.diagonal().any()
        sizes |= set(map(len, partners))
    assert sizes
