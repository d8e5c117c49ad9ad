"""Simulated encounters are what their configuration says."""

from dataclasses import replace

import numpy as np
import pytest

from baselines.reproduce.encounters import KINDS, Encounter, EncounterConfig, simulate_encounter
from wifipgo import se2
from wifipgo.graph.bearings import bearing_residuals

CONFIG = EncounterConfig(range_m=3.0, n_outliers=4)


def drawn(cfg: EncounterConfig, seed: int = 0) -> Encounter:
    return simulate_encounter(cfg, rng=np.random.default_rng(seed))


def errors_in_sigmas(e: Encounter) -> np.ndarray:
    """Error of every edge in the frame of its tail, in its standard deviations."""
    ends = [e.truth[end[:, 0], end[:, 1]] for end in (e.edges.tail, e.edges.head)]
    off = e.edges.z - se2.between(*ends)
    off[:, 2] = se2.wrap_angle(off[:, 2])
    return off / e.edges.sigma[:, [0, 0, 1]]


def test_robots_are_at_their_range_when_they_measure_each_other() -> None:
    e = drawn(CONFIG)
    seen = e.edges.between_robots
    gap = e.truth[0, e.edges.tail[seen, 1], :2] - e.truth[1, e.edges.tail[seen, 1], :2]
    np.testing.assert_allclose(np.hypot(*gap.T), 3.0)
    assert seen.sum() == 9
    assert e.is_outlier.sum() == 4
    assert not e.is_outlier[~seen].any()


@pytest.mark.parametrize("kind", ["random", "same"])
def test_mild_outliers_are_two_to_three_sigma_off(kind: str) -> None:
    off = [
        errors_in_sigmas(e)[e.is_outlier] for e in (drawn(replace(CONFIG, kind=kind), s) for s in range(20))
    ]
    assert (np.abs(off) >= 2.0 - 1e-9).all()
    assert (np.abs(off) <= 3.0 + 1e-9).all()
    one_sign = [len(np.unique(np.sign(rows), axis=0)) == 1 for rows in off]
    assert all(one_sign) == (kind == "same")


def test_one_seed_is_one_world_for_every_kind_and_number() -> None:
    """Paths, good measurements and bearings stay; so comparisons over cells are paired, too."""
    base = drawn(replace(CONFIG, n_outliers=0))
    for kind in KINDS:
        e = drawn(replace(CONFIG, kind=kind))
        np.testing.assert_array_equal(e.truth, base.truth)
        np.testing.assert_array_equal(e.bearings.azimuth_rad, base.bearings.azimuth_rad)
        np.testing.assert_array_equal(e.edges.z[~e.is_outlier], base.edges.z[~e.is_outlier])
    more = drawn(replace(CONFIG, n_outliers=6))
    assert (more.is_outlier >= drawn(CONFIG).is_outlier).all()


def test_noise_is_gaussian_with_the_stated_sigmas() -> None:
    off = np.concatenate([errors_in_sigmas(drawn(replace(CONFIG, n_outliers=0), s)) for s in range(60)])
    np.testing.assert_allclose(off.std(axis=0), 1.0, atol=0.05)
    clean = replace(CONFIG, bearing_gross_share=0.0)
    heard = np.concatenate(
        [bearing_residuals(e.truth, e.bearings) for e in (drawn(clean, s) for s in range(60))]
    )
    np.testing.assert_allclose(heard.std() / clean.bearing_sigma_rad, 1.0, atol=0.08)


def test_wrong_bearings_are_off_by_one_angle_a_robot() -> None:
    e = drawn(replace(CONFIG, bearings_wrong=True))
    off = bearing_residuals(e.truth, e.bearings)
    for robot in range(2):
        angles = off[e.bearings.observer[:, 0] == robot]
        middle = np.angle(np.exp(1j * angles).mean())
        assert abs(middle) > np.deg2rad(15.0)
        assert np.abs(se2.wrap_angle(angles - middle)).max() < np.deg2rad(12.0)


def test_without_noise_dead_reckoning_and_alignment_find_the_truth() -> None:
    for known in (True, False):
        e = drawn(EncounterConfig(noise=0.0, start_known=known))
        np.testing.assert_allclose(e.start, e.truth, atol=1e-9)


def test_settings_that_mean_nothing_are_refused() -> None:
    for change, rule in (
        ({"range_m": 0.0}, "range_m must be > 0"),
        ({"n_outliers": 10}, r"n_outliers must be in 0..9 \(n_met\)"),
        ({"kind": "odd"}, "kind of outlier 'odd'; known: gross, random, same"),
        ({"bearing_gross_share": 1.5}, "in 0..1"),
        ({"n_met": 0}, "n_met must be >= 1"),
    ):
        with pytest.raises(ValueError, match=rule):
            replace(CONFIG, **change)
