"""World k of a batch is world k alone: observations, rewards, infos, ends, whatever is played beside it."""

from typing import Any

import numpy as np
import pytest

from envs.rendezvous_v0 import RendezvousVectorEnv, parallel_env, vector_env

SMALL: dict[str, Any] = {"size_m": 7.0, "n_steps": 9}  # robots see each other often, so they meet early
BOXES: dict[str, Any] = {"n_obstacles": 3, "obstacle_max_m": 1.2, "clearance_m": 0.5}
CASES: dict[str, dict[str, Any]] = {
    "two": SMALL,
    "boxes": SMALL | BOXES,
    "five": SMALL | {"n_robots": 5, "n_slots": 3},
    "boxes of density": SMALL | {"obstacle_density": 0.05, "obstacle_max_m": 1.2, "clearance_m": 0.5},
    "unequal": SMALL | {"noise_scale": (0.5, 2.0), "step_scale": (1.0, 0.5), "antenna_scale": (1.0, 0.5)},
    "every_step": SMALL | {"estimator": "every_step", "n_robots": 3},
    "aoa_factors": SMALL | {"estimator": "every_step", "aoa_factors": True, "outliers": "bearing"},
    "distributed": SMALL | {"backend": "distributed", "message_loss": 0.2, "n_robots": 3},
    "early ends": SMALL | {"max_measurements": 7},
    "discrete": SMALL | {"actions": "discrete"},
    "dicts": SMALL | {"observation": "dict"},
    "masked": SMALL | BOXES | {"actions": "discrete", "observation": "dict"},
    "radio": SMALL | BOXES | {"diffuse_ratio": 0.2, "packet_loss": 0.1, "agc": True, "int8": True},
    "turn": SMALL | {"chain_phase_rad": 0.3, "heading_noise_rad": 0.05, "aoa_estimator": "music"},
    "twice": SMALL | BOXES | {"max_order": 2, "penetration": False, "aoa_estimator": "ratio"},
    "edges": SMALL | BOXES | {"diffraction": True, "obstacle_material": "metal"},
    "error": SMALL | {"reward": "team_error", "n_robots": 3},
    "belief": SMALL | {"reward": "mapped_share_belief"},
}
METHODS = ("bearing", "gnc", "huber", "paper", "range_aware", "pcm", "pcm+gnc+bearing")
OUTLIERS = {name: SMALL | {"outliers": name, "outlier_share": 0.3, "n_robots": 3} for name in METHODS}


def drawn(env: RendezvousVectorEnv, rng: np.random.Generator) -> np.ndarray:
    """Actions of all worlds; some call."""
    shape = (env.n_worlds, env.n_robots)
    discrete = env.single_action_space.shape == ()
    return rng.integers(34, size=shape) if discrete else rng.uniform(-0.7, 0.7, (*shape, 3))


def assert_alike(batch: Any, alone: Any, world: int, agents: list[str]) -> None:
    """Arrays of a batch against what each robot of a world alone is shown."""
    if isinstance(batch, dict):
        for name, column in batch.items():
            assert_alike(column, {a: alone[a][name] for a in agents}, world, agents)
        return
    for robot, agent in enumerate(agents):
        np.testing.assert_array_equal(batch[world, robot], alone[agent])


