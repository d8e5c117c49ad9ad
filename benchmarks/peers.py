"""Speed of this environment beside others that are installed, in one run on one core.

Run: ``python -m benchmarks.peers [--seconds S] [--json FILE]``, with ``mpe2``, ``pettingzoo[sisl]`` and
``vmas`` installed beside the project; what is missing is listed as skipped. Actions are drawn before
the clock starts, so that only ``step`` and the reset at the end of an episode count. The clock is the
processor time of this process; each row is the median of a few windows.
"""

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")
os.environ.setdefault("SDL_VIDEODRIVER", "dummy")

import importlib
import itertools
import platform
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import tyro
from rich.console import Console
from rich.progress import track
from rich.table import Table

from baselines.policies import make_policy
from benchmarks._naive_env import NaiveEnv
from benchmarks.speed import physics_and_lidar
from envs.rendezvous_v0 import parallel_env, vector_env
from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal
from wifipgo.files.atomic_files import write_json

_WINDOWS = 3
_N_ACTIONS = 64
Call = Callable[[], object]


@dataclass(frozen=True, slots=True, kw_only=True)
class PeersConfig:
    """How long to measure, and where to write."""

    seconds: Annotated[float, tyro.conf.arg(help="Processor time spent on each row.")] = 4.0
    json: Annotated[Path | None, tyro.conf.arg(help="Also write the rows to this file.")] = None


class Peer(NamedTuple):
    """One environment: what it models, and how to make the call that steps it."""

    name: str
    models: str
    agents: int
    make: Callable[[], Call]
    n_envs: int = 1


class Row(NamedTuple):
    """One measurement; ``env_steps_s`` counts every environment of a batch, None where it is skipped."""

    name: str
    models: str
    agents: int
    n_envs: int
    env_steps_s: float | None
    skipped: str = ""


def rate(call: Call, seconds: float) -> float:
    """Calls a second of processor time, median over windows."""
    call()
    rates = []
    for _ in range(_WINDOWS):
        count, begin, spent = 0, time.process_time(), 0.0
        while spent < seconds / _WINDOWS:
            call()
            count += 1
            spent = time.process_time() - begin
        rates.append(count / spent)
    return float(np.median(rates))


def stepping(env: Any) -> Call:
    """Steps of a ParallelEnv with random actions."""
    env.reset(seed=0)
    agents = list(env.possible_agents)
    for seed, agent in enumerate(agents):
        env.action_space(agent).seed(seed)
    drawn = itertools.cycle([{a: env.action_space(a).sample() for a in agents} for _ in range(_N_ACTIONS)])

    def step() -> None:
        if not env.agents:
            env.reset()
        actions = next(drawn)
        env.step({agent: actions[agent] for agent in env.agents})

    return step


def playing(scenario: str, policy_name: str, **overrides: Any) -> Call:
    """Steps of this environment under the actions that a policy took before: the policy is not timed."""
    env = parallel_env(scenario, **overrides)
    policy = make_policy(policy_name, env.scenario)
    episode, (observations, _) = [], env.reset(seed=0)
    policy.reset(0)
    while env.agents:
        episode.append(policy.act(observations))
        observations, *_ = env.step(episode[-1])
    played = itertools.cycle(episode)

    def step() -> None:
        if not env.agents:
            env.reset(seed=0)
        env.step(next(played))

    return step


def playing_worlds(scenario: str, policy_name: str, n_worlds: int, **overrides: Any) -> Call:
    """The same of a batch of worlds."""
    env = vector_env(scenario, n_worlds=n_worlds, **overrides)
    policy = make_policy(policy_name, env.scenario)
    policy.reset_rows(range(n_worlds))
    episode, (observations, _) = [], env.reset(seed=0)
    while not env.over.all():
        episode.append(policy.act_rows(observations))
        observations = env.step(episode[-1]).observations
    played = itertools.cycle(episode)

    def step() -> None:
        if env.over.all():
            env.reset(seed=0)
        env.step(next(played))

    return step


def _module(name: str, make: str, **options: Any) -> Call:
    """Step an environment of another package."""
    return stepping(getattr(importlib.import_module(name), make)(**options))


def _vmas(scenario: str, n_envs: int, **options: Any) -> Call:
    """Step a batch of VMAS."""
    torch = importlib.import_module("torch")
    torch.set_num_threads(1)
    env = importlib.import_module("vmas").make_env(
        scenario=scenario, num_envs=n_envs, device="cpu", continuous_actions=True, seed=0, **options
    )
    env.reset()
    drawn = itertools.cycle([[env.get_random_action(agent) for agent in env.agents] for _ in range(8)])

    def step() -> None:
        with torch.no_grad():
            env.step(next(drawn))

    return step


