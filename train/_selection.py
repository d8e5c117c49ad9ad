"""How good a policy is while it is trained: mapped share on worlds kept apart, beside scripted policies."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from jaxtyping import Float
from matplotlib.figure import Figure

from baselines._episodes import run_episode, trial_seed
from baselines._learned import LearnedPolicy
from baselines._network import Network
from baselines.policies import Policy
from train._config import SelectionConfig
from wifipgo.scenarios import Scenario
from wifipgo.whole_files import appearing

LEARNED = "learned"
_COLUMNS = ("agent_steps", "policy", "trial", "seed", "mapped_share")


def mapped_shares(
    policy: str | Policy, scenario: Scenario, cfg: SelectionConfig
) -> Float[np.ndarray, " trials"]:
    """Mapped share of a policy on every world of the selection."""
    seeds = [trial_seed(cfg.seed, trial) for trial in range(cfg.trials)]
    return np.array([run_episode(scenario, policy, seed).figures["mapped_share"] for seed in seeds])


class Curve:
    """Scores over the training, as a table and a picture that are rewritten after each evaluation.

    Args:
        out: Folder.
        scenario: What is played.
        cfg: Worlds and scripted policies.
        table: Scores of a run that is continued; without, the scripted policies are played first.
    """

    def __init__(
        self, out: Path, scenario: Scenario, cfg: SelectionConfig, table: pd.DataFrame | None = None
    ) -> None:
        """Play the scripted policies that the table does not have."""
        self._out, self._scenario, self._cfg = out, scenario, cfg
        self.table = pd.DataFrame(columns=list(_COLUMNS)) if table is None else table
        for spec in cfg.policies:
            if not (self.table["policy"] == spec).any():
                self._add(0, spec, mapped_shares(spec, scenario, cfg))

    def evaluated(self, network: Network, agent_steps: int) -> float:
        """Play a network, write table and picture, and say its mean."""
        shares = mapped_shares(LearnedPolicy.of(network, self._scenario), self._scenario, self._cfg)
        self._add(agent_steps, LEARNED, shares)
        self._write()
        return float(shares.mean())

    @property
    def best(self) -> float:
        """Best mean of a network so far, -1 before the first."""
        mine = self.table[self.table["policy"] == LEARNED]
        return float(mine.groupby("agent_steps")["mapped_share"].mean().max()) if len(mine) else -1.0

    def _add(self, agent_steps: int, policy: str, shares: Sequence[float] | np.ndarray) -> None:
        seeds = [trial_seed(self._cfg.seed, trial) for trial in range(self._cfg.trials)]
        keys = {"agent_steps": agent_steps, "policy": policy, "trial": range(len(shares)), "seed": seeds}
        new = pd.DataFrame(keys | {"mapped_share": shares})
        self.table = pd.concat([self.table, new], ignore_index=True) if len(self.table) else new

    def _write(self) -> None:
        with appearing(self._out / "curve.parquet") as unfinished:
            self.table.to_parquet(unfinished, index=False)
        with appearing(self._out / "curve.png") as unfinished:
            drawn(self.table, self._scenario.name).savefig(unfinished, dpi=120, format="png")


def drawn(table: pd.DataFrame, title: str) -> Figure:
    """Mean of the learned policy with its 95 % interval (normal), and the scripted ones as lines."""
    figure = Figure(figsize=(7.0, 4.0), layout="constrained")
    axes = figure.subplots()
    mine = table[table["policy"] == LEARNED].groupby("agent_steps")["mapped_share"]
    mean = mine.mean()
    wide = 1.96 * mine.std(ddof=1).fillna(0.0).to_numpy(float) / np.sqrt(mine.count().to_numpy(float))
    x = mean.index.to_numpy(float) / 1_000.0
    (line,) = axes.plot(x, mean, marker="o", markersize=3, label=LEARNED, zorder=3)
    axes.fill_between(x, mean - wide, mean + wide, color=line.get_color(), alpha=0.2, linewidth=0)
    for k, (policy, rows) in enumerate(table[table["policy"] != LEARNED].groupby("policy", sort=False)):
        axes.axhline(rows["mapped_share"].mean(), color=f"C{k + 1}", linestyle="--", label=str(policy))
    axes.set(xlabel="agent-steps (thousands)", ylabel="mapped share", title=title)
    axes.set_ylim(0.0, 1.0)
    axes.legend(loc="lower right")
    axes.grid(alpha=0.3)
    return figure