@pytest.mark.parametrize("name", [*CASES, *OUTLIERS])
def test_a_world_of_a_batch_is_the_world_alone(name: str) -> None:
    arguments, seeds = (CASES | OUTLIERS)[name], [3, 11, 4]
    env, rng = vector_env(n_worlds=3, **arguments), np.random.default_rng(0)
    alone = [parallel_env(**arguments) for _ in seeds]
    observations, infos = env.reset(seed=seeds)
    for k, (one, seed) in enumerate(zip(alone, seeds, strict=True)):
        seen, said = one.reset(seed=seed)
        assert_alike(observations, seen, k, env.possible_agents)
        assert_alike(infos, said, k, env.possible_agents)
    n_met = 0
    while not env.over.all():
        actions, over = drawn(env, rng), env.over
        step = env.step(actions)
        n_met += int(step.infos["met"].any(axis=(1, 2)).sum())
        for k, one in enumerate(alone):
            if over[k]:
                assert not step.rewards[k].any()
                continue
            told = dict(zip(env.possible_agents, actions[k], strict=True))
            seen, rewards, ended, cut, said = one.step(told)
            assert_alike(step.observations, seen, k, env.possible_agents)
            for batch, each in zip(step[1:4], (rewards, ended, cut), strict=True):
                assert_alike(batch, each, k, env.possible_agents)
            assert_alike(step.infos, said, k, env.possible_agents)
    for k, one in enumerate(alone):  # those that ended before the others stand as they did then
        np.testing.assert_array_equal(env.state()[k], one.state())
        np.testing.assert_array_equal(env.tick_of(k).truth.poses, one.tick.truth.poses)
    assert all(not one.agents for one in alone)
    assert n_met > 0


def test_worlds_begin_anew_while_others_go_on() -> None:
    """Each world plays its own sequence of episodes, whenever its episodes begin."""
    arguments = SMALL | {"max_measurements": 7}
    env, rng = vector_env(n_worlds=4, **arguments), np.random.default_rng(1)
    alone = [parallel_env(**arguments) for _ in range(4)]
    env.reset(seed=20)
    for k, one in enumerate(alone):
        one.reset(seed=20 + k)
    n_cohorts = set()
    for _ in range(25):
        actions = drawn(env, rng)
        step = env.step(actions)
        for k, one in enumerate(alone):
            seen, rewards, *_ = one.step(dict(zip(env.possible_agents, actions[k], strict=True)))
            assert_alike(step.observations, seen, k, env.possible_agents)
            assert_alike(step.rewards, rewards, k, env.possible_agents)
        over = env.over
        n_cohorts.add(len(env.cohorts))
        if over.any():
            observations, infos = env.reset(options={"reset_mask": over})
            for k in np.flatnonzero(over).tolist():
                seen, said = alone[k].reset()
                assert_alike(observations, seen, k, env.possible_agents)
                assert_alike(infos, said, k, env.possible_agents)
        assert not env.over.any()
    assert max(n_cohorts) > 1


@pytest.mark.parametrize("estimator", ["at_rendezvous", "every_step"])
def test_a_batch_goes_on_from_a_snapshot(estimator: str) -> None:
    env = vector_env(n_worlds=3, estimator=estimator, **SMALL)
    other, rng = vector_env(n_worlds=3, estimator=estimator, **SMALL), np.random.default_rng(2)
    env.reset(seed=5)
    actions = [drawn(env, rng) for _ in range(9)]
    for one in actions[:4]:
        env.step(one)
    kept = env.snapshot()
    played = [env.step(one) for one in actions[4:]]
    for again in (env, other):
        again.restore(kept)
        for one, before in zip(actions[4:], played, strict=True):
            step = again.step(one)
            np.testing.assert_array_equal(step.observations, before.observations)
            np.testing.assert_array_equal(step.rewards, before.rewards)


def test_one_world_taken_out_is_the_world_alone() -> None:
    env, rng = vector_env(n_worlds=3, **SMALL, **BOXES), np.random.default_rng(3)
    alone = parallel_env(**SMALL, **BOXES)
    env.reset(seed=7)
    alone.reset(seed=8)
    for _ in range(6):
        actions = drawn(env, rng)
        env.step(actions)
        alone.step(dict(zip(env.possible_agents, actions[1], strict=True)))
    tick, own = env.tick_of(1), alone.tick
    np.testing.assert_array_equal(tick.truth.poses, own.truth.poses)
    np.testing.assert_array_equal(tick.truth.cells.seen, own.truth.cells.seen)
    np.testing.assert_array_equal(tick.belief.log.edges.z, own.belief.log.edges.z)
    np.testing.assert_array_equal(tick.belief.log.edges.tail, own.belief.log.edges.tail)
    np.testing.assert_array_equal(tick.belief.radio.profile, own.belief.radio.profile)
    assert tick.belief.team.bytes_sent == own.belief.team.bytes_sent
