"""Outlier methods against graphs that can be solved by hand, finite differences and each other's limits."""

from dataclasses import replace

import gtsam
import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import chdtr, ndtr

from baselines.reproduce.encounters import Encounter, EncounterConfig, simulate_encounter
from wifipgo.errors import UnknownNameError
from wifipgo.graph.bearings import Bearings, bearing_residuals, heard_along, select_bearings
from wifipgo.graph.edges import Edges, extended, select
from wifipgo.graph.losses import HUBER_KNEE, geman_mcclure_weight
from wifipgo.graph.metrics import ate_trans
from wifipgo.graph.outliers.aoa_weights import (
    PAPER_GATE_RAD,
    PAPER_SIGMA_RAD,
    bearing,
    paper_weights,
    range_aware_weights,
)
from wifipgo.graph.outliers.methods import OUTLIER_METHODS, solve_robust
from wifipgo.graph.outliers.pcm import consistent
from wifipgo.graph.solvers import UNKNOWN_START, solve
from wifipgo.graph.solvers._losses import geman_mcclure, huber, weight_at_huber_loss

C = 2.0  # of Geman-McClure, in sigmas
BEARING_SIGMA_RAD = float(np.deg2rad(3.0))


def encounter(seed: int, *, noise: float = 1.0, n_outliers: int = 0) -> Encounter:
    """Two robots 2 m apart, some of their nine relative poses anything but true."""
    cfg = EncounterConfig(noise=noise, n_outliers=n_outliers, kind="gross", bearing_gross_share=0.0)
    return simulate_encounter(cfg, rng=np.random.default_rng(seed))


def met(world: Encounter) -> np.ndarray:
    """Rows of the relative poses between robots."""
    return np.flatnonzero(world.edges.between_robots)


def ahead(x_m: float, *, sigma_m: float = 0.1, index: int = 1) -> Edges:
    """Robot 0 reports robot 1 straight ahead."""
    return Edges.measured(
        tail=np.array([[0, index]]),
        head=np.array([[1, 0]]),
        z=np.array([[x_m, 0.0, 0.0]]),
        sigma=(sigma_m, 0.05),
        reported_pose=np.zeros((1, 3)),
    )


def line(reports_m: list[float]) -> tuple[np.ndarray, Edges]:
    """Robot 0 takes one step to 1 m, exactly known there by odometry of 0.1 m; robot 1 stands at 4 m."""
    poses = np.zeros((2, 2, 3))
    poses[0, 1, 0], poses[1, :, 0] = 1.0, 4.0
    ends = np.array([[[0, 0], [0, 1]], [[1, 0], [1, 1]]])
    z = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    odometry = Edges.measured(tail=ends[:, 0], head=ends[:, 1], z=z, sigma=(0.1, 0.05))
    return poses, extended(odometry, *(ahead(x_m) for x_m in reports_m))


