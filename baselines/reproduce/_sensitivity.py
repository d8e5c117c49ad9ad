"""Numbers that are ours and not the paper's, and readings of its text, each changed one at a time."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from baselines.evaluation.episodes import Episode
from baselines.evaluation.intervals import Estimate
from baselines.reproduce._claims import SENSITIVITY, Found, row
from baselines.reproduce._runs import Run, Setting, changed
from wifipgo.scenarios import Scenario

Change = dict[str, object]
Pair = tuple[Run, Run]


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


def reading_runs(scenario: Scenario) -> dict[str, Pair]:
    """Active and random under every other reading of the paper's text, by what to call it."""
    changes: dict[str, Change] = {
        "same weights in Eqs. 3 and 4 (ours: true covariances in Eq. 3)": {"solve_weights": "unit"},
        "odometry noise in proportion to the drive (ours: the same at every iteration)": {
            "odometry_noise": "motion"
        },
        "kappa counts from the call (ours: from the last meeting)": {"kappa_since": "call"},
        "exactly nine relative poses at a meeting (ours: two each of three observations)": {
            "measured_by": "one",
            "kappa": 9,
        },
    }
    pairs = {
        label: (Run(other, "active"), Run(other, "random"))
        for label, change in changes.items()
        for other in (changed(scenario, **change),)
    }
    drives = Run(scenario, "active:caller_drives=true"), Run(scenario, "random")
    return pairs | {"the caller drives towards the called (ours: it stands)": drives}


def sensitivity_runs(scenario: Scenario) -> dict[str, Pair]:
    """The same, and under every change of a number of ours."""
    pairs = {
        label: (Run(other, "active"), Run(other, "random"))
        for label, change in variants(scenario).items()
        for other in (changed(scenario, **change),)
    }
    walk = Run(scenario, "persistent_active"), Run(scenario, "persistent")
    pairs["random walks keep their heading (ours: a new one each iteration)"] = walk
    every = changed(scenario, estimator="every_step")
    pairs["optimised at every step (ours: at a rendezvous)"] = Run(every, "active"), Run(every, "random")
    return pairs | reading_runs(scenario)


def sensitivity(
    pairs: Mapping[str, Pair],
    setting: Setting,
    measure: Callable[[Sequence[Episode], Sequence[Episode]], Estimate],
    *,
    prefix: str = "",
) -> list[Found]:
    """A figure of active against random under every change.

    Args:
        pairs: Active and random, by what to call the change.
        setting: Of the run.
        measure: Takes the episodes of active and of random.
        prefix: To put before what a change is called.
    """
    return [
        row(
            prefix + label,
            measure,
            active.episodes(setting),
            random.episodes(setting),
            role=SENSITIVITY,
        )
        for label, (active, random) in (pairs if setting.sensitivity else {}).items()
    ]


def all_runs(pairs: Mapping[str, Pair]) -> list[Run]:
    """Both of every pair."""
    return [run for pair in pairs.values() for run in pair]
