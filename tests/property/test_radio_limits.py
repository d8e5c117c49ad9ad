"""Fields of the radio at the ends of their limits: an episode that works there, and a refusal beyond."""

import itertools
from typing import Any

import numpy as np
import pytest

from envs.rendezvous_v0 import parallel_env
from wifipgo.errors import BadInputError
from wifipgo.radio.propagation.materials import Material, Slab, relative_permittivity, slab_reflection
from wifipgo.radio.propagation.surfaces import Surfaces

# Fields, their least and their largest value, and what else has to be so for them to count.
LIMITS: dict[str, tuple[Any, Any, dict[str, Any]]] = {
    "wall_thickness_m": (1e-6, 10.0, {"wall_material": "glass"}),
    "obstacle_thickness_m": (1e-6, 10.0, {"obstacle_material": "metal", "n_obstacles": 2, "size_m": 14.0}),
    "antenna_gap_m": (1e-4, 10.0, {}),
    "turn_rad": (1e-6, 100.0, {}),
    "n_positions": (8, 4096, {}),
    "n_azimuths": (72, 7200, {}),
    "n_paths": (1, 7, {"aoa_estimator": "music"}),
    "n_peaks": (1, 10, {"outliers": "paper"}),
    "carrier_hz": (1e9, 10e9, {}),
    "tx_power_dbm": (-60.0, 30.0, {}),
    "noise_figure_db": (0.0, 30.0, {}),
    "timing_jitter_s": (0.0, 1e-6, {"agc": True}),
    "packet_loss": (0.0, 1.0, {}),
    "chain_phase_rad": (0.0, 2.0 * np.pi, {}),
    "heading_noise_rad": (0.0, np.pi, {}),
    "heading_bias_rad": (-np.pi, np.pi, {}),
    "diffuse_ratio": (0.0, 1e6, {}),
    "diffuse_spread_rad": (1e-3, np.pi, {"diffuse_ratio": 1.0}),
    "q_mbit_s": (1e-3, 65.0, {}),
    "alpha": (0.0, 1e6, {}),
    "aoa_sigma_rad": (1e-4, np.pi, {"outliers": "range_aware"}),
    "aoa_gate_rad": (1e-4, np.pi, {"outliers": "paper"}),
}
NEAR = {"size_m": 6.0, "n_robots": 3, "n_slots": 2, "n_steps": 3}


def play(**options: Any) -> None:
    """A short episode, every observation inside its space, which nan is not."""
    env = parallel_env("paper-hw-2", **NEAR | options)
    shown, _ = env.reset(seed=0)
    while env.agents:
        assert all(env.observation_space(agent).contains(shown[agent]) for agent in env.agents)
        shown, rewards, *_ = env.step({agent: np.array([0.4, 0.2, 1.0]) for agent in env.agents})
        assert np.isfinite(list(rewards.values())).all()


@pytest.mark.parametrize(("name", "end"), list(itertools.product(LIMITS, (0, 1))))
def test_an_episode_works_at_the_limit_and_a_value_beyond_is_refused(name: str, end: int) -> None:
    low, high, more = LIMITS[name]
    value = (low, high)[end]
    play(**more | {name: value})
    beyond = value + (-1 if end == 0 else 1) * (
        1 if isinstance(value, int) else max(1e-12, 1e-3 * abs(value))
    )
    extreme = {int: (0, 10**400), float: (-1e308, 1e308)}[type(value)][end]
    for wrong in (beyond, extreme):
        with pytest.raises(BadInputError, match=name):
            parallel_env("paper-hw-2", **NEAR | more | {name: wrong})


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("antennas_m", {"antennas_m": ((0.0, 0.0), (1e307, -3e307), (-9e307, 9e307))}),
        ("antennas_m", {"antennas_m": ((0.0, 0.0), (5e-324, 0.0))}),
        ("antennas_m", {"antennas_m": ((3.0, 0.0), (-3.0, 0.0)), "antenna_scale": (1.0, 4.0, 1.0)}),
        ("antenna_scale", {"antenna_gap_m": 5.0, "antenna_scale": (1.0, 3.0, 1.0)}),
        ("antenna_scale", {"antenna_gap_m": 1e-3, "antenna_scale": (1.0, 0.05, 1.0)}),
        ("antenna_scale", {"antenna_scale": (1.0, 5e-324, 1.0)}),
        ("n_azimuths", {"n_azimuths": 7200, "n_positions": 4096}),
        ("n_azimuths", {"n_azimuths": 72_000_000}),
    ],
)
def test_what_only_fails_later_or_together_is_refused_at_once(name: str, options: dict[str, Any]) -> None:
    with pytest.raises(BadInputError, match=name):
        parallel_env("paper-hw-2", **NEAR | options)


def test_antennas_far_apart_and_scaled_within_limits_work() -> None:
    play(antennas_m=((10.0, -10.0), (-10.0, 10.0), (0.0, 1e-4)))
    play(antennas_m=((0.1, 0.0), (-0.1, 0.0)), antenna_scale=(0.01, 1.0, 40.0))


@pytest.mark.parametrize(
    "constants", list(itertools.product((1.0, 1e6), (-10.0, 10.0), (0.0, 1e9), (-10.0, 10.0)))
)
@pytest.mark.parametrize("carrier_hz", [1e3, 1e9, 5e9, 1e15])
def test_a_slab_of_any_material_never_gives_nan(
    constants: tuple[float, float, float, float], carrier_hz: float
) -> None:
    """Refused, or a reflection of at most 1, also where many are worked out at once."""
    a, b, c, d = constants
    material = Material(a, b, c, d, lowest_hz=1e3, highest_hz=1e15)
    try:
        permittivity = relative_permittivity(material, carrier_hz)
    except BadInputError:
        return
    cos_incidence = np.concatenate([[0.0, 1e-300, 1e-12], np.linspace(0.0, 1.0, 200)])
    for thickness_m in (1e-6, 0.2, 10.0):
        shape = np.full(len(cos_incidence), 1.0)
        found = slab_reflection(permittivity * shape, thickness_m * shape, cos_incidence, carrier_hz)
        assert (np.abs(found) <= 1.0 + 1e-9).all()


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("permittivity", np.nan + 0.0j),
        ("permittivity", 0.2 + 0.0j),
        ("permittivity", 2.0 + 1.0j),
        ("thickness_m", 1e308),
    ],
)
def test_surfaces_refuse_slabs_that_are_none(field: str, value: complex) -> None:
    fields = {"permittivity": np.array([4.0 - 0.1j]), "thickness_m": np.array([0.1])}
    fields[field] = np.array([value])
    with pytest.raises(BadInputError, match=f"Surfaces.{field}"):
        Surfaces(ends_m=np.array([[[0.0, 0.0], [1.0, 0.0]]]), n_walls=0, **fields)


@pytest.mark.parametrize("thickness_m", [0.0, 1e308, float("nan"), float("inf"), -1.0])
def test_slabs_of_no_thickness_are_refused(thickness_m: float) -> None:
    with pytest.raises(BadInputError, match=r"Slab.thickness_m must be in 1e-06..10"):
        Slab("glass", thickness_m)
