"""Where the time of a step goes: shares of ``env.step`` by part, on one core.

Run: ``python -m benchmarks.step_profile [--scenario NAME ...] [--worlds 1 64] [--repeats N]``. An episode of
the active policy is played once, then again with the same actions while the parts are timed. Of each step
the fastest repeat counts, which is what the machine does when nothing else runs on it.
"""

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import inspect
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any
from unittest.mock import patch

import numpy as np
import tyro
from rich.console import Console
from rich.progress import track
from rich.table import Table

from baselines.policies import make_policy
from envs.rendezvous_v0 import RendezvousEnv, RendezvousVectorEnv, parallel_env, vector_env
from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal
from wifipgo.files.atomic_files import write_json
from wifipgo.loop import iteration
from wifipgo.world import map_accuracy

_VECTOR = inspect.getmodule(RendezvousVectorEnv)  # where the step of many worlds calls what it is made of
# Functions that a step calls, none of them from another of these.
PARTS: Mapping[str, Sequence[tuple[Any, str]]] = MappingProxyType(
    {
        "paths, links, rates of all pairs": [(iteration, "probe_links")],
        "CSI and profiles of the links listened to": [(iteration, "listen_to_team")],
        "meetings: solve and exchange": [(iteration, "exchange"), (iteration, "solve_at_every_step")],
        "relative poses": [(iteration, "measure_relative_poses"), (iteration, "robots_in_view")],
        "the log of measurements": [
            (iteration, "log_measurements"),
            (iteration, "refresh_reported_where_linked"),
        ],
        "drive (pymunk), odometry, cells seen": [(iteration, "drive")],
        "dead reckoning": [(iteration, "dead_reckon")],
        "own covariances and coverage beliefs": [(iteration, "propagate_uncertainty")],
        "mapped share, the reward": [(map_accuracy, "updated_map_accuracy")],
        "lidar and camera": [(iteration, "sense")],
        "Err and calls": [(iteration, "residual_error"), (iteration, "place_calls"), (iteration, "_shown")],
        "observations, infos, check of actions": [
            (RendezvousEnv, "_seen_and_said"),
            (RendezvousEnv, "checked"),
            (_VECTOR, "shown"),
            (_VECTOR, "checked_actions"),
            (_VECTOR, "columns_of"),
        ],
    }
)
WHOLE, REST = "whole step", "the rest"


@dataclass(frozen=True, slots=True, kw_only=True)
class ProfileConfig:
    """What to measure, how often, and where to write."""

    scenario: Annotated[tuple[str, ...], tyro.conf.arg(help="Scenarios.")] = ("paper-hw-2", "paper-sim-50")
    repeats: Annotated[int, tyro.conf.arg(help="Times that the episode is played again.")] = 10
    worlds: Annotated[tuple[int, ...], tyro.conf.arg(help="Worlds in a step, one column each.")] = (1,)
    json: Annotated[Path | None, tyro.conf.arg(help="Also write the times to this file.")] = None


class Stopwatch:
    """Time spent in each part, step by step."""

    def __init__(self, n_steps: int) -> None:
        """Nothing was timed yet."""
        self.spent_s = {name: np.zeros(n_steps) for name in (*PARTS, WHOLE)}
        self.step = 0

    @contextmanager
    def running(self) -> Iterator[None]:
        """Time every part that is called meanwhile."""
        with ExitStack() as stack:
            for part, functions in PARTS.items():
                for owner, name in functions:
                    stack.enter_context(patch.object(owner, name, self.timed(part, getattr(owner, name))))
            yield

    def timed(self, part: str, call: Callable[..., Any]) -> Callable[..., Any]:
        """The same call, timed."""

        def watched(*args: Any, **named: Any) -> Any:
            begin = time.perf_counter()
            result = call(*args, **named)
            self.spent_s[part][self.step] += time.perf_counter() - begin
            return result

        return watched


def actions_of(env: Any, seed: int = 0) -> list[Any]:
    """What the active policy does in an episode."""
    policy, taken = make_policy("active", env.scenario), []
    observations, _ = env.reset(seed=seed)
    policy.reset(seed)
    while env.agents:
        taken.append(policy.act(observations))
        observations, *_ = env.step(taken[-1])
    return taken


def actions_of_worlds(env: RendezvousVectorEnv, seed: int = 0) -> list[Any]:
    """The same in a batch of worlds."""
    policy, taken = make_policy("active", env.scenario), []
    observations, _ = env.reset(seed=seed)
    policy.reset_rows(range(seed, seed + env.n_worlds))
    while not env.over.all():
        taken.append(policy.act_rows(observations))
        observations = env.step(taken[-1]).observations
    return taken


def profile(
    scenario: str, repeats: int, *, seed: int = 0, n_worlds: int = 1, **overrides: Any
) -> dict[str, float]:
    """Milliseconds of a step by part, the mean over an episode; the whole step is timed from outside."""
    env: Any
    if n_worlds == 1:
        env = parallel_env(scenario, **overrides)
        actions = actions_of(env, seed)
    else:
        env = vector_env(scenario, n_worlds=n_worlds, **overrides)
        actions = actions_of_worlds(env, seed)
    spent = []
    for _ in range(repeats):
        env.reset(seed=seed)
        watch = Stopwatch(len(actions))
        with watch.running():
            step = watch.timed(WHOLE, env.step)
            for watch.step, each in enumerate(actions):
                step(each)
        spent.append(watch.spent_s)
    fastest = np.argmin([one[WHOLE] for one in spent], axis=0)
    steps = np.arange(len(actions))
    found = {
        part: 1e3 * float(np.array([one[part] for one in spent])[fastest, steps].mean()) for part in spent[0]
    }
    return found | {REST: found[WHOLE] - sum(found[part] for part in PARTS)}


def show(found: Mapping[str, Mapping[str, float]], console: Console) -> None:
    """Print the shares, and what a whole step takes."""
    table = Table("part", *found, title="share of a step's time, one core")
    for column in table.columns[1:]:
        column.justify = "right"
    for part in (*PARTS, REST):
        table.add_row(part, *(f"{100.0 * times[part] / times[WHOLE]:.0f} %" for times in found.values()))
    table.add_section()
    table.add_row(f"{WHOLE}, ms", *(f"{times[WHOLE]:.2f}" for times in found.values()))
    console.print(table)


def main(config: ProfileConfig) -> None:
    """Measure, show, write."""
    console = Terminal(width=None if sys.stdout.isatty() else 120)
    columns = [(name, n) for name in config.scenario for n in config.worlds]
    found = {
        name if n == 1 else f"{name}, {n} worlds": profile(name, config.repeats, n_worlds=n)
        for name, n in track(columns, "steps", console=console)
    }
    show(found, console)
    if config.json is not None:
        write_json(config.json, found)


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(tyro.cli(ProfileConfig, description=__doc__))))
