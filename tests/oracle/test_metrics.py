"""Errors and weights against their closed forms (paper Eqs. 4, 7 to 9, 11 to 13)."""

from dataclasses import replace

import numpy as np
import pytest

from wifipgo import se2
from wifipgo.errors import UnknownNameError
from wifipgo.graph.edges import Edges, extended, refresh_reported, select
from wifipgo.graph.metrics import Judged, ate_rot, ate_trans, residual_error
from wifipgo.graph.outliers.aoa_weights import bearing, elevation, likelihood, paper_weights


def rotation(yaw_rad: float) -> np.ndarray:
    return np.array([[np.cos(yaw_rad), -np.sin(yaw_rad)], [np.sin(yaw_rad), np.cos(yaw_rad)]])


def random_graph(rng: np.random.Generator, n: int = 40) -> tuple[np.ndarray, Edges]:
    """Three robots, five poses, edges of any kind that disagree with the poses."""
    poses = rng.uniform(-3.0, 3.0, (3, 5, 3))
    ends = np.stack([rng.integers(0, 3, (2, n)), rng.integers(0, 5, (2, n))], axis=-1)
    z, told = rng.uniform(-3.0, 3.0, (2, n, 3))
    weight, sigma = rng.uniform(0.0, 1.0, n), rng.uniform(0.1, 1.0, (n, 2))
    return poses, Edges.measured(
        tail=ends[0], head=ends[1], z=z, sigma=sigma, weight=weight, reported_pose=told
    )


@pytest.mark.parametrize("weights", ["unit", "information"])
def test_err_is_eq_4_with_matrices(weights: str) -> None:
    """Eq. 4 written out edge by edge with 2 x 2 matrices and their Frobenius norm."""
    poses, edges = random_graph(np.random.default_rng(0))
    err, counted = np.zeros(3), np.zeros(3)
    for k in range(len(edges)):
        i, j = edges.tail[k], edges.head[k]
        T_i, T_j = poses[*i], poses[*j] if i[0] == j[0] else edges.reported_pose[k]
        off = T_j[:2] - T_i[:2] - rotation(T_i[2]) @ edges.z[k, :2]
        turn = rotation(T_j[2]) - rotation(T_i[2]) @ rotation(edges.z[k, 2])
        omega = 1.0 / edges.sigma[k] if weights == "information" else np.ones(2)
        term = omega[0] ** 2 * off @ off + omega[1] ** 2 / 2.0 * np.linalg.norm(turn, "fro") ** 2
        err[i[0]] += edges.weight[k] * term
        counted[i[0]] += 1
    freedom = np.maximum(3 * counted - 3 * 4, 1.0) if weights == "information" else 1.0
    np.testing.assert_allclose(residual_error(poses, edges, weights=weights), err / freedom, rtol=1e-12)


@pytest.mark.parametrize("weights", ["unit", "information"])
def test_err_brought_up_to_date_is_err_to_the_bit(monkeypatch: pytest.MonkeyPatch, weights: str) -> None:
    """Whose poses moved, who was told otherwise, and what came."""
    monkeypatch.setattr("wifipgo.graph.metrics._MANY", 1)
    poses, edges = random_graph(np.random.default_rng(3), n=60)
    old = select(edges, np.arange(50))
    before = Judged(residual_error(poses, old, weights=weights), poses, old)
    told, moved = edges.reported_pose.copy(), poses.copy()
    told[np.flatnonzero(edges.tail[:, 0] == 1)[:9]] += 0.1
    moved[2, 1] += 0.1
    for now in (poses, moved):
        for reported in (edges.reported_pose, told):
            changed = replace(edges, reported_pose=reported)
            expected = residual_error(now, changed, weights=weights)
            found = residual_error(now, changed, weights=weights, before=before)
            np.testing.assert_array_equal(found, expected)


def test_unknown_weights_list_the_known() -> None:
    poses, edges = random_graph(np.random.default_rng(0))
    with pytest.raises(UnknownNameError, match="information, unit"):
        residual_error(poses, edges, weights="units")


def test_an_empty_graph_has_no_error() -> None:
    np.testing.assert_array_equal(residual_error(np.zeros((2, 3, 3)), Edges.empty()), [0.0, 0.0])


def test_ate_of_a_shift_and_a_turn() -> None:
    """A robot that is off by (3, 4) m and d rad everywhere has 25 m^2 and 4 (1 - cos d)."""
    reference = np.random.default_rng(1).uniform(-3.0, 3.0, (2, 7, 3))
    estimate = reference.copy()
    estimate[1] += [3.0, 4.0, 0.7]
    np.testing.assert_allclose(ate_trans(estimate, reference), [0.0, 25.0], atol=1e-12)
    np.testing.assert_allclose(ate_rot(estimate, reference), [0.0, 4.0 * (1.0 - np.cos(0.7))], atol=1e-12)