def peers() -> Iterator[Peer]:
    """Ours first, then the others."""
    yield from ours()
    yield from others()


def ours() -> Iterator[Peer]:
    """Ours, alone and in batches."""
    radio = "driving, lidar, radio channel, AOA, pose graphs"
    for policy in ("active", "random"):
        for scenario, agents in (("paper-hw-2", 2), ("paper-sim-50", 50)):
            yield Peer(f"wifipgo {scenario}, {policy}", radio, agents, partial(playing, scenario, policy))
    for scenario, agents, batches in (
        ("paper-sim-2", 2, (1, 8, 64, 256)),
        ("paper-hw-2-obstacles", 2, (1, 64)),
        ("paper-sim-50", 50, (8,)),
    ):
        for n_worlds in batches:
            many = partial(playing_worlds, scenario, "active", n_worlds)
            yield Peer(f"wifipgo {scenario}, active", radio, agents, many, n_worlds)
    crowded = partial(playing, "paper-sim-50", "active", n_obstacles=20)
    yield Peer("wifipgo paper-sim-50, 20 boxes, active", radio, 50, crowded)
    yield Peer(
        "wifipgo, physics + lidar only", "driving, lidar, 20 boxes", 50, lambda: physics_and_lidar()[2]
    )


def others() -> Iterator[Peer]:
    """A yardstick on the same engine, and what others have."""
    naive = "driving, lidar, 20 boxes"
    yield Peer("naive pymunk ParallelEnv", naive, 50, lambda: stepping(NaiveEnv(50)))
    spread = partial(_module, "mpe2.simple_spread_v3", "parallel_env", continuous_actions=True)
    for n in (3, 10, 50):
        yield Peer("mpe2 simple_spread_v3", "points", n, partial(spread, N=n))
    pursuit = partial(_module, "pettingzoo.sisl.pursuit_v5", "parallel_env")
    for n in (8, 50):
        yield Peer("SISL pursuit_v5", "grid, 30 evaders", n, partial(pursuit, n_pursuers=n))
    waterworld = partial(_module, "pettingzoo.sisl.waterworld_v4", "parallel_env", n_coop=4)
    yield Peer("SISL waterworld_v4", "driving, lidar, obstacle", 50, partial(waterworld, n_pursuers=50))
    for n_envs in (1, 32):
        options = {"n_agents": 50, "n_targets": 20, "lidar_range": 0.35, "use_agent_lidar": True}
        found = partial(_vmas, "discovery", n_envs, **options)
        yield Peer("VMAS discovery", "driving, lidar, 20 targets", 50, found, n_envs)
    for n_envs in (1, 32, 1024):
        found = partial(_vmas, "navigation", n_envs, n_agents=10, collisions=True)
        yield Peer("VMAS navigation", "driving, lidar", 10, found, n_envs)


def measure(peer: Peer, seconds: float) -> Row:
    """Time one peer, or say why it is skipped."""
    known = (peer.name, peer.models, peer.agents, peer.n_envs)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return Row(*known, rate(peer.make(), seconds) * peer.n_envs)
    except (ImportError, AttributeError) as error:
        return Row(*known, None, str(error).splitlines()[0])


def show(rows: list[Row], console: Console) -> None:
    """Print the table, and what was skipped."""
    title = f"steps a second, one core, {platform.machine()}, Python {platform.python_version()}"
    table = Table("environment", "models", title=title)
    for column in ("agents", "batch", "env-steps/s", "per environment", "agent-steps/s"):
        table.add_column(column, justify="right")
    for row in (row for row in rows if row.env_steps_s is not None):
        steps = row.env_steps_s or 0.0
        counts = (f"{value:,.0f}" for value in (steps, steps / row.n_envs, steps * row.agents))
        table.add_row(row.name, row.models, str(row.agents), str(row.n_envs), *counts)
    console.print(table)
    for row in (row for row in rows if row.env_steps_s is None):
        console.print(f"skipped: {row.name}, {row.agents} agents: {row.skipped}", markup=False)


def main(config: PeersConfig) -> None:
    """Measure, show, write."""
    console = Terminal(width=None if sys.stdout.isatty() else 140)
    rows = [measure(peer, config.seconds) for peer in track(list(peers()), "peers", console=console)]
    show(rows, console)
    if config.json is not None:
        write_json(config.json, [row._asdict() for row in rows], allow_nan=True)


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(tyro.cli(PeersConfig, description=__doc__))))
