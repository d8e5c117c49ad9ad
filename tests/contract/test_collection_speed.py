"""The benchmark of collecting steps the environments that PPO learns in."""

import pytest
from rich.console import Console

pytest.importorskip("stable_baselines3", reason="training is an extra")

from benchmarks.collection_speed import CollectionConfig, rates
from train import EnvsConfig


def test_every_window_counts() -> None:
    short = EnvsConfig(n_envs=2, overrides=("n_steps=4",))
    found = rates(CollectionConfig(envs=short, seconds=0.05), Console(quiet=True))
    assert len(found) == 5
    assert min(found) > 0.0
