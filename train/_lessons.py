"""Lessons of an imitation, and what a network learns from them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import torch
from jaxtyping import Bool, Float, Shaped
from stable_baselines3.common.distributions import kl_divergence
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.vec_env import VecNormalize
from torch.nn.functional import mse_loss

from train._config import ImitationConfig

_VALUE_WEIGHT = 0.25


class Lessons(NamedTuple):
    """What was seen, what the script would have done, what came of it, and where all is to stay as it was."""

    shown: Float[np.ndarray, "rows shown"]
    answers: Shaped[np.ndarray, "rows ..."]
    returns: Float[np.ndarray, " rows"]
    stays: Bool[np.ndarray, " rows"]


class Learner(NamedTuple):
    """Who learns, as what it began, by what rule, and how it is shown what it sees."""

    policy: ActorCriticPolicy
    before: ActorCriticPolicy
    optimizer: torch.optim.Optimizer
    norm: VecNormalize


def returns_of(
    rewards: Float[np.ndarray, "steps rows"], ends: Bool[np.ndarray, "steps rows"], gamma: float
) -> Float[np.ndarray, "steps rows"]:
    """Discounted sum of what follows until the end of the episode."""
    out = np.zeros_like(rewards)
    ahead = np.zeros(rewards.shape[1], dtype=rewards.dtype)
    for k in range(len(rewards) - 1, -1, -1):
        ahead = out[k] = rewards[k] + gamma * np.where(ends[k], 0.0, ahead)
    return out


def fit(
    learner: Learner, lessons: Sequence[Lessons], *, cfg: ImitationConfig, rng: np.random.Generator
) -> None:
    """Passes over all lessons: likelihood of what was said or divergence from before, error of the value."""
    shown, answers, returns, stays = (np.concatenate(column) for column in zip(*lessons, strict=True))
    policy, before, optimizer, norm = learner
    x = torch.as_tensor(norm.normalize_obs(shown))
    said, worth = torch.as_tensor(answers), torch.as_tensor(norm.normalize_reward(returns))
    as_before, any_stays = torch.as_tensor(stays), bool(stays.any())
    policy.set_training_mode(True)
    for _ in range(cfg.epochs):
        for batch in np.array_split(rng.permutation(len(x)), max(len(x) // cfg.batch_size, 1)):
            values, likelihood, _ = policy.evaluate_actions(x[batch], said[batch])
            if any_stays:
                apart = cfg.stay_weight * _divergence(before, policy, x[batch])
                likelihood = torch.where(as_before[batch], -apart, likelihood)
            loss = _VALUE_WEIGHT * mse_loss(values[:, 0], worth[batch]) - likelihood.mean()
            optimizer.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            torch.nn.utils.clip_grad_norm_(policy.parameters(), 1.0)
            optimizer.step()
    policy.set_training_mode(False)


def _divergence(
    before: ActorCriticPolicy, now: ActorCriticPolicy, x: Float[torch.Tensor, "rows shown"]
) -> Float[torch.Tensor, " rows"]:
    """Kullback-Leibler divergence of the choices now from those of before.

    What is learned elsewhere is then not paid for here (Li and Hoiem, "Learning without forgetting", 2018).
    """
    with torch.no_grad():
        then = before.get_distribution(x)
    return kl_divergence(then, now.get_distribution(x)).reshape(len(x), -1).sum(dim=1)
