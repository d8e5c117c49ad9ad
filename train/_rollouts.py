"""Environments of a training run, wrapped as its settings ask for."""

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from stable_baselines3.common.vec_env import VecEnv, VecMonitor, VecNormalize

from baselines.evaluation.episodes import trial_seed
from baselines.policies.learned.interfaces import DIRECTIONS, layout_read, make_interface
from baselines.policies.learned.network import layout_of
from baselines.policies.learned.training_scenarios import scenario_varied
from baselines.suite.definition import ROOTS
from envs.rendezvous_v0 import parallel_env
from train._config import HELD_OUT_SEED, TrainConfig
from train._mixed_vec_env import MixedVecEnv, done
from train._shown_batch import Showing
from train._vec_env import TeamVecEnv
from wifipgo.coerce import key_value
from wifipgo.errors import require
from wifipgo.scenarios import Scenario

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
    texts = config.envs.texts
    scenarios = [scenario_varied(text, **changes) for text in texts]
    for text, other in zip(texts[1:], scenarios[1:], strict=True):
        rule = (
            f"of scenarios with the observations of {scenarios[0].name!r}, or of any with the interface "
            f"{' or '.join(DIRECTIONS)}"
        )
        fits = config.envs.interface in DIRECTIONS or are_alike([scenarios[0], other], config.envs.interface)
        require(fits, "envs.others", rule, text)
    return scenarios


def selected_scenarios(config: TrainConfig) -> list[Scenario]:
    """Scenarios that checkpoints are chosen on.

    Raises:
        ValueError: One is unknown, or its observations lack what the network reads.
    """
    first = scenarios_of(config)[0]
    found = [scenario_varied(text) for text in config.selection.scenarios] or [first]
    for text, other in zip(config.selection.scenarios, found, strict=False):
        same = layout_read(config.envs.interface, other) == layout_read(config.envs.interface, first)
        require(
            same, "selection.scenarios", f"with the observations that a network of {first.name!r} reads", text
        )
    return found


def are_alike(scenarios: Sequence[Scenario], interface: str) -> bool:
    """Whether scenarios have the same team, observations and lengths: one interface translates all."""
    kinds = [(s.n_robots, layout_of(s), make_interface(interface, s).scale) for s in scenarios]
    return all(kind == kinds[0] for kind in kinds)


def rows_of(config: TrainConfig) -> int:
    """Robots of all environments."""
    scenarios = scenarios_of(config)
    return sum(scenarios[k % len(scenarios)].n_robots for k in range(config.envs.n_envs))


def environments(config: TrainConfig, seed: int) -> VecNormalize:
    """Every environment's own sequence of worlds, translated and normalised.

    Args:
        config: Settings.
        seed: Root of the worlds.
    """
    scenarios, n = scenarios_of(config), config.envs.n_envs
    each = [scenarios[k % len(scenarios)] for k in range(n)]
    root = np.random.SeedSequence(seed, spawn_key=(_WORLDS,)).generate_state(1)[0]
    if are_alike(scenarios, config.envs.interface):
        venv: VecEnv = _shown(each, config, n_workers=config.envs.n_workers, phases=_phases(config, n))
    else:
        workers, behind = min(config.envs.n_workers, 1), _phases(config, len(scenarios))
        parts = [each[k :: len(scenarios)] for k in range(len(scenarios))]
        makers = [
            partial(_shown, part, config, n_workers=workers, phases=[phase] * len(part))
            for part, phase in zip(parts, behind, strict=True)
        ]
        venv = MixedVecEnv(done(makers, at_once=workers > 0))
    _keep_apart(venv.seed(int(root)), config.selection.seed)
    return VecNormalize(
        venv,
        norm_obs=config.norm.observations,
        norm_reward=config.norm.reward,
        clip_obs=config.norm.clip,
        gamma=config.ppo.gamma,
    )


def _phases(config: TrainConfig, n: int) -> list[float]:
    """Share of an episode that each of some groups has behind it at first."""
    return [k % config.envs.n_phases / config.envs.n_phases for k in range(n)]


def _shown(
    each: Sequence[Scenario], config: TrainConfig, *, n_workers: int, phases: Sequence[float]
) -> VecMonitor:
    """One environment for each of some scenarios that are alike, as a network meets them."""
    envs = config.envs
    makers = [partial(parallel_env, scenario, reward=envs.reward) for scenario in each]
    showing = Showing(envs.interface, each[0], endless=envs.endless, critic=config.ppo.critic)
    return VecMonitor(TeamVecEnv(makers, n_workers=n_workers, phases=phases, showing=showing))


def teams_of(norm: VecNormalize) -> tuple[TeamVecEnv, ...]:
    """The teams under the normalisation, one for all scenarios or one for each.

    Raises:
        TypeError: It was made of other environments.
    """
    venv = norm.venv
    found = venv.parts if isinstance(venv, MixedVecEnv) else (venv,)
    parts = tuple(part.unwrapped for part in found)
    teams = tuple(part for part in parts if isinstance(part, TeamVecEnv))
    if len(teams) != len(parts):
        raise TypeError(f"environments of a training must be those of train._rollouts, got {type(venv)}")
    return teams


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
