"""How often Algorithm 1 fails to bring two robots together, and why.

Run: ``wifipgo bench algorithm_1 [--scenarios NAME ...] [--worlds N] [--out FILE]``. The paper's policy
plays two robots. A call lasts from the iteration in which a robot asks for a rendezvous until the two
meet, its error falls by itself, or the episode ends. It failed if they have not met after 10 iterations,
and the cause is what most of these were like: ``unheard``, not even a ping passed; ``misled``, the highest
peak of the profile of who is called was more than 20 degrees off; ``slow``, neither. Calls that end sooner
without a meeting are left out.
"""

import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
import tyro
from rich.console import Console
from rich.table import Table

from baselines.policies import make_policy
from envs.rendezvous_v0 import parallel_env
from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal
from wifipgo.errors import require
from wifipgo.files.atomic_files import appearing
from wifipgo.radio.aoa.peaks import find_peaks
from wifipgo.scenarios import Scenario, scenario_named
from wifipgo.state import Tick

PLAYED = ("paper-hw-2-obstacles", "radio-real-2-obstacles", "radio-hard")
LATE, GROSS_RAD, LEAST_WORLDS = 10, np.deg2rad(20.0), 10
CAUSES = ("unheard", "misled", "slow")


@dataclass(frozen=True, slots=True, kw_only=True)
class CallsConfig:
    """What is played."""

    scenarios: Annotated[tuple[str, ...], tyro.conf.arg(help="Scenarios of two robots.")] = PLAYED
    worlds: Annotated[int, tyro.conf.arg(help="Worlds of each, at least 10.")] = 40
    seed: Annotated[int, tyro.conf.arg(help="Seed of the first world.")] = 0
    out: Annotated[Path | None, tyro.conf.arg(help="Also write the calls to this .parquet file.")] = None

    def __post_init__(self) -> None:
        """Refuse what no verdict can be built on."""
        rule = f">= {LEAST_WORLDS}, fewer decide nothing"
        require(self.worlds >= LEAST_WORLDS, "worlds", rule, self.worlds)


def calls_of(scenario: Scenario, seed: int) -> list[dict[str, Any]]:
    """Calls of one world that met, or went on for `LATE` iterations without."""
    require(scenario.n_robots == 2, "scenarios", "of two robots", scenario.name)
    env, driver = parallel_env(scenario=scenario), make_policy("active", scenario)
    observations, _ = env.reset(seed=seed)
    driver.reset(seed)
    up: dict[int, list[str]] = {0: [], 1: []}
    calls = []
    while env.agents:
        actions = driver.act(observations)
        observations, *_ = env.step(actions)
        for caller, agent in enumerate(env.possible_agents):
            up[caller] = [*up[caller], what_it_was_like(env.tick, caller)] if actions[agent][2] > 0.0 else []
            met = bool(env.tick.belief.team.met)
            if len(up[caller]) == LATE or (met and 0 < len(up[caller]) < LATE):
                calls.append({"scenario": scenario.name, "world": seed, **ended(up[caller], met=met)})
            if met:
                up[caller] = []
    return calls


def what_it_was_like(tick: Tick, caller: int) -> str:
    """What an iteration of a call was like to who is called."""
    callee, radio = 1 - caller, tick.belief.radio
    profile = radio.profile[callee, :1]
    if radio.rate_mbit_s[callee, caller] == 0.0 or not profile.any():
        return "unheard"
    away_m = tick.truth.poses[caller, -1, :2] - tick.truth.poses[callee, -1, :2]
    truth_rad = np.arctan2(away_m[1], away_m[0]) - tick.truth.poses[callee, -1, 2]
    off_rad = find_peaks(profile, n_peaks=1).azimuth_rad[0, 0] - truth_rad
    return "misled" if abs(math.remainder(off_rad, math.tau)) > GROSS_RAD else "slow"


def ended(like: list[str], *, met: bool) -> dict[str, Any]:
    """A call that met, or failed for what most of its iterations were like."""
    cause = "" if met else max(CAUSES, key=like.count)
    shares = {one: like.count(one) / len(like) for one in CAUSES}
    return {"met": met, "cause": cause, "iterations": len(like), **shares}


def show(rows: pd.DataFrame, console: Console) -> None:
    """Print a line a scenario."""
    table = Table(title=f"calls of Algorithm 1 that had not met after {LATE} iterations")
    for name in ("scenario", "calls", "failed", *CAUSES, "iterations misled"):
        table.add_column(name, no_wrap=True)
    for scenario, calls in rows.groupby("scenario", sort=False):
        each = [f"{100.0 * (calls['cause'] == cause).mean():.0f} %" for cause in CAUSES]
        failed = f"{100.0 * (~calls['met']).mean():.0f} %"
        misled = np.average(calls["misled"], weights=calls["iterations"])
        table.add_row(str(scenario), str(len(calls)), failed, *each, f"{100.0 * misled:.0f} %")
    console.print(table)


def main(config: CallsConfig) -> None:
    """Play, show, write."""
    scenarios = [scenario_named(name) for name in config.scenarios]
    seeds = range(config.seed, config.seed + config.worlds)
    rows = pd.DataFrame(call for one in scenarios for seed in seeds for call in calls_of(one, seed))
    show(rows, Terminal(width=None if sys.stdout.isatty() else 140))
    if config.out is not None:
        with appearing(config.out) as part:
            rows.to_parquet(part, index=False)


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(tyro.cli(CallsConfig, description=__doc__))))
