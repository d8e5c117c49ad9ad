"""What the arithmetic of a step of many worlds costs at least on this machine, and which share is reached.

Run: ``python -m benchmarks.physical_limit [--worlds 64]``. Speeds of the machine are measured: matrix
products, copying memory, sines, substeps of the engine. What a step of ``paper-sim-2`` needs of each is
counted from its sizes. The sum is a floor for this way of computing, on one core: no
work is counted twice, none that is only bookkeeping is counted at all.
"""

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np
import pymunk
import tyro
from rich.table import Table

from baselines.policies import make_policy
from envs.rendezvous_v0 import vector_env
from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal

_REPEATS = 30
_PATHS, _SUBCARRIERS = 5, 30  # of a link in a room without obstacles
_TOUCHING = 0.06  # share of the worlds in which somebody touches something, active policy


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitConfig:
    """What is played."""

    worlds: Annotated[int, tyro.conf.arg(help="Worlds of the batch.")] = 64
    scenario: Annotated[str, tyro.conf.arg(help="Scenario of two robots.")] = "paper-sim-2"


class Machine(NamedTuple):
    """Speeds of one core."""

    flop_s: float
    byte_s: float
    sines_s: float
    substep_s: float


class Work(NamedTuple):
    """What one part of a step needs: operations of products, bytes moved, sines, substeps of the engine."""

    part: str
    flop: float = 0.0
    moved: float = 0.0
    sines: float = 0.0
    substeps: float = 0.0

    def seconds(self, machine: Machine) -> float:
        """At least."""
        arithmetic = self.flop / machine.flop_s + self.sines / machine.sines_s
        return max(arithmetic, self.moved / machine.byte_s) + self.substeps * machine.substep_s


def least(call: Callable[[], object]) -> float:
    """Least processor time of a call, s."""
    call()
    times = []
    for _ in range(_REPEATS):
        begin = time.process_time()
        call()
        times.append(time.process_time() - begin)
    return max(min(times), 1e-9)


def measured() -> Machine:
    """Speeds of this machine."""
    rng = np.random.default_rng(0)
    a, b = (rng.standard_normal(shape).astype(np.float32) for shape in ((256, 256), (256, 512)))
    product = least(lambda: a @ b)
    block = rng.standard_normal(1 << 20)  # 8 MB: beyond the cache
    into = np.empty_like(block)
    copied = least(lambda: np.copyto(into, block))
    angle = rng.standard_normal(1 << 16).astype(np.float32)
    out = np.empty_like(angle)
    sines = least(lambda: np.sin(angle, out=out))
    return Machine(
        flop_s=2.0 * 256 * 256 * 512 / product,
        byte_s=2.0 * block.nbytes / copied,
        sines_s=angle.size / sines,
        substep_s=_substep_s(),
    )


def _substep_s() -> float:
    """A substep of the engine with a disc at a wall."""
    space = pymunk.Space()
    body = pymunk.Body(1.0, float("inf"))
    space.add(body, pymunk.Circle(body, 0.15), pymunk.Segment(space.static_body, (-5, 0.2), (5, 0.2), 0.1))
    body.velocity = (0.5, 0.5)

    def steps() -> None:
        for _ in range(100):
            space.step(0.001)

    return least(steps) / 100.0


class Sizes(NamedTuple):
    """Of a batch in the middle of an episode."""

    worlds: int
    rows: int
    times: float
    pairs: float
    links: int
    packets: int
    grid: int
    numbers: int

    @classmethod
    def of(cls, n_worlds: int, scenario: str) -> "Sizes":
        """Those of a scenario."""
        env = vector_env(scenario, n_worlds=n_worlds)
        given, n = env.scenario, env.n_robots
        return cls(
            worlds=n_worlds,
            rows=n_worlds * n,
            times=given.n_steps / 2,
            pairs=n_worlds * n * (n - 1) / 2,
            links=n_worlds * n * given.n_slots,
            packets=given.turn.n_positions,
            grid=given.turn.n_azimuths,
            numbers=sum(field.size for field in env.layout),
        )


def radio(of: Sizes) -> list[Work]:
    """Work of the radio."""
    n, csi_bytes = of.links * of.packets, 2 * of.links * of.packets * _SUBCARRIERS * 8.0
    return [
        Work(
            "paths and rates of pairs",
            sines=of.pairs * _PATHS * 6,
            moved=of.pairs * _PATHS * _SUBCARRIERS * 16.0 * 4,
        ),
        Work(
            "CSI: paths x packets x subcarriers",
            flop=2 * 2.0 * n * _PATHS * 2 * _SUBCARRIERS,
            sines=_PATHS * (3 * n + 2 * of.links * _SUBCARRIERS),
            moved=csi_bytes,
        ),
        Work("noise: read, added, written", moved=3 * csi_bytes),
        Work("product over subcarriers", flop=n * _SUBCARRIERS * 8.0, moved=csi_bytes),
        Work("profiles: packets x directions", flop=2 * 2.0 * n * of.grid, moved=of.links * of.grid * 16.0),
    ]


def rest(of: Sizes) -> list[Work]:
    """Work of all else: poses and covariances 24 numbers, measurements 104 bytes, 2.5 a robot and step."""
    grown = of.rows * of.times * (24 * 8.0 + 2.5 * 104.0)
    return [
        Work("histories and measurements, one longer", moved=2 * grown),
        Work("squares seen, lidar, views", flop=of.rows * (25 * 8 + 16 * 4 * 20), moved=of.rows * 4096.0),
        Work("observations", moved=2 * of.rows * of.numbers * 4.0),
        Work("engine, of those who touch something", substeps=_TOUCHING * of.worlds * 23),
    ]


def step_s(n_worlds: int, scenario: str) -> float:
    """Median processor time of a whole step without its policy."""
    env = vector_env(scenario, n_worlds=n_worlds)
    driver = make_policy("active", env.scenario)
    driver.reset_rows(range(n_worlds))
    times = []
    observations, _ = env.reset(seed=0)
    while not env.over.all():
        actions = driver.act_rows(observations)
        begin = time.process_time()
        observations = env.step(actions).observations
        times.append(time.process_time() - begin)
    return float(np.median(times))


def main(config: LimitConfig) -> None:
    """Measure and show."""
    console = Terminal(width=None if sys.stdout.isatty() else 110)
    machine, sizes = measured(), Sizes.of(config.worlds, config.scenario)
    works = radio(sizes) + rest(sizes)
    whole, floor = step_s(config.worlds, config.scenario), sum(work.seconds(machine) for work in works)
    console.print(
        f"one core: {machine.flop_s / 1e9:.1f} GFLOP/s in products, {machine.byte_s / 1e9:.1f} GB/s copied, "
        f"{machine.sines_s / 1e6:,.0f} M sines/s, {1e6 * machine.substep_s:.2f} us a substep"
    )
    table = Table("part", "MFLOP", "MB moved", "k sines", "at least, us")
    for work in works:
        numbers = (work.flop / 1e6, work.moved / 1e6, work.sines / 1e3, 1e6 * work.seconds(machine))
        table.add_row(work.part, *(f"{number:,.1f}" for number in numbers))
    console.print(table)
    console.print(
        f"{config.scenario}, {config.worlds} worlds: at least {1e3 * floor:.2f} ms, measured "
        f"{1e3 * whole:.2f} ms: {floor / whole:.0%} of what the machine could do"
    )


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(tyro.cli(LimitConfig, description=__doc__))))
