"""How long a training takes: what an update spends on collecting and on learning, and what all of them would.

Run: ``python -m benchmarks.training_speed [--config FILE] [--updates N] [--n-workers N]``. Worlds, network
and PPO are those of ``wifipgo train --config FILE``; imitation and evaluations come on top. The first update
is left out: memory and caches fill up in it.
"""

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import itertools
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import tyro
from rich.table import Table
from stable_baselines3.common.callbacks import BaseCallback

from train import TrainConfig, environments, read_yaml
from train.training import make_model, settle_torch
from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal
from wifipgo.heap import keep_freed_memory


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingSpeedConfig:
    """What is trained, and for how long."""

    config: Annotated[Path, tyro.conf.arg(help="Settings of the training.")] = Path(
        "train/configs/everywhere-wide.yaml"
    )
    updates: Annotated[int, tyro.conf.arg(help="Measured, after one that is not.")] = 3
    n_workers: Annotated[int | None, tyro.conf.arg(help="In place of that of the settings.")] = None


class _Clock(BaseCallback):
    """Notes when rollouts begin and end."""

    def __init__(self) -> None:
        super().__init__()
        self.times_s: list[float] = []

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        self.times_s.append(time.perf_counter())

    def _on_rollout_end(self) -> None:
        self.times_s.append(time.perf_counter())


def durations(config: TrainConfig, updates: int) -> tuple[int, list[float], list[float]]:
    """Agent-steps of an update, and the seconds that each collected and learned."""
    settle_torch()
    keep_freed_memory()
    venv, clock = environments(config, config.seed), _Clock()
    try:
        model = make_model(config, venv)
        size = venv.num_envs * config.ppo.n_steps
        model.learn((updates + 1) * size, callback=clock)
        times_s = [*clock.times_s, time.perf_counter()]
    finally:
        venv.close()
    gaps_s = [b - a for a, b in itertools.pairwise(times_s)]
    return size, gaps_s[2::2], gaps_s[3::2]


def main(asked: TrainingSpeedConfig) -> None:
    """Measure and show."""
    config = read_yaml(asked.config)
    if asked.n_workers is not None:
        config = replace(config, envs=replace(config.envs, n_workers=asked.n_workers))
    size, collected_s, learned_s = durations(config, asked.updates)
    table = Table(
        "of an update",
        "seconds, each",
        "us per agent-step",
        title=f"{asked.config.name}, {size:,} agent-steps",
    )
    both_s = [a + b for a, b in zip(collected_s, learned_s, strict=True)]
    for name, spent_s in (("collecting", collected_s), ("learning", learned_s), ("both", both_s)):
        each = ", ".join(f"{x:.2f}" for x in spent_s)
        table.add_row(name, each, f"{1e6 * sum(spent_s) / len(spent_s) / size:.0f}")
    console = Terminal(width=None if sys.stdout.isatty() else 100)
    console.print(table)
    rate = size * len(both_s) / sum(both_s)
    minutes = config.ppo.agent_steps / rate / 60.0
    console.print(f"{rate:,.0f} agent-steps a second: {config.ppo.agent_steps:,} take {minutes:.0f} minutes")


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(tyro.cli(TrainingSpeedConfig, description=__doc__))))
