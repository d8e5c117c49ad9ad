"""The numbers that are ours and not the paper's, each changed one at a time."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from baselines.evaluation.episodes import Episode
from baselines.evaluation.intervals import Estimate
from baselines.reproduce._claims import SENSITIVITY, Found, row
from baselines.reproduce._runs import Run, Setting, changed
from wifipgo.scenarios import Scenario

Change = dict[str, object]


def variants(scenario: Scenario) -> dict[str, Change]:
    """Other values for a scenario's numbers, by what to call them."""
    size_m, power_dbm = scenario.arena.size_m, scenario.radio.tx_power_dbm
    sizes = (14.0, 40.0) if size_m <= 20.0 else (40.0, 100.0)
    arenas: dict[str, Change] = {
        f"room {other:g} x {other:g}, power to match (ours {size_m:g})": {
            "size_m": other,
            "tx_power_dbm": round(power_dbm + 20.0 * float(np.log10(other / size_m)), 2),
        }
        for other in sizes
    }
    kappas: dict[str, Change] = {
        f"kappa {k} (ours {scenario.rendezvous.kappa})": {"kappa": k} for k in (1, 6)
    }
    rates: dict[str, Change] = {
        f"q {q:g} Mb/s (ours {scenario.link.q_mbit_s:g})": {"q_mbit_s": q} for q in (13.0, 58.5)
    }
    places: dict[str, Change] = {"own places not measured (ours: measured again)": {"revisit_gap": 1000}}
    return {**places, **arenas, **kappas, **rates}


def sensitivity_runs(scenario: Scenario) -> dict[str, tuple[Run, Run]]:
    """Active and random under every change, by what to call it."""
    pairs = {
        label: (Run(other, "active"), Run(other, "random"))
        for label, change in variants(scenario).items()
        for other in (changed(scenario, **change),)
    }
    walk = Run(scenario, "persistent_active"), Run(scenario, "persistent")
    pairs["random walks keep their heading (ours: a new one each iteration)"] = walk
    every = changed(scenario, estimator="every_step")
    pairs["optimised at every step (ours: at a rendezvous)"] = Run(every, "active"), Run(every, "random")
    return pairs


def sensitivity(
    scenario: Scenario,
    setting: Setting,
    measure: Callable[[Sequence[Episode], Sequence[Episode]], Estimate],
    *,
    prefix: str = "",
) -> list[Found]:
    """A figure of active against random under every change.

    Args:
        scenario: What is changed.
        setting: Of the run.
        measure: Takes the episodes of active and of random.
        prefix: To put before what a change is called.
    """
    pairs = sensitivity_runs(scenario) if setting.sensitivity else {}
    return [
        row(
            prefix + label,
            measure,
            active.episodes(setting),
            random.episodes(setting),
            role=SENSITIVITY,
        )
        for label, (active, random) in pairs.items()
    ]


def all_runs(pairs: Mapping[str, tuple[Run, Run]]) -> list[Run]:
    """Both of every pair."""
    return [run for pair in pairs.values() for run in pair]
