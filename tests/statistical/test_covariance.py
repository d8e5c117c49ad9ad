"""Covariances of dead reckoning against the spread of many simulated robots, and in the loop."""

import numpy as np
import pytest
from jaxtyping import Float
from property.test_loop import episode

from wifipgo import se2
from wifipgo.graph.covariance import (
    covariance_after_closure,
    propagate_backwards,
    propagate_covariance,
    spread_m,
)
from wifipgo.scenarios import scenario_named

N_RUNS = 20_000
SIGMA = np.array([[0.05, 0.02]])
END = np.array([[0.01, 0.002, 0.001], [0.002, 0.02, 0.003], [0.001, 0.003, 0.004]])


def path() -> Float[np.ndarray, "1 8 3"]:
    rng = np.random.default_rng(5)
    p_m = np.cumsum(rng.normal(size=(8, 2)), axis=0)
    return np.concatenate([p_m, rng.uniform(-3.0, 3.0, (8, 1))], axis=1)[None]


def noise(rng: np.random.Generator) -> Float[np.ndarray, "runs 3"]:
    return rng.standard_normal((N_RUNS, 3)) * SIGMA[0, [0, 0, 1]]


def spread(found: np.ndarray, truth: np.ndarray) -> Float[np.ndarray, "3 3"]:
    off = found - truth
    off[:, 2] = se2.wrap_angle(off[:, 2])
    return np.cov(off.T)


def agree(sample: np.ndarray, covariance: np.ndarray) -> None:
    """Within 8 % of the scale of each entry: five standard errors of a sample of this size."""
    scale = np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    assert (np.abs(sample - covariance) <= 0.08 * scale).all()


def test_forwards_from_a_known_start() -> None:
    truth, rng = path(), np.random.default_rng(0)
    now, covariance = np.repeat(truth[0, :1], N_RUNS, axis=0), np.zeros((1, 3, 3))
    for k in range(7):
        z = se2.between(truth[:, k], truth[:, k + 1])
        now = se2.compose(now, z + noise(rng))
        covariance = propagate_covariance(covariance, truth[:, k], truth[:, k + 1], SIGMA)
    agree(spread(now, truth[0, -1]), covariance[0])


def test_backwards_from_an_end_that_is_known_so_and_so() -> None:
    truth, rng = path(), np.random.default_rng(1)
    covariance = propagate_backwards(END[None], truth[..., :2], SIGMA)
    np.testing.assert_allclose(covariance[0, -1], END, atol=1e-12)
    then = truth[0, -1] + rng.multivariate_normal(np.zeros(3), END, N_RUNS)
    for k in range(6, -1, -1):
        z = se2.between(truth[:, k], truth[:, k + 1])
        then = se2.compose(then, se2.inverse(z + noise(rng)))
        agree(spread(then, truth[0, k]), covariance[0, k])


def test_from_a_place_that_was_measured() -> None:
    truth, rng = path(), np.random.default_rng(2)
    place, here = truth[0, 1], truth[0, 4]
    known = place + rng.multivariate_normal(np.zeros(3), END, N_RUNS)
    found = se2.compose(known, se2.inverse(se2.between(here[None], place[None]) + noise(rng)))
    covariance = covariance_after_closure(END[None], (here - place)[None, :2], SIGMA)
    agree(spread(found, here), covariance[0])


@pytest.mark.parametrize("meets", [False, True])
def test_in_the_loop_robots_know_how_lost_they_are(meets: bool) -> None:
    """Over many robots the squared error over its variance is near 1; a meeting may be a little modest."""
    kappa = {} if meets else {"kappa": 1000}
    scenario = scenario_named("paper-sim-2", size_m=7.0, **kappa)
    ratios = []
    for seed in range(10):
        last = episode(scenario, seed, n_steps=16)[-1]
        off_m2 = ((last.belief.paths.estimate - last.truth.poses)[:, -1, :2] ** 2).sum(axis=-1)
        ratios += (off_m2 / spread_m(last.belief.paths.covariance) ** 2).tolist()
    assert 0.4 <= float(np.mean(ratios)) <= 2.0
