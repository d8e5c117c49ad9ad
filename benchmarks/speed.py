"""Speed of the environment on one core, whole and part by part.

Run: ``wifipgo bench speed [--json FILE] [--seconds S]``. Whole steps include channel,
CSI, AOA and pose graph optimisation; parts are timed on the state in the middle of an
episode of the active policy. The clock is the processor time of this process. The median of
many calls is shown, and the fastest, which is what the machine can do when nothing else runs
on it. Beside other environments: ``python -m benchmarks.peers``.
"""

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import platform
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import tyro
from rich.console import Console
from rich.progress import track
from rich.table import Table

from baselines.policies import make_policy
from envs.rendezvous_v0 import RendezvousEnv, observe, parallel_env
from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal
from wifipgo.files.atomic_files import write_json
from wifipgo.graph.metrics import residual_error
from wifipgo.graph.solvers import solve
from wifipgo.radio.links import probe_links
from wifipgo.radio.turn_profiles import listen
from wifipgo.rendezvous import NOBODY
from wifipgo.world.lidar import scan

# What one core has to reach (environment-steps a second, or agent-steps where said).
TARGETS = {"paper-hw-2": 600.0, "paper-sim-50": 100.0, "physics + lidar": 40_000.0}


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedConfig:
    """How long to measure, and where to write."""

    seconds: Annotated[float, tyro.conf.arg(help="Time spent on each row.")] = 4.0
    json: Annotated[Path | None, tyro.conf.arg(help="Also write the rows to this file.")] = None


class Row(NamedTuple):
    """One measurement."""

    name: str
    scenario: str
    robots: int
    median_ms: float
    fastest_ms: float

    @property
    def env_steps_s(self) -> float:
        """Calls a second at the median."""
        return 1e3 / self.median_ms

    @property
    def agent_steps_s(self) -> float:
        """Calls a second times robots."""
        return self.env_steps_s * self.robots


def timed(call: Callable[[], object], seconds: float) -> tuple[float, float]:
    """Median and fastest time of a call over ``seconds`` of calls, ms."""
    call()
    times: list[float] = []
    end = time.process_time() + seconds
    while time.process_time() < end or len(times) < 5:
        begin = time.process_time()
        call()
        times.append(time.process_time() - begin)
    return 1e3 * float(np.median(times)), 1e3 * min(times)


def whole_steps(scenario: str, policy_name: str, seconds: float) -> Row:
    """``env.step`` over whole episodes: mean per episode, so that rare long steps count."""
    env = parallel_env(scenario)
    policy = make_policy(policy_name, env.scenario)
    means: list[float] = []
    end = time.process_time() + seconds
    while time.process_time() < end or len(means) < 3:
        observations, _ = env.reset(seed=len(means))
        policy.reset(len(means))
        spent = 0.0
        while env.agents:
            actions = policy.act(observations)
            begin = time.process_time()
            observations, *_ = env.step(actions)
            spent += time.process_time() - begin
        means.append(1e3 * spent / env.scenario.n_steps)
    return Row(
        f"whole step, {policy_name}", scenario, env.scenario.n_robots, float(np.median(means)), min(means)
    )


