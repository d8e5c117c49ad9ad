"""How fast training collects experience: agent-steps a second of the environments that PPO learns in.

Run: ``python -m benchmarks.collection_speed [--envs.n-workers N] [--seconds S]``. Environments, interface and
normalisation are those of ``python -m train.ppo``; choices are drawn, so the network is not in it (about 4 %
of the time). Time is that of the wall: with workers it is the work of several cores.
"""

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import sys
import time
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
import tyro
from rich.console import Console
from rich.progress import track

from train import EnvsConfig, TrainConfig, environments
from wifipgo.command.command_line import exit_code

_WINDOWS = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class CollectionConfig:
    """What is played, and for how long."""

    envs: EnvsConfig = field(default_factory=EnvsConfig)
    seconds: Annotated[float, tyro.conf.arg(help="Time spent.")] = 20.0


def rates(config: CollectionConfig, console: Console) -> list[float]:
    """Agent-steps a second in some windows of time."""
    venv = environments(TrainConfig(envs=config.envs), seed=0)
    venv.action_space.seed(0)
    drawn = [np.array([venv.action_space.sample() for _ in range(venv.num_envs)]) for _ in range(64)]
    found, k = [], 0
    try:
        venv.reset()
        for _ in track(range(_WINDOWS), "collecting", console=console):
            begin, count = time.perf_counter(), 0
            while time.perf_counter() - begin < config.seconds / _WINDOWS:
                venv.step(drawn[k % len(drawn)])
                k, count = k + 1, count + venv.num_envs
            found.append(count / (time.perf_counter() - begin))
    finally:
        venv.close()
    return found


def main(config: CollectionConfig) -> None:
    """Measure and show."""
    console = Console(width=None if sys.stdout.isatty() else 100)
    found = rates(config, console)
    cores = max(1, config.envs.n_workers)
    console.print(
        f"{config.envs.scenario}, {config.envs.n_envs} environments, {cores} process{'es' * (cores > 1)}: "
        f"{np.median(found):,.0f} agent-steps a second ({min(found):,.0f} to {max(found):,.0f})"
    )


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(tyro.cli(CollectionConfig, description=__doc__))))