def test_ate_rot_is_eq_13_with_matrices() -> None:
    estimate, reference = np.random.default_rng(2).uniform(-3.0, 3.0, (2, 1, 6, 3))
    norms = [
        np.linalg.norm(rotation(a).T @ rotation(b) - np.eye(2), "fro") ** 2
        for a, b in zip(estimate[0, :, 2], reference[0, :, 2], strict=True)
    ]
    np.testing.assert_allclose(ate_rot(estimate, reference), [np.mean(norms)], rtol=1e-12)


@pytest.mark.parametrize("azimuth_deg", [-180.0, -91.0, 0.0, 45.0, 170.0])
def test_bearing_and_elevation_of_a_known_direction(azimuth_deg: float) -> None:
    azimuth, up = np.deg2rad(azimuth_deg), np.deg2rad(30.0)
    offset = 5.0 * np.array([[np.cos(up) * np.cos(azimuth), np.cos(up) * np.sin(azimuth), np.sin(up)]])
    np.testing.assert_allclose(se2.wrap_angle(bearing(offset) - azimuth), 0.0, atol=1e-12)
    np.testing.assert_allclose(elevation(offset), up, rtol=1e-12)


def test_likelihood_is_one_up_to_the_papers_gate() -> None:
    """In radians and with sigma = 2.96 deg, g leaves 1 at 7.2 deg: Sec. 7.3's gate."""
    inside, knee, beyond = np.deg2rad([[0.0, 3.0, 7.2], [7.20, 7.205, 7.21], [7.22, 8.0, 20.0]])
    np.testing.assert_array_equal(likelihood(inside), 1.0)
    assert (likelihood(beyond) < 1.0).all()
    sigma = np.deg2rad(2.96)
    np.testing.assert_allclose(sigma * np.sqrt(2.0 * np.log(1.0 / sigma)), knee[1], rtol=2e-4)


def test_likelihood_is_the_clipped_density() -> None:
    off, sigma = np.linspace(-1.0, 1.0, 21), 0.2
    density = np.exp(-(off**2) / (2.0 * sigma**2)) / (sigma * np.sqrt(2.0 * np.pi))
    expected = np.minimum(1.0, np.sqrt(2.0 * np.pi) * density)
    np.testing.assert_allclose(likelihood(off, sigma_rad=sigma), expected, rtol=1e-12)


def test_paper_weights_only_beyond_the_gate_and_across_the_cut() -> None:
    reported = np.deg2rad([10.0, 179.0, 179.0])
    peak = np.deg2rad([15.0, -178.0, -172.0])  # 5, 3 and 9 deg apart
    weight = paper_weights(reported, peak, sigma_rad=0.5, gate_rad=float(np.deg2rad(4.0)))
    np.testing.assert_allclose(weight[:2], 1.0)
    sharp = paper_weights(reported, peak)
    np.testing.assert_allclose(sharp, [1.0, 1.0, likelihood(np.deg2rad([9.0]))[0]], rtol=1e-9)
    gated = paper_weights(reported, peak, sigma_rad=0.05, gate_rad=1.0)
    np.testing.assert_array_equal(gated, 1.0)


def test_extended_select_and_retold_keep_rows_together() -> None:
    poses, edges = random_graph(np.random.default_rng(3))
    first, last = np.arange(len(edges)) < 15, np.arange(15, len(edges))
    again = extended(select(edges, first), select(edges, last))
    for field in ("tail", "head", "z", "sigma", "weight", "reported_pose"):
        np.testing.assert_array_equal(getattr(again, field), getattr(edges, field))
    told = refresh_reported(edges, poses, robots=[0, 2])
    among = np.isin(edges.tail[:, 0], [0, 2]) & np.isin(edges.head[:, 0], [0, 2])
    np.testing.assert_array_equal(
        told.reported_pose[among], poses[edges.head[among, 0], edges.head[among, 1]]
    )
    np.testing.assert_array_equal(told.reported_pose[~among], edges.reported_pose[~among])
    assert len(extended(Edges.empty(), edges)) == len(edges)


@pytest.mark.parametrize(
    ("field", "change"),
    [
        ("sigma", {"sigma": (0.0, 1.0)}),
        ("weight", {"weight": 1.5}),
        ("reported_pose", {"reported_pose": None}),
    ],
)
def test_measured_refuses_what_cannot_be(field: str, change: dict[str, object]) -> None:
    good = {"sigma": (1.0, 1.0), "weight": 1.0, "reported_pose": np.zeros((1, 3))}
    ends = {"tail": np.array([[0, 0]]), "head": np.array([[1, 0]]), "z": np.zeros((1, 3))}
    with pytest.raises(ValueError, match=f"Edges.{field} must be"):
        Edges.measured(**ends, **(good | change))  # type: ignore[arg-type]
