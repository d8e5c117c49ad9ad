"""From path loss alone to bearings of a real run: the same worlds under a radio that grows harder."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from baselines.policies import make_policy
from baselines.reproduce._runs import Run, World, changed
from envs.rendezvous_v0 import vector_env
from wifipgo.radio.aoa.peaks import find_peaks
from wifipgo.rendezvous import NOBODY
from wifipgo.scenarios import Scenario
from wifipgo.se2 import wrap_angle
from wifipgo.state import Tick

# Of the normal error whose median size is 9 deg, the middle of what a public Wi-Fi run has (6 to 12 deg), and
# how it lasts: from iteration to iteration.
REAL_SIGMA_DEG, REAL_MEMORY = 13.3, 0.9
_REAL = f"noisy_bearing:sigma_deg={REAL_SIGMA_DEG}:memory={REAL_MEMORY}"
_HARD = changed("radio-real-2-obstacles")
_PATHS = changed(_HARD, packet_loss=0.0, diffuse_ratio=0.0)
POLICIES = {
    "active": "active",
    "true direction": "oracle_bearing",
    "distance only": "ping_ranging",
    "strength only": "climb",
    "any direction": "noisy_bearing:sigma_deg=360",
    "random": "random",
    "explores, calls": "frontier_active",
    "explores by direction": "wiser_x",
}


class Rung(NamedTuple):
    """A radio.

    Attributes:
        label: What it has that the one before has not.
        scenario: The worlds under it.
        active: Policy that follows directions: the paper's, or with the errors of a real run.
        sigma_deg: Error of directions beside the radio's own.
    """

    label: str
    scenario: Scenario
    active: str = "active"
    sigma_deg: float = 0.0

    @property
    def runs(self) -> dict[str, Run]:
        """Every policy; where directions have errors of a real run, those of who follows them only."""
        specs = POLICIES | {"active": self.active}
        if self.sigma_deg:
            specs.pop("explores by direction", None)
        return {label: Run(self.scenario, spec) for label, spec in specs.items()}


RUNGS = (
    Rung("path loss", changed(_PATHS, max_order=0, diffraction=False)),
    Rung("+ reflections", changed(_PATHS, diffraction=False)),
    Rung("+ diffraction", _PATHS),
    Rung("+ scattering, loss", _HARD),
    Rung("+ real bearings", _HARD, _REAL, REAL_SIGMA_DEG),
)


def bearing_errors(rung: Rung, worlds: Sequence[World], *, n_steps: int = 20) -> Float[np.ndarray, " heard"]:
    """Errors of the strongest direction along a random walk, rad."""
    seeds = [world.seed for world in worlds]
    env, walker = vector_env(rung.scenario, n_worlds=len(seeds)), make_policy("random", rung.scenario)
    walker.reset_rows(seeds)
    rows, _ = env.reset(seed=seeds)
    found = []
    for _ in range(min(n_steps, rung.scenario.n_steps)):
        found += [_errors(env.tick_of(k), rung.scenario) for k in range(len(seeds))]
        rows, *_ = env.step(walker.act_rows(rows))
    off = np.concatenate(found)
    more = np.random.default_rng(seeds[0]).standard_normal(len(off))
    return wrap_angle(off + np.deg2rad(rung.sigma_deg) * more)


def _errors(tick: Tick, scenario: Scenario) -> Float[np.ndarray, " heard"]:
    """Of every robot that hears another in its first slot."""
    poses, radio = tick.truth.poses[:, -1], tick.belief.radio
    hearer = np.flatnonzero(radio.slots[:, 0] != NOBODY)
    gap_m = poses[radio.slots[hearer, 0], :2] - poses[hearer, :2]
    peak = find_peaks(radio.profile[hearer, 0], n_peaks=1)
    loud = peak.height[:, 0] > 0.0
    off = peak.azimuth_rad[:, 0] - (np.arctan2(gap_m[:, 1], gap_m[:, 0]) - poses[hearer, 2])
    return wrap_angle(off[loud])
