"""Whether memory grows: resident memory over many steps and short episodes, of one world or of a batch.

Run: ``python -m benchmarks.memory [--worlds 64]`` (20 000 steps). Exit code 1 if memory grew by more than the
limit.
"""

import gc
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro

from envs.rendezvous_v0 import parallel_env, vector_env
from wifipgo.command.command_line import exit_code
from wifipgo.errors import BadInputError, DoubtfulError

_STATUS = Path("/proc/self/status")


@dataclass(frozen=True, slots=True, kw_only=True)
class Arguments:
    """What is run, and how much memory may be lost.

    Attributes:
        scenario: Name or TOML file.
        steps: Steps after the warm-up.
        warm_up: Steps before the first look; caches fill.
        episode: Steps of an episode; short ones show what a reset leaves behind.
        limit_mb: Growth that is too much.
        worlds: Stepped at once.
    """

    scenario: str = "paper-hw-2-obstacles"
    steps: int = 20_000
    warm_up: int = 1_000
    episode: int = 10
    limit_mb: float = 10.0
    worlds: int = 1


def resident_mb() -> float:
    """Resident memory of this process, after a collection."""
    gc.collect()
    line = next(line for line in _STATUS.read_text("ascii").splitlines() if line.startswith("VmRSS"))
    return int(line.split()[1]) / 1024.0


def growth_mb(arguments: Arguments) -> float:
    """Step under random actions, print memory ten times, and say by how much it grew."""
    play = alone(arguments) if arguments.worlds == 1 else batch(arguments)
    before = 0.0
    for t in range(-arguments.warm_up, arguments.steps + 1):
        if t >= 0 and t % max(arguments.steps // 10, 1) == 0:
            now = resident_mb()
            before = before or now
            print(f"{t:8d} steps  {now:8.1f} MB", flush=True)
        play()
    return now - before


def alone(arguments: Arguments) -> Callable[[], object]:
    """A step of one world, after a reset where one is due."""
    env, rng = parallel_env(arguments.scenario, n_steps=arguments.episode), np.random.default_rng(0)
    env.reset(seed=0)

    def play() -> object:
        if not env.agents:
            env.reset()
        return env.step({a: rng.uniform(-1.0, 1.0, 3) for a in env.agents})

    return play


def batch(arguments: Arguments) -> Callable[[], object]:
    """A step of many worlds, after a reset where one is due."""
    env = vector_env(arguments.scenario, n_worlds=arguments.worlds, n_steps=arguments.episode)
    rng = np.random.default_rng(0)
    env.reset(seed=0)

    def play() -> object:
        if env.over.all():
            env.reset()
        return env.step(rng.uniform(-1.0, 1.0, (env.n_worlds, env.n_robots, 3)))

    return play


def main() -> None:
    """Measure.

    Raises:
        BadInputError: A system without /proc.
        DoubtfulError: Memory grew.
    """
    arguments = tyro.cli(Arguments, description=__doc__)
    if not _STATUS.exists():
        raise BadInputError("benchmarks.memory reads /proc, which this system does not have")
    grown = growth_mb(arguments)
    said = f"grew by {grown:.1f} MB over {arguments.steps} steps (limit {arguments.limit_mb:g} MB)"
    print(said)
    if grown > arguments.limit_mb:
        raise DoubtfulError(f"memory {said}")


if __name__ == "__main__":
    sys.exit(exit_code(main))
