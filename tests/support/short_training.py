"""A training of seconds, copies of it, and what its command refuses."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("stable_baselines3")


from train import _checkpoints
from train._config import EnvsConfig, ImitationConfig, PpoConfig, SelectionConfig, TrainConfig
from train.ppo import main
from train.training import Run, train

SHORT = EnvsConfig(n_envs=2, overrides=("n_steps=10",))
FEW = PpoConfig(agent_steps=160, n_steps=20, batch_size=40, n_epochs=2, hidden=(8,))
RARELY = SelectionConfig(every=0, trials=1, policies=("random",))


def small(out: Path, **changes: Any) -> TrainConfig:
    """Seconds: two environments with episodes of ten iterations, 160 agent-steps."""
    return replace(TrainConfig(envs=SHORT, ppo=FEW, selection=RARELY, out=out), **changes)


def refused(capsys: pytest.CaptureFixture[str], *args: str) -> str:
    """The message of a command line that is refused, on one line."""
    code = main(list(args))
    assert code == 2
    return " ".join(capsys.readouterr().err.split())


def copy_of(done: Run, out: Path) -> tuple[_checkpoints.Checkpoints, TrainConfig]:
    """Its checkpoints and what continues it."""
    shutil.copytree(done.config.out, out)
    return _checkpoints.Checkpoints(out), replace(done.config, out=out, resume=True)


def taught(out: Path) -> Run:
    """A run that imitated, then improved, to its end."""
    return train(small(out, imitation=ImitationConfig(policy="active", rounds=2, agent_steps=40, epochs=1)))