def test_a_bearing_factor_has_the_residual_of_the_closed_form() -> None:
    """Gtsam's residual at random poses, and its slope by finite differences, are those of atan2."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        poses = rng.uniform(-3.0, 3.0, (2, 1, 3))
        azimuth = rng.uniform(-np.pi, np.pi)
        heard = Bearings.measured(
            observer=np.array([[0, 0]]),
            target=np.array([[1, 0]]),
            azimuth_rad=np.array([[azimuth]]),
            sigma_rad=1.0,
        )
        noise = gtsam.noiseModel.Isotropic.Sigma(1, 1.0)
        factor = gtsam.BearingFactorPose2(0, 1, gtsam.Rot2(azimuth), noise)

        def values(p: np.ndarray) -> gtsam.Values:
            made = gtsam.Values()
            for key in range(2):
                made.insert(key, gtsam.Pose2(*p[key, 0].tolist()))
            return made

        off = float(bearing_residuals(poses, heard)[0])
        np.testing.assert_allclose(abs(factor.unwhitenedError(values(poses))[0]), abs(off), atol=1e-9)
        jacobian, _ = factor.linearize(values(poses)).jacobian()
        for k in range(2):
            turned = poses.copy()
            turned[k, 0, 2] += 1e-6
            slope = (float(bearing_residuals(turned, heard)[0]) - off) / 1e-6
            np.testing.assert_allclose(abs(jacobian[0, 3 * k + 2]), abs(slope), atol=1e-5)


def test_losses_and_weights_are_those_of_the_formulas() -> None:
    """Huber: d^2 / 2 up to the knee, then linear. Geman-McClure: c^2 e^2 / (c^2 + e^2) / 2."""
    unit = gtsam.noiseModel.Isotropic.Sigma(1, 1.0)
    e = np.linspace(0.0, 9.0, 40)
    linear = HUBER_KNEE * (e - 0.5 * HUBER_KNEE)
    loss = np.where(e <= HUBER_KNEE, 0.5 * e**2, linear)
    np.testing.assert_allclose([huber(unit).loss(x * x) for x in e], loss, atol=1e-12)
    np.testing.assert_allclose(
        weight_at_huber_loss(loss), np.minimum(1.0, HUBER_KNEE / np.maximum(e, 1e-9)), rtol=1e-9
    )
    model = geman_mcclure(1.0)
    np.testing.assert_allclose([model.loss(x * x) for x in e], 0.5 * C**2 * e**2 / (C**2 + e**2), atol=1e-12)
    np.testing.assert_allclose(
        geman_mcclure_weight(e), [model.weight(np.array([x])) ** 1 for x in e], rtol=1e-9
    )


def test_one_bearing_on_a_line_moves_the_pose_to_the_root_of_its_pull() -> None:
    """A pose held in y by odometry and heard sideways: the pulls of both balance, by scalar root-finding."""
    sigma_m, range_m, y_m = 0.1, 3.0, 0.25  # where the bearing alone would put the observer
    poses, edges = line([])
    heard = Bearings.measured(
        observer=np.array([[1, 0]]),
        target=np.array([[0, 1]]),
        azimuth_rad=np.array([[np.arctan2(y_m, -range_m)]]),
        sigma_rad=BEARING_SIGMA_RAD,
    )
    solved, report = solve(poses, edges, robots=[0, 1], bearings=heard)
    x_m, at_m = solved[0, 1, :2]

    def pull(y: float) -> float:
        gap = np.arctan2(y, -(4.0 - x_m)) - np.arctan2(y_m, -range_m)
        e = gap / BEARING_SIGMA_RAD
        slope = -(4.0 - x_m) / ((4.0 - x_m) ** 2 + y**2) / BEARING_SIGMA_RAD
        return float(y / sigma_m**2 + e * slope * (C**2 / (C**2 + e**2)) ** 2)

    np.testing.assert_allclose(at_m, brentq(pull, -0.1, 0.2), atol=1e-5)
    assert report.downweighted == ()


def test_pairs_that_disown_their_bearings_do_without() -> None:
    """Most of what robot 0 heard is wrong: nothing that either heard of the other enters, to the bit."""
    world = encounter(5)
    azimuth, by_0 = world.bearings.azimuth_rad.copy(), world.bearings.observer[:, 0] == 0
    azimuth[np.flatnonzero(by_0)[:5]] += 2.0
    wrong = replace(world.bearings, azimuth_rad=azimuth)
    silent, _ = solve(world.start, world.edges, robots=[0, 1])
    solved, report = solve(world.start, world.edges, robots=[0, 1], bearings=wrong)
    np.testing.assert_array_equal(solved, silent)
    (down,) = report.downweighted
    np.testing.assert_array_equal(np.sort(down.rows), np.arange(len(wrong)))
    assert (down.weight == 0.0).all()
    azimuth[np.flatnonzero(by_0)[:1]] -= 2.0
    few = replace(world.bearings, azimuth_rad=azimuth)
    heard, report = solve(world.start, world.edges, robots=[0, 1], bearings=few)
    assert not np.array_equal(heard, silent)
    assert set(np.flatnonzero(by_0)[1:5]) <= set(report.downweighted[0].rows.tolist())


@pytest.mark.parametrize("name", ["huber", "gnc", "pcm", "bearing"])
def test_a_gross_outlier_among_good_reports_is_named_and_let_go(name: str) -> None:
    """Four robots' reports say 3 m, one says 9 m: its row is weighed down, and the pose stays."""
    poses, edges = line([3.0, 3.05, 2.95, 9.0, 3.0])
    plain, _ = solve_robust(poses, edges, robots=[0, 1], outliers="none")
    solved, report = solve_robust(poses, edges, robots=[0, 1], outliers=name)
    assert abs(plain[0, 1, 0] - 1.0) > 0.3
    assert abs(solved[0, 1, 0] - 1.0) < 0.05
    down = report.downweighted[0]
    assert down.method == {"bearing": "huber"}.get(name, name)
    assert 5 in down.rows
    assert down.weight[list(down.rows).index(5)] < 0.1
    if name in ("gnc", "pcm"):
        np.testing.assert_array_equal(down.rows, [5])