def half_way(scenario: str, **overrides: Any) -> RendezvousEnv:
    """An environment in the middle of an episode of the active policy."""
    env = parallel_env(scenario, **overrides)
    policy = make_policy("active", env.scenario)
    observations, _ = env.reset(seed=0)
    for _ in range(env.scenario.n_steps // 2):
        observations, *_ = env.step(policy.act(observations))
    return env


def parts(scenario: str) -> Iterator[tuple[str, int, Callable[[], object]]]:
    """Name, robots and call of each part of a step."""
    env = half_way(scenario)
    sc, belief, poses = env.scenario, env.tick.belief, env.tick.truth.poses[:, -1]
    links = probe_links(poses[:, :2], env.world.scene.surfaces, sc.radio)
    robot, slot = np.nonzero(belief.radio.slots != NOBODY)
    sender, rng = belief.radio.slots[robot, slot], np.random.default_rng(0)
    waypoints = rng.uniform(-1.0, 1.0, (sc.n_robots, 2))
    yield "physics", sc.n_robots, lambda: env.world.arena.drive(poses, waypoints)
    yield "lidar", sc.n_robots, lambda: _lidar(env, poses)
    yield (
        "paths and links, all pairs",
        sc.n_robots,
        lambda: probe_links(poses[:, :2], env.world.scene.surfaces, sc.radio),
    )
    yield (
        f"CSI and profiles, {len(robot)} links",
        sc.n_robots,
        lambda: listen(links, robot, sender, poses[:, 2], radio=sc.radio, turn=sc.turn, rng=rng),
    )
    yield (
        "solve of one pair",
        sc.n_robots,
        lambda: solve(belief.paths.estimate, belief.log.edges, robots=[0, 1], initial="near"),
    )
    yield "Err of all robots", sc.n_robots, lambda: residual_error(belief.paths.estimate, belief.log.edges)
    yield "observations", sc.n_robots, lambda: observe(belief, sc)


def _lidar(env: RendezvousEnv, poses: np.ndarray) -> np.ndarray:
    arena = env.scenario.arena
    return scan(
        poses, env.world.scene.edges_m, robot_radius_m=arena.robot_radius_m, range_m=arena.lidar_range_m
    )


def physics_and_lidar() -> tuple[str, int, Callable[[], object]]:
    """50 robots and 20 boxes, driving at random: no radio, no graph."""
    env = half_way("paper-sim-50", n_obstacles=20, size_m=60.0)
    rng, poses = np.random.default_rng(0), [env.tick.truth.poses[:, -1]]

    def step() -> None:
        poses[0] = env.world.arena.drive(poses[0], rng.uniform(-1.0, 1.0, (50, 2))).poses
        _lidar(env, poses[0])

    return "physics + lidar", 50, step


def measure(config: SpeedConfig) -> list[Row]:
    """All rows, with a progress bar."""
    scenarios = ("paper-hw-2", "paper-hw-2-obstacles", "paper-sim-50")
    rows = [
        whole_steps(scenario, policy, config.seconds)
        for scenario in track(scenarios, "whole steps")
        for policy in ("active", "random")
    ]
    name, robots, call = physics_and_lidar()
    rows.append(Row(name, "50 robots, 20 boxes", robots, *timed(call, config.seconds)))
    for scenario in track(scenarios, "parts"):
        for name, robots, call in parts(scenario):
            rows.append(Row(name, scenario, robots, *timed(call, config.seconds / 4.0)))
    return rows


def show(rows: list[Row], console: Console) -> None:
    """Print the table, targets beside what they ask for."""
    table = Table(title=f"one core, {platform.machine()}, Python {platform.python_version()}")
    for column in ("scenario", "part"):
        table.add_column(column, no_wrap=True)
    for column in ("median ms", "fastest", "per s", "agents/s", "target"):
        table.add_column(column, justify="right")
    for row in rows:
        whole = row.name.startswith("whole")
        target = TARGETS.get(row.scenario if whole else row.name)
        unit = " per s" if whole else " agents/s"
        table.add_row(
            row.scenario,
            row.name,
            f"{row.median_ms:.3f}",
            f"{row.fastest_ms:.3f}",
            f"{row.env_steps_s:,.0f}",
            f"{row.agent_steps_s:,.0f}" if whole or target else "",
            f"{target:,.0f}{unit}" if target else "",
        )
    console.print(table)


def main(config: SpeedConfig) -> None:
    """Measure, show, write."""
    rows = measure(config)
    show(rows, Terminal(width=None if sys.stdout.isatty() else 120))
    if config.json is not None:
        content = [
            row._asdict() | {"env_steps_s": row.env_steps_s, "agent_steps_s": row.agent_steps_s}
            for row in rows
        ]
        write_json(config.json, content, allow_nan=True)


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(tyro.cli(SpeedConfig, description=__doc__))))
