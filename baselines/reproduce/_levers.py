"""Everything of ours that the paper's text does not fix, changed one at a time, in one room."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from baselines.evaluation.jobs import Task
from baselines.reproduce._runs import Run, Setting, changed, tasks_of
from wifipgo.scenarios import Scenario

BASE = changed("paper-hw-2")
DEFAULT = "as it is"
# Three things carry the factor of six; each is taken away, then all.
INFORMATION = {"err_weights": "information"}
NO_PLACES, EVERY_STEP = {"revisit_gap": 1000}, {"estimator": "every_step"}
THREE: Mapping[str, Mapping[str, object]] = {
    "own places: not measured": NO_PLACES,
    "poses optimised: at every step": EVERY_STEP,
    "weights in Eq. 4: those of the noise": INFORMATION,
    "weights in Eq. 4: those of the noise, delta 2": INFORMATION | {"err_threshold": 2.0},
    "none of the three, delta 2": NO_PLACES | EVERY_STEP | INFORMATION | {"err_threshold": 2.0},
}


class Lever(NamedTuple):
    """A change, and the two runs that are compared under it.

    Attributes:
        label: What is changed, and to what.
        active: Active rendezvous.
        random: Random rendezvous in the same worlds.
    """

    label: str
    active: Run
    random: Run


def levers() -> list[Lever]:
    """All changes; the first is none."""
    fields = {DEFAULT: {}, **THREE, **_readings(), **_numbers(BASE), **_rooms(BASE)}
    found = [_of_fields(label, change) for label, change in fields.items()]
    walks = Lever("random walk: keeps its heading", Run(BASE, "persistent_active"), Run(BASE, "persistent"))
    return [*found, walks, *(Lever(label, Run(BASE, of), Run(BASE, "random")) for label, of in _POLICIES)]


def tasks(setting: Setting) -> list[Task]:
    """Episodes of all of them, each once."""
    return tasks_of([run for lever in levers() for run in (lever.active, lever.random)], setting)


_POLICIES = (
    ("error of direction: 10 deg", "noisy_bearing:sigma_deg=10"),
    ("error of direction: 30 deg", "noisy_bearing:sigma_deg=30"),
    ("error of direction: 60 deg", "noisy_bearing:sigma_deg=60"),
    ("error of direction: 90 deg", "noisy_bearing:sigma_deg=90"),
    ("error of direction: any direction", "noisy_bearing:sigma_deg=360"),
    ("direction: the true one", "oracle_bearing"),
    ("the caller: drives towards whom it calls", "active:caller_drives=true"),
)


def _of_fields(label: str, change: Mapping[str, object]) -> Lever:
    """Other values for fields of the scenario."""
    other = changed(BASE, **change)
    return Lever(label, Run(other, "active"), Run(other, "random"))


def _readings() -> dict[str, Mapping[str, object]]:
    """Other readings of the paper's text."""
    return {
        "weights in Eq. 3: those of Eq. 4": {"solve_weights": "unit"},
        "kappa counts: from the call": {"kappa_since": "call"},
        "relative poses at a meeting: exactly nine": {"measured_by": "one", "kappa": 9},
        "noise of odometry: by the distance driven": {"odometry_noise": "motion"},
        "noise: a third for one robot, thrice for the other": {"noise_scale": (1.0 / 3.0, 3.0)},
    }


def _numbers(base: Scenario) -> dict[str, Mapping[str, object]]:
    """Numbers, smaller and larger."""
    sensing, power_dbm = base.sensing, base.radio.tx_power_dbm
    noises = {
        f"noise of every sensor: times {k:g}": {
            "sigma_t_m": k * sensing.sigma_t_m,
            "sigma_r_rad": k * sensing.sigma_r_rad,
        }
        for k in (0.5, 2.0)
    }
    return {
        "own places: after 10 iterations": {"revisit_gap": 10},
        **noises,
        **{f"sensor range: {m:g} m": {"sensor_range_m": m} for m in (1.1, 4.4)},
        **{f"delta: {d:g}": {"err_threshold": d} for d in (2.5, 5.0, 20.0)},
        **{f"kappa: {k}": {"kappa": k} for k in (1, 6)},
        **{f"power: {dbm:+g} dB": {"tx_power_dbm": power_dbm + dbm} for dbm in (-6.0, 6.0)},
        **{f"q: {q:g} Mb/s": {"q_mbit_s": q} for q in (13.0, 58.5)},
    }


def _rooms(base: Scenario) -> dict[str, Mapping[str, object]]:
    """Sizes, materials, obstacles."""
    size_m, power_dbm = base.arena.size_m, base.radio.tx_power_dbm

    def sized(m: float) -> Mapping[str, object]:
        return {"size_m": m, "tx_power_dbm": round(power_dbm + 20.0 * float(np.log10(m / size_m)), 2)}

    boxes = {"n_obstacles": 4}
    return {
        **{f"room: {m:g} m, power to match": sized(m) for m in (14.0, 40.0)},
        **{f"walls: {of}": {"wall_material": of} for of in ("metal", "wood")},
        "boxes: four of thin wood": boxes,
        **{
            f"boxes: four of {of}, {m:g} m": {
                **boxes,
                "obstacle_material": of,
                "obstacle_thickness_m": m,
            }
            for of, m in (("concrete", 0.2), ("metal", 0.003))
        },
    }