def test_huber_on_a_line_is_the_root_of_its_pull() -> None:
    """Beyond the knee the outlier pulls with a constant force k / sigma."""
    poses, edges = line([3.0, 9.0])
    solved, report = solve(poses, edges, robots=[0, 1], loss="huber")
    off = -HUBER_KNEE * 0.1 / 2.0  # (x - 1) / s^2 + (x - 1) / s^2 = - k / s
    np.testing.assert_allclose(solved[0, 1, 0], 1.0 + off, atol=1e-6)
    (down,) = report.downweighted
    np.testing.assert_array_equal(down.rows, [3])
    np.testing.assert_allclose(down.weight, HUBER_KNEE / ((9.0 + off - 3.0) / 0.1), rtol=1e-6)


def test_gates_weigh_by_the_closest_peak_of_who_measured() -> None:
    """Weights and rows in the report are those of the formula on the tail's own bearing."""
    world = encounter(3, n_outliers=1)
    row = heard_along(world.edges, world.bearings)
    assert (row[: met(world)[0]] == -1).all()
    peak = world.bearings.azimuth_rad[row[met(world)], 0]
    z, sigma = world.edges.z[met(world)], world.edges.sigma[met(world)]
    expected = {
        "paper": paper_weights(bearing(z), peak),
        "range_aware": range_aware_weights(z, sigma[:, 0], peak),
    }
    assert (expected["paper"][world.is_outlier[met(world)]] < 1.0).all()
    for name, weight in expected.items():
        _, report = solve_robust(world.start, world.edges, world.bearings, robots=[0, 1], outliers=name)
        (down,) = report.downweighted
        assert down.method == name
        np.testing.assert_array_equal(down.rows, met(world)[weight < 1.0])
        np.testing.assert_allclose(down.weight, weight[weight < 1.0])


def test_the_range_aware_gate_is_eq_11_for_exact_positions_and_wide_nearby() -> None:
    angle = np.linspace(-0.6, 0.6, 121)
    z = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)
    peak, exact = np.zeros_like(angle), np.zeros_like(angle)
    knee = PAPER_SIGMA_RAD * np.sqrt(2.0 * np.log(1.0 / PAPER_SIGMA_RAD))
    aware = range_aware_weights(z, exact, peak, gate_rad=knee)
    np.testing.assert_allclose(aware, paper_weights(angle, peak, gate_rad=knee), atol=1e-9)
    near = range_aware_weights(z, np.full_like(angle, 0.2), peak)
    gate = PAPER_GATE_RAD / PAPER_SIGMA_RAD * np.hypot(PAPER_SIGMA_RAD, 0.2)
    np.testing.assert_array_equal(near < 1.0, np.abs(angle) > gate)


