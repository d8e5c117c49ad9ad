"""A start from a scripted policy: it says what it would do, the network learns to say the same (DAgger).

Ross, Gordon and Bagnell, "A reduction of imitation learning and structured prediction to no-regret online
learning", 2011: from the second round on the network drives, so that it learns what to do where *it* gets.
"""

from collections.abc import Callable, Sequence
from copy import deepcopy

import numpy as np
import torch
from jaxtyping import Bool
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

from baselines.policies import TeamsPolicy, make_policy
from train._config import START, TrainConfig
from train._lessons import Learner, Lessons, fit, returns_of
from train._rollouts import rounded_up, scenarios_of, teams_of
from train._vec_env import TeamVecEnv

_STREAM = 0xDA6


def imitate(model: PPO, norm: VecNormalize, config: TrainConfig, *, on_step: Callable[[int], None]) -> int:
    """Teach a model what a scripted policy does.

    Args:
        model: Is changed.
        norm: Environments; their statistics are collected on the way.
        config: Settings.
        on_step: Called with the agent-steps of each iteration.

    Returns:
        Agent-steps played.
    """
    cfg = config.imitation
    rng = np.random.default_rng(np.random.SeedSequence(config.seed, spawn_key=(_STREAM,)))
    team = _Scripts(norm, config)
    optimizer = torch.optim.Adam(model.policy.parameters(), lr=cfg.learning_rate)
    learner = Learner(model.policy, deepcopy(model.policy), optimizer, norm)
    norm.training = not team.stays.any()  # what is shown to a network that is to stay as it is stays, too
    lessons: list[Lessons] = []
    n_steps = rounded_up(cfg.agent_steps, norm.num_envs, scenarios_of(config)[0].n_steps)
    shown = norm.reset()
    for k in range(cfg.rounds):
        share = cfg.expert_share if k else 1.0
        shown, found = _collected(
            model, norm, team, np.asarray(shown), n_steps=n_steps, share=share, rng=rng, on_step=on_step
        )
        lessons.append(found)
        fit(learner, lessons, cfg=cfg, rng=rng)
    norm.training = True
    return cfg.rounds * n_steps * norm.num_envs


def teachers(config: TrainConfig) -> list[TeamsPolicy]:
    """Who is imitated in each scenario."""
    names = map(config.imitation.in_scenario, config.envs.texts)
    return [
        make_policy("ppo", each, path=config.start) if name == START else make_policy(name, each)
        for name, each in zip(names, scenarios_of(config), strict=True)
    ]


class _Scripts:
    """Policies that drive the teams of all environments, those of one part after the other."""

    def __init__(self, norm: VecNormalize, config: TrainConfig) -> None:
        drivers, parts, n = teachers(config), teams_of(norm), config.envs.n_envs
        alone = [
            (part, [driver], range(k, n, len(parts)))
            for k, (part, driver) in enumerate(zip(parts, drivers, strict=False))
        ]
        of_each = alone if len(parts) > 1 else [(parts[0], drivers, range(n))]
        self._parts = [
            _PartScripts(part, mine, [config.seed + k for k in teams]) for part, mine, teams in of_each
        ]
        self.n_teams = n
        self._bounds = np.cumsum([part.n_rows for part in self._parts])[:-1]
        self._team_sizes = np.concatenate([part.team_sizes for part in self._parts])
        taught = [config.imitation.in_scenario(text) for text in config.envs.texts]
        numbers = np.concatenate([teams for *_, teams in of_each])
        # Rows in which the network is to stay as it was.
        self.stays = self.by_row(np.array([who == START for who in taught])[numbers % len(taught)])

    def answers(self) -> np.ndarray:
        """What the scripts would do now, as answers of a network."""
        return np.concatenate([part.answers() for part in self._parts])

    def ended(self, dones: Bool[np.ndarray, " rows"]) -> None:
        """Some rows' episodes are over."""
        for part, of_part in zip(self._parts, np.split(dones, self._bounds), strict=True):
            part.ended(of_part)

    def by_row(self, of_teams: Bool[np.ndarray, " teams"]) -> Bool[np.ndarray, " rows"]:
        """What holds of teams, by row."""
        return np.repeat(of_teams, self._team_sizes)


class _PartScripts:
    """Policies that drive the teams of environments that are alike, one a scenario."""

    def __init__(self, venv: TeamVecEnv, drivers: Sequence[TeamsPolicy], seeds: Sequence[int]) -> None:
        self._venv, self._seeds = venv, list(seeds)
        self.n_teams, self.n_rows = len(self._seeds), venv.num_envs
        self.team_sizes = np.full(self.n_teams, self.n_rows // self.n_teams)
        self._episodes, teams = [0] * self.n_teams, np.arange(self.n_teams)
        # Environment k plays scenario k, those after the last the first again, and so on.
        self._drivers = [
            (teams[k :: len(drivers)], driver) for k, driver in enumerate(drivers[: self.n_teams])
        ]
        self._begin(np.ones(self.n_teams, dtype=bool))

    def answers(self) -> np.ndarray:
        """What the scripts would do now, as answers of a network."""
        rows = self._venv.seen
        teams = rows.reshape(self.n_teams, -1, rows.shape[1])
        actions = np.empty((*teams.shape[:2], 3), dtype=np.float32)
        for mine, driver in self._drivers:
            actions[mine] = driver.act_rows(teams[mine])
        return self._venv.interface.answers(actions.reshape(-1, 3))

    def ended(self, dones: Bool[np.ndarray, " rows"]) -> None:
        """Some rows' episodes are over."""
        self._begin(np.asarray(dones.reshape(self.n_teams, -1)[:, 0]))

    def _begin(self, begins: Bool[np.ndarray, " teams"]) -> None:
        """Key the chance of the episodes that begin."""
        for mine, driver in self._drivers:
            if begins[mine].any():
                of = ([numbers[k] for k in mine.tolist()] for numbers in (self._seeds, self._episodes))
                driver.reset_rows(*of, mask=begins[mine])
        for k in np.flatnonzero(begins).tolist():
            self._episodes[k] += 1


def _collected(
    model: PPO,
    norm: VecNormalize,
    scripts: _Scripts,
    shown: np.ndarray,
    *,
    n_steps: int,
    share: float,
    rng: np.random.Generator,
    on_step: Callable[[int], None],
) -> tuple[np.ndarray, Lessons]:
    """Play some iterations; in each environment the script drives with a chance of ``share``.

    Returns:
        What the network is shown next, and the lessons.
    """
    seen, said, rewards, ends = [], [], [], []
    for _ in range(n_steps):
        right = scripts.answers()
        own, _ = model.predict(shown, deterministic=False)
        by_script = scripts.by_row(rng.random(scripts.n_teams) < share)
        seen.append(np.asarray(norm.get_original_obs()))
        said.append(right)
        new, _, dones, _ = norm.step(np.where(by_script[:, None], right, own))
        shown = np.asarray(new)
        rewards.append(norm.get_original_reward())
        ends.append(dones)
        scripts.ended(dones)
        on_step(norm.num_envs)
    returns = returns_of(np.stack(rewards), np.stack(ends), model.gamma)
    stays = np.tile(scripts.stays, n_steps)
    return shown, Lessons(np.concatenate(seen), np.concatenate(said), returns.ravel(), stays)
