"""Environments of a training run, wrapped as its settings ask for."""

from collections.abc import Iterator
from functools import partial

import numpy as np
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

from baselines.evaluation.episodes import trial_seed
from baselines.policies.learned.interfaces import make_interface
from baselines.policies.learned.network import layout_of
from baselines.suite.definition import ROOTS
from envs.rendezvous_v0 import parallel_env
from train._config import HELD_OUT_SEED, TrainConfig
from train._interface_vec_env import Translated
from train._vec_env import TeamVecEnv
from wifipgo.coerce import key_value
from wifipgo.errors import require
from wifipgo.scenarios import Scenario, scenario_named

# So many trials of an evaluation are kept apart from training.
_KEPT_APART = 1_000
# Without it, a training from seed 1 would play the first world of an evaluation from seed 1.
_WORLDS = 0x3041D


def scenarios_of(config: TrainConfig) -> list[Scenario]:
    """Scenarios to train on, the first to evaluate on.

    Raises:
        ValueError: One is unknown, or has another layout or another interface to the network.
    """
    changes = dict(map(key_value, config.envs.overrides))
    names = (config.envs.scenario, *config.envs.others)
    scenarios = [scenario_named(name, **changes) for name in names]
    layout, scale = layout_of(scenarios[0]), make_interface(config.envs.interface, scenarios[0]).scale
    for other in scenarios[1:]:
        rule = f"of scenarios with the observations of {scenarios[0].name!r}, its room's size and its n_steps"
        same = layout_of(other) == layout and make_interface(config.envs.interface, other).scale == scale
        require(same, "envs.others", rule, other.name)
    return scenarios


def environments(config: TrainConfig, seed: int) -> VecNormalize:
    """Every environment's own sequence of worlds, translated and normalised.

    Args:
        config: Settings.
        seed: Root of the worlds.
    """
    scenarios = scenarios_of(config)
    reward, n = config.envs.reward, config.envs.n_envs
    makers = [partial(parallel_env, scenarios[k % len(scenarios)], reward=reward) for k in range(n)]
    venv = TeamVecEnv(makers, n_workers=config.envs.n_workers, n_phases=config.envs.n_phases)
    root = np.random.SeedSequence(seed, spawn_key=(_WORLDS,)).generate_state(1)[0]
    _keep_apart(venv.seed(int(root)), config.selection.seed)
    translated = Translated(
        VecMonitor(venv),
        make_interface(config.envs.interface, scenarios[0]),
        endless=config.envs.endless,
    )
    return VecNormalize(
        translated,
        norm_obs=config.norm.observations,
        norm_reward=config.norm.reward,
        clip_obs=config.norm.clip,
        gamma=config.ppo.gamma,
    )


def translated_of(norm: VecNormalize) -> Translated:
    """The wrapper under the normalisation.

    Raises:
        TypeError: It was made of other environments.
    """
    venv = norm.venv
    if not isinstance(venv, Translated):
        raise TypeError(f"environments of a training must be those of train._rollouts, got {type(venv)}")
    return venv


def _keep_apart(seeds: object, selection_seed: int) -> None:
    """Refuse worlds that are evaluated on: their seeds are drawn, so a clash is possible, if unlikely."""
    mine = {seed for seed in seeds if isinstance(seed, int)} if isinstance(seeds, list) else set()
    clash = mine & set(_evaluated(selection_seed))
    require(not clash, "seed", "one whose worlds are not those of an evaluation", sorted(clash))


def _evaluated(selection_seed: int) -> Iterator[int]:
    for root in (selection_seed, HELD_OUT_SEED, *ROOTS):
        yield from (trial_seed(root, trial) for trial in range(_KEPT_APART))


def rounded_up(agent_steps: int, rows: int, every: int = 1) -> int:
    """Iterations that give at least so many agent-steps, a multiple of ``every``."""
    return int(np.ceil(agent_steps / (rows * every))) * every