def test_good_loops_pass_pcm_and_a_set_that_agrees_wins() -> None:
    world = encounter(1, noise=0.3)
    assert consistent(world.edges, n_robots=2).all()
    wrong = encounter(2, noise=0.3, n_outliers=4)
    np.testing.assert_array_equal(consistent(wrong.edges, n_robots=2), ~wrong.is_outlier)


def test_an_unknown_start_is_found_from_the_encounter() -> None:
    """Robot 1 is moved as a whole; without noise its measurements of robot 0 put it back."""
    world = encounter(4, noise=0.0)
    start = world.start.copy()
    start[1, :, :2] += [0.8, -0.5]
    unknown = np.array([(1e-5, 1e-5), UNKNOWN_START])
    solved, _ = solve(start, world.edges, robots=[0, 1], start_sigma=unknown)
    assert ate_trans(solved, world.truth).max() < 1e-8
    fixed, _ = solve(start, world.edges, robots=[0, 1])
    np.testing.assert_array_equal(fixed[1, 0], start[1, 0])
    alone, _ = solve(
        start, select(world.edges, ~world.edges.between_robots), robots=[0, 1], start_sigma=unknown
    )
    np.testing.assert_allclose(alone, start, atol=1e-6)  # nothing ties it: it stays


def test_the_knee_leaves_out_the_shares_that_are_stated() -> None:
    """Four in ten good poses within; 2.2 has the share of good scalars within 1.345."""
    assert round(float(chdtr(3, HUBER_KNEE**2)), 1) == 0.4
    np.testing.assert_allclose(chdtr(3, 2.2155**2), 2.0 * ndtr(HUBER_KNEE) - 1.0, atol=1e-3)


def test_bad_requests_say_what_is_wrong() -> None:
    world = encounter(0)
    with pytest.raises(UnknownNameError, match="outlier method 'bearings'; known: bearing, gnc"):
        solve_robust(world.start, world.edges, robots=[0, 1], outliers="bearings")
    with pytest.raises(UnknownNameError, match="loss 'cauchy'; known: gnc, huber, none"):
        solve(world.start, world.edges, robots=[0, 1], loss="cauchy")
    heard = world.bearings
    for change, rule in (
        ({"sigma_rad": 0.0}, "sigma_rad must be > 0"),
        ({"azimuth_rad": np.full((len(heard), 1), np.nan)}, "azimuth_rad must be finite"),
        ({"target": heard.observer}, "target must be another robot"),
    ):
        content = {name: getattr(heard, name) for name in ("observer", "target", "azimuth_rad", "sigma_rad")}
        with pytest.raises(ValueError, match=rule):
            Bearings.measured(**(content | change))


def test_bearings_from_outside_the_solve_are_left_out() -> None:
    world = encounter(2)
    alone, _ = solve(world.start, world.edges, robots=[0], third_party="ignore", bearings=world.bearings)
    silent, _ = solve(world.start, world.edges, robots=[0], third_party="ignore")
    np.testing.assert_array_equal(alone, silent)
    none = select_bearings(world.bearings, np.zeros(0, dtype=np.int64))
    same, _ = solve(world.start, world.edges, robots=[0, 1], bearings=none)
    np.testing.assert_array_equal(same, solve(world.start, world.edges, robots=[0, 1])[0])


def test_every_part_of_a_name_is_in_its_guard() -> None:
    for name, guard in OUTLIER_METHODS.items():
        parts = set(name.split("+"))
        assert guard.bearings == ("bearing" in parts)
        assert guard.gate.name in parts | {"none"}
        assert guard.loss in parts | {"none"} or name == "bearing"
    assert OUTLIER_METHODS["bearing"] == OUTLIER_METHODS["huber+bearing"]
    assert replace(OUTLIER_METHODS["bearing"], bearings=False) == OUTLIER_METHODS["huber"]
