"""Where the rate that a rendezvous needs (q of Eq. 1) decides, and where it does not.

Run: ``wifipgo bench where_q_binds [--worlds N] [--out FILE]``. The paper's policy plays the same worlds with
three values of q: on ``link-binds``, where an exchange takes bytes over rate, and on ``paper-hw-2``, where
two robots that observe each other have the top rate, so that the three are equal. Apart: how far robots that
meet are from each other. Waits: iterations from a pair's kappa-th observation to its meeting. Intervals:
95 %, of the mean over worlds.
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import pandas as pd
import tyro
from jaxtyping import Float
from rich.console import Console
from rich.table import Table

from baselines.policies import make_policy
from envs.rendezvous_v0 import parallel_env
from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal
from wifipgo.errors import require
from wifipgo.files.atomic_files import appearing
from wifipgo.scenarios import Scenario, scenario_named
from wifipgo.state import Tick

PLAYED = ("link-binds", "paper-hw-2")
QS_MBIT_S = (6.5, 26.0, 58.5)
LEAST_WORLDS = 10
FIGURES = ("meetings", "apart_m", "waits", "err", "mbytes")


@dataclass(frozen=True, slots=True, kw_only=True)
class BindsConfig:
    """What is played."""

    worlds: Annotated[int, tyro.conf.arg(help="Worlds of each row, at least 10.")] = 24
    seed: Annotated[int, tyro.conf.arg(help="Seed of the first world.")] = 0
    policy: Annotated[str, tyro.conf.arg(help="Who plays.")] = "active"
    out: Annotated[Path | None, tyro.conf.arg(help="Also write the worlds to this .parquet file.")] = None

    def __post_init__(self) -> None:
        """Refuse what no verdict can be built on."""
        rule = f">= {LEAST_WORLDS}, fewer decide nothing"
        require(self.worlds >= LEAST_WORLDS, "worlds", rule, self.worlds)


class Played(NamedTuple):
    """An episode of two robots: the mean of Err, and what its meetings were like."""

    meetings: int
    apart_m: float
    waits: float
    err: float
    mbytes: float


def played(scenario: Scenario, policy: str, seed: int) -> Played:
    """Play one world to its end."""
    env = parallel_env(scenario=scenario)
    observations, _ = env.reset(seed=seed)
    driver = make_policy(policy, scenario)
    driver.reset(seed)
    errs, apart_m, waits, due_since = [], [], [], None
    while env.agents:
        observations, *_ = env.step(driver.act(observations))
        tick: Tick = env.tick
        errs.append(float(tick.belief.err.mean()))
        if due_since is None and tick.belief.team.observed[0, 1] >= scenario.rendezvous.kappa:
            due_since = tick.belief.t
        if tick.belief.team.met:
            apart_m.append(float(np.hypot(*np.diff(tick.truth.poses[:, -1, :2], axis=0)[0])))
            waits.append(tick.belief.t - due_since if due_since is not None else 0)
            due_since = None
    sent = float(tick.belief.team.bytes_sent.sum()) / 1e6
    return Played(len(apart_m), _mean(apart_m), _mean(waits), _mean(errs), sent)


def _mean(values: list[float] | list[int]) -> float:
    return float(np.mean(values)) if values else float("nan")


def all_worlds(config: BindsConfig) -> pd.DataFrame:
    """A row for each scenario, q and world."""
    return pd.DataFrame(
        {"scenario": name, "q_mbit_s": q, "world": seed}
        | played(scenario_named(name, q_mbit_s=q), config.policy, seed)._asdict()
        for name in PLAYED
        for q in QS_MBIT_S
        for seed in range(config.seed, config.seed + config.worlds)
    )


def show(rows: pd.DataFrame, console: Console) -> None:
    """Print a line for each scenario and q."""
    table = Table(title="where q binds: means over worlds, with 95 % intervals")
    for name in ("scenario", "q (Mb/s)", "meetings", "apart (m)", "waits", "Err", "sent (MB)"):
        table.add_column(name, no_wrap=True)
    for key, of_q in rows.groupby(["scenario", "q_mbit_s"], sort=False):
        scenario, q = key if isinstance(key, tuple) else (key, "")
        table.add_row(str(scenario), str(q), *(_interval(of_q[figure].to_numpy(float)) for figure in FIGURES))
    console.print(table)


def _interval(values: Float[np.ndarray, " worlds"]) -> str:
    known = values[np.isfinite(values)]
    if len(known) < 2:
        return "-"
    return f"{known.mean():.2f} +- {1.96 * known.std(ddof=1) / np.sqrt(len(known)):.2f}"


def main(config: BindsConfig) -> None:
    """Play, show, write."""
    rows = all_worlds(config)
    show(rows, Terminal(width=None if sys.stdout.isatty() else 140))
    if config.out is not None:
        with appearing(config.out) as part:
            rows.to_parquet(part, index=False)


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(tyro.cli(BindsConfig, description=__doc__))))
