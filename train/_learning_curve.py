"""How good a policy is while it is trained: mapped share on worlds kept apart, beside scripted policies."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import cycle
from pathlib import Path

from wifipgo.command.figures import Figure, drawing

import numpy as np
import pandas as pd
from jaxtyping import Float

from baselines.evaluation.batches import worlds_at_once
from baselines.evaluation.episodes import run_episodes, trial_seed
from baselines.evaluation.labels import wrapped
from baselines.policies import Policy
from baselines.policies.learned.network import Network
from baselines.policies.learned.policy import LearnedPolicy
from baselines.policies.registry import specs_of
from train._config import SelectionConfig
from wifipgo.command.palette import BLUE, SERIES
from wifipgo.errors import require
from wifipgo.files.atomic_files import appearing
from wifipgo.scenarios import Scenario

LEARNED = "learned"
_DASHES = ((0, (5, 1.5)), (0, (1.5, 1)), "-.")
_CURVE = "curve/"
COLUMNS = ("agent_steps", "policy", "trial", "seed", "mapped_share")


Played = Callable[[Scenario], str | Policy]


def mapped_shares(
    policy: Played, scenarios: Sequence[Scenario], cfg: SelectionConfig
) -> Float[np.ndarray, " trials"]:
    """MapAccuracy share of a policy on every world of the selection, scenario after scenario.

    Args:
        policy: By name, or as made for a scenario.
        scenarios: What is played; many worlds of each at once.
        cfg: Worlds.
    """
    return np.concatenate([_shares(policy(scenario), scenario, cfg) for scenario in scenarios])


def _shares(policy: str | Policy, scenario: Scenario, cfg: SelectionConfig) -> Float[np.ndarray, " trials"]:
    seeds = [trial_seed(cfg.seed, trial) for trial in range(cfg.trials)]
    size = worlds_at_once(scenario)
    parts = [seeds[begin : begin + size] for begin in range(0, len(seeds), size)]
    return np.array(
        [e.figures["mapped_share"] for part in parts for e in run_episodes(scenario, policy, part)]
    )


class Curve:
    """Scores over the training, as a table and a picture that are rewritten after each evaluation.

    Args:
        out: Folder.
        scenarios: What is played; trials are counted on from one to the next.
        cfg: Worlds and scripted policies.
        table: Scores of a run that is continued; without, the scripted policies are played first.
    """

    def __init__(
        self,
        out: Path,
        scenarios: Sequence[Scenario],
        cfg: SelectionConfig,
        table: pd.DataFrame | None = None,
    ) -> None:
        """Play the scripted policies that the table does not have."""
        self._out, self._scenarios, self._cfg = out, tuple(scenarios), cfg
        self.table = pd.DataFrame(columns=list(COLUMNS)) if table is None else table
        for spec in specs_of(cfg.policies):
            if not (self.table["policy"] == spec.label).any():
                self._add(0, spec.label, mapped_shares(partial(_by_name, str(spec)), scenarios, cfg))
        if table is not None:
            self.write()

    def evaluated(self, network: Network, agent_steps: int) -> float:
        """Play a network, add its scores to the table, and say their mean."""
        shares = mapped_shares(partial(LearnedPolicy.of, network), self._scenarios, self._cfg)
        self._add(agent_steps, LEARNED, shares)
        return float(shares.mean())

    def _add(self, agent_steps: int, policy: str, shares: Sequence[float] | np.ndarray) -> None:
        seeds = seeds_of(self._cfg)
        keys = {"agent_steps": agent_steps, "policy": policy, "trial": range(len(shares)), "seed": seeds}
        new = pd.DataFrame(keys | {"mapped_share": shares})
        self.table = pd.concat([self.table, new], ignore_index=True) if len(self.table) else new

    def write(self) -> None:
        """Rewrite table and picture."""
        with appearing(self._out / "curve.parquet") as unfinished:
            self.table.to_parquet(unfinished, index=False)
        picture = self._out / "curve.png"
        with drawing(picture), appearing(picture) as unfinished:
            drawn(self.table, self._title()).savefig(unfinished, dpi=120, format="png")

    def _title(self) -> str:
        more = len(self._scenarios) - 1
        return self._scenarios[0].name + (f" and {more} others" if more else "")


def seeds_of(cfg: SelectionConfig) -> list[int]:
    """Seeds of all worlds of a selection, scenario after scenario."""
    once = [trial_seed(cfg.seed, trial) for trial in range(cfg.trials)]
    return once * max(len(cfg.scenarios), 1)


def _by_name(name: str, scenario: Scenario) -> str:
    return name


def arrays_of_table(table: pd.DataFrame) -> dict[str, np.ndarray]:
    """Columns of a table, by name."""
    columns = {f"{_CURVE}{name}": table[name].to_numpy() for name in COLUMNS}
    return columns | {f"{_CURVE}policy": table["policy"].to_numpy(np.str_)}


def table_of(arrays: Mapping[str, np.ndarray], cfg: SelectionConfig, *, where: str) -> pd.DataFrame | None:
    """Table of the columns that `arrays_of_table` made, None if its worlds are not those of the selection.

    Raises:
        BadInputError: A column is missing, or of another length or kind.
    """
    columns = {name: arrays.get(f"{_CURVE}{name}") for name in COLUMNS}
    found = {name: column for name, column in columns.items() if column is not None}
    fits = len(found) == len(COLUMNS) and len({column.shape for column in found.values()}) == 1
    kinds = "".join(column.dtype.kind for column in found.values())
    require(fits and kinds == "iUiif", f"{where}: curve", f"columns {COLUMNS} of one length", kinds)
    table = pd.DataFrame(found).astype({"policy": object})
    seeds = seeds_of(cfg)
    mine = [
        rows["seed"].tolist() == seeds for _, rows in table.groupby(["agent_steps", "policy"], sort=False)
    ]
    return table if all(mine) else None


def drawn(table: pd.DataFrame, title: str) -> Figure:
    """Mean of the learned policy with its 95 % interval (normal), and the scripted ones as lines."""
    figure = Figure(figsize=(7.4, 4.0), layout="constrained")
    axes = figure.subplots()
    mine = table[table["policy"] == LEARNED].groupby("agent_steps")["mapped_share"]
    mean, n = mine.mean(), mine.count().to_numpy(float)
    wide = 1.96 * mine.std(ddof=1).fillna(0.0).to_numpy(float) / np.sqrt(n)
    x, n_trials = mean.index.to_numpy(float) / 1_000.0, int(table["trial"].max()) + 1
    axes.fill_between(x, mean - wide, mean + wide, color=BLUE, alpha=0.2, lw=0, label="95 % of its mean")
    axes.plot(x, mean, color=BLUE, marker="o", ms=3, label=LEARNED, zorder=3)
    others = table[table["policy"] != LEARNED].groupby("policy", sort=False)["mapped_share"].mean()
    for colour, dashes, (policy, share) in zip(
        cycle(SERIES[1:]), cycle(_DASHES), others.items(), strict=False
    ):
        label = f"{wrapped(str(policy), 24)}: {share:.2f}"
        axes.axhline(share, color=colour, ls=dashes, label=label)
    axes.set(xlabel="agent-steps (thousands)", ylabel="score: mapped share of the floor")
    axes.set_title(f"{title}, mean of {n_trials} worlds kept apart", loc="left")
    axes.set_ylim(0.0, 1.0)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(alpha=0.3)
    figure.legend(loc="outside right upper", frameon=False)
    return figure
