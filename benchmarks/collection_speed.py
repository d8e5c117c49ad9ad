"""How fast training collects experience: agent-steps a second of the environments that PPO learns in.

Run: ``python -m benchmarks.collection_speed [--envs.n-workers N] [--seconds S]``. Worlds, interface,
normalisation and the network that chooses and values are those of ``python -m train.ppo``. Time is that of
the wall: with workers it is the work of several cores.
"""

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import sys
import time
from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np
import torch
import tyro
from rich.console import Console
from rich.progress import track

from train import EnvsConfig, TrainConfig, environments
from train.training import make_model, settle_torch
from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal

_WINDOWS = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class CollectionConfig:
    """What is played, and for how long."""

    envs: EnvsConfig = field(default_factory=EnvsConfig)
    seconds: Annotated[float, tyro.conf.arg(help="Time spent.")] = 20.0


def rates(config: CollectionConfig, console: Console) -> list[float]:
    """Agent-steps a second in some windows of time."""
    settle_torch()
    settings = TrainConfig(envs=config.envs)
    venv = environments(settings, seed=0)
    settings = replace(settings, ppo=replace(settings.ppo, batch_size=venv.num_envs))  # fits any number
    found = []
    try:
        policy, shown = make_model(settings, venv).policy, np.asarray(venv.reset())
        for _ in track(range(_WINDOWS), "collecting", console=console):
            begin, count = time.perf_counter(), 0
            while time.perf_counter() - begin < config.seconds / _WINDOWS:
                with torch.no_grad():
                    answers, _, _ = policy(torch.as_tensor(shown))
                shown = np.asarray(venv.step(answers.numpy())[0])
                count += venv.num_envs
            found.append(count / (time.perf_counter() - begin))
    finally:
        venv.close()
    return found


def main(config: CollectionConfig) -> None:
    """Measure and show."""
    console = Terminal(width=None if sys.stdout.isatty() else 100)
    found = rates(config, console)
    cores = max(1, config.envs.n_workers)
    console.print(
        f"{config.envs.scenario}, {config.envs.n_envs} worlds, {cores} process{'es' * (cores > 1)}: "
        f"{np.median(found):,.0f} agent-steps a second ({min(found):,.0f} to {max(found):,.0f})"
    )


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(tyro.cli(CollectionConfig, description=__doc__))))
