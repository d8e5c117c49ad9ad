"""Laws that every outlier method keeps."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from baselines.reproduce.encounters import Encounter, EncounterConfig, simulate_encounter
from wifipgo import se2
from wifipgo.graph.bearings import select_bearings
from wifipgo.graph.edges import select
from wifipgo.graph.metrics import ate_rot, ate_trans
from wifipgo.graph.outliers.methods import OUTLIER_METHODS, solve_robust

SEEDS = st.integers(0, 10_000)
STOP = 2e-3  # m and rad: where searches that start from rounded numbers stop
METHODS = ("bearing", "huber", "gnc", "pcm", "paper", "range_aware", "none")


def encounter(seed: int, *, noise: float = 1.0, n_outliers: int = 0) -> Encounter:
    cfg = EncounterConfig(noise=noise, n_outliers=n_outliers, kind="gross")
    return simulate_encounter(cfg, rng=np.random.default_rng(seed))


def apart(a: np.ndarray, b: np.ndarray) -> float:
    off = a - b
    off[..., 2] = se2.wrap_angle(off[..., 2])
    return float(np.abs(off).max())


@pytest.mark.parametrize("name", METHODS)
@settings(max_examples=6)
@given(seed=SEEDS, x_m=st.floats(-50.0, 50.0), yaw_rad=st.floats(-3.0, 3.0))
def test_rotating_the_world_changes_nothing(name: str, seed: int, x_m: float, yaw_rad: float) -> None:
    world = encounter(seed, n_outliers=2)
    T_new_world = np.array([x_m, -x_m, yaw_rad])
    here, report = solve_robust(world.start, world.edges, world.bearings, robots=[0, 1], outliers=name)
    start = se2.compose(T_new_world, world.start)
    there, report_there = solve_robust(start, world.edges, world.bearings, robots=[0, 1], outliers=name)
    assert apart(there, se2.compose(T_new_world, here)) < STOP
    gates = [{d.method: set(d.rows.tolist()) for d in r.downweighted} for r in (report, report_there)]
    for method in {"pcm", "paper", "range_aware"} & set(gates[0]):
        assert gates[0][method] == gates[1][method]


@pytest.mark.parametrize("name", sorted(OUTLIER_METHODS))
@settings(max_examples=3)
@given(seed=SEEDS)
def test_without_noise_nothing_is_wrong_whatever_the_method(name: str, seed: int) -> None:
    world = encounter(seed, noise=0.0)
    solved, report = solve_robust(world.start, world.edges, world.bearings, robots=[0, 1], outliers=name)
    assert ate_trans(solved, world.truth).max() < 1e-9
    assert ate_rot(solved, world.truth).max() < 1e-9
    assert report.downweighted == ()


@settings(max_examples=20)
@given(seed=SEEDS)
def test_weights_of_one_are_plain_optimisation(seed: int) -> None:
    """A gate that passes everything, or has nothing to judge by, changes no bit."""
    world = encounter(seed)
    plain, report = solve_robust(world.start, world.edges, robots=[0, 1], outliers="none")
    assert report.downweighted == ()
    unheard, _ = solve_robust(world.start, world.edges, robots=[0, 1], outliers="paper")
    np.testing.assert_array_equal(plain, unheard)
    ones = replace(world.edges, weight=np.ones(len(world.edges)))
    np.testing.assert_array_equal(plain, solve_robust(world.start, ones, robots=[0, 1], outliers="none")[0])


@settings(max_examples=10)
@given(seed=SEEDS)
def test_the_order_of_measurements_does_not_matter(seed: int) -> None:
    world = encounter(seed, n_outliers=1)
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(world.edges))
    heard = select_bearings(world.bearings, rng.permutation(len(world.bearings)))
    for name in ("bearing", "gnc", "pcm+huber"):
        solved, report = solve_robust(world.start, world.edges, world.bearings, robots=[0, 1], outliers=name)
        again, shuffled = solve_robust(
            world.start, select(world.edges, order), heard, robots=[1, 0], outliers=name
        )
        np.testing.assert_array_equal(solved, again)
        for one, other in zip(report.downweighted, shuffled.downweighted, strict=True):
            if one.method != "bearing":
                assert set(one.rows.tolist()) == set(order[other.rows].tolist())
