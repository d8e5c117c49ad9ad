"""Scenarios in which the radio decides: batches are worlds, and exchanges take bytes over rate."""

import numpy as np
import pytest

from envs.rendezvous_v0 import parallel_env, vector_env
from wifipgo.loop.transfer import BYTES_PER_POSE, transferred
from wifipgo.scenarios import scenario_named
from wifipgo.scenarios.radio import RADIO


@pytest.mark.parametrize("name", ["radio-real-2-obstacles", "radio-real-10", "link-binds"])
def test_a_world_of_a_batch_is_that_world_alone(name: str) -> None:
    """People, scatterers, materials, noise of readings and exchanges under way included."""
    worlds = vector_env(name, n_worlds=2, n_steps=4)
    rows, _ = worlds.reset(seed=[3, 8])
    alone = parallel_env(scenario=name, n_steps=4)
    own, _ = alone.reset(seed=8)
    rng, n = np.random.default_rng(0), RADIO[name].n_robots
    for _ in range(3):
        np.testing.assert_array_equal(rows.reshape(2, n, -1)[1], np.stack(list(own.values())))
        actions = rng.uniform(-1.0, 1.0, (2, n, 3)).astype(np.float32)
        rows, *_ = worlds.step(actions)
        own, *_ = alone.step(dict(zip(alone.agents, actions[1], strict=True)))


def test_an_exchange_is_over_when_its_bytes_are() -> None:
    """10 poses of either, at 8 Mb/s for a second: 1 MB an iteration. What is over stays so."""
    scenario = scenario_named(
        "link-binds", q_mbit_s=6.5, exchange_s=1.0, image_bytes=120_000 - BYTES_PER_POSE
    )
    env = parallel_env(scenario=scenario)
    env.reset(seed=0)
    team = env.tick.belief.team
    team = team._replace(
        observed=np.full((2, 2), scenario.rendezvous.kappa), under_way_bytes=np.zeros((2, 2))
    )
    rate = np.array([[0.0, 8.0], [8.0, 0.0]])
    seen, before = [], int(team.bytes_sent[0])
    for rate_mbit_s in (rate, rate, 0.5 * rate, rate):
        team, complete = transferred(team, rate_mbit_s, 9, scenario)
        seen.append((int(team.under_way_bytes[0, 1]), bool(complete[0, 1])))
    assert seen == [(1_000_000, False), (2_000_000, False), (2_000_000, False), (2_400_000, True)]
    assert team.bytes_sent[0] - before == 2_400_000
