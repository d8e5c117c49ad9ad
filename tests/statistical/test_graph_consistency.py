"""A correctly modelled graph has the residuals and errors that theory says (paper Eq. 3)."""

from typing import NamedTuple

import numpy as np
import pytest
from scipy import stats

from wifipgo import se2
from wifipgo.graph import last_pose_covariances
from wifipgo.graph.edges import Edges, refresh_reported
from wifipgo.graph.metrics import ate_trans, residual_error
from wifipgo.graph.solvers import Report, solve_team

SIGMA, N_TIMES, N_TRIALS, FIRST_SEED = (0.05, 0.02), 8, 200, 1_000_000


class Trial(NamedTuple):
    """Two robots that meet at half of their steps."""

    truth: np.ndarray
    start: np.ndarray
    solved: np.ndarray
    edges: Edges
    report: Report


def trial(rng: np.random.Generator) -> Trial:
    """Draw a world and its measurements, dead-reckon, solve."""
    own = [((r, t), (r, t + 1)) for r in range(2) for t in range(N_TIMES - 1)]
    met = [((t // 2 % 2, t), (1 - t // 2 % 2, t)) for t in range(1, N_TIMES, 2)] + [((0, 7), (0, 2))]
    tail, head = np.array(own + met).transpose(1, 0, 2)
    truth = rng.uniform(-1.0, 1.0, (2, N_TIMES, 3))
    z = se2.between(truth[tail[:, 0], tail[:, 1]], truth[head[:, 0], head[:, 1]])
    z = z + rng.normal(size=z.shape) * [SIGMA[0], SIGMA[0], SIGMA[1]]
    start = truth.copy()
    for t in range(N_TIMES - 1):
        start[:, t + 1] = se2.compose(start[:, t], z[: len(own)].reshape(2, -1, 3)[:, t])
    edges = Edges.measured(
        tail=tail, head=head, z=z, sigma=SIGMA, reported_pose=start[head[:, 0], head[:, 1]]
    )
    solved, report = solve_team(start, edges)
    return Trial(truth, start, solved, refresh_reported(edges, solved, robots=[0, 1]), report)


@pytest.fixture(scope="module")
def trials() -> list[Trial]:
    return [trial(np.random.default_rng(FIRST_SEED + k)) for k in range(N_TRIALS)]


def freedom(edges: Edges) -> int:
    """Degrees of freedom of the team's graph: three an edge, less three a pose but the two first."""
    return 3 * len(edges) - 3 * 2 * (N_TIMES - 1)


def test_chi_square_is_in_its_band(trials: list[Trial]) -> None:
    """The sum over trials lies in the 95 % band of its chi-square law."""
    total = sum(t.report.chi2_after for t in trials)
    low, high = stats.chi2.interval(0.95, sum(freedom(t.edges) for t in trials))
    assert low < total < high


def test_chi_square_has_the_right_law(trials: list[Trial]) -> None:
    """Not only its sum: the p-values of single trials are uniform."""
    p = [stats.chi2.sf(t.report.chi2_after, freedom(t.edges)) for t in trials]
    assert stats.kstest(p, "uniform").pvalue > 0.05


def test_nees_of_last_poses_is_in_its_band(trials: list[Trial]) -> None:
    """Squared errors over their covariance, one robot a trial, sum up to a chi-square of 3 a trial."""
    total = 0.0
    for k, t in enumerate(trials):
        robot = k % 2
        off = t.solved[robot, -1] - t.truth[robot, -1]
        off[2] = se2.wrap_angle(off[2:])[0]
        covariance = last_pose_covariances(t.solved, t.edges, robots=[0, 1])[robot]
        total += float(off @ np.linalg.solve(covariance, off))
    low, high = stats.chi2.interval(0.95, 3 * len(trials))
    assert low < total < high


def test_err_by_information_agrees_with_the_solver(trials: list[Trial]) -> None:
    """Eq. 4 over 1 / sigma, summed over robots before the division, is the solver's chi-square.

    They differ in rotation only: 2 (1 - cos d) there, d^2 here, so by d^2 / 12 of it.
    """
    for _, _, solved, edges, report in trials:
        counted = np.bincount(edges.tail[:, 0])
        robots = np.maximum(3 * (counted - (N_TIMES - 1)), 1)
        chi2 = float((residual_error(solved, edges, weights="information") * robots).sum())
        np.testing.assert_allclose(chi2, report.chi2_after, rtol=1e-3)


def test_optimising_beats_dead_reckoning(trials: list[Trial]) -> None:
    """The 95 % interval of the mean paired gain in Eq. 12 is above zero."""
    gain = np.array(
        [ate_trans(start, truth) - ate_trans(solved, truth) for truth, start, solved, *_ in trials]
    )
    mean, error = gain.mean(), gain.mean(axis=1).std(ddof=1) / np.sqrt(len(gain))
    assert mean - 1.96 * error > 0.0
