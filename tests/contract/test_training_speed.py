"""The benchmark of a whole training measures the updates that PPO makes."""

from dataclasses import replace

import pytest

pytest.importorskip("stable_baselines3", reason="training is an extra")

from support.short_training import FEW

from benchmarks.training_speed import durations
from train import EnvsConfig, TrainConfig


def test_every_update_but_the_first_counts() -> None:
    envs = EnvsConfig(n_envs=2, overrides=("n_steps=4",))
    config = TrainConfig(envs=envs, ppo=replace(FEW, n_steps=4, batch_size=16))
    size, collected_s, learned_s = durations(config, 2)
    assert size == 16
    assert len(collected_s) == len(learned_s) == 2
    assert min(collected_s + learned_s) > 0.0
