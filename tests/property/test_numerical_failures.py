"""Episodes outlive what no solver has the digits for, and a user's own settings of numpy."""

import numpy as np
import pytest
from support.graphs import random_graph

from envs.rendezvous_v0 import parallel_env
from wifipgo.graph.distributed import solve_distributed
from wifipgo.graph.outliers.aoa_weights import likelihood, range_aware_weights


@pytest.mark.parametrize("estimator", ["at_rendezvous", "every_step"])
def test_bearings_of_robots_that_stand_together(estimator: str) -> None:
    """Noise of 2 m puts estimates on one place, where gtsam's bearings have no digits left."""
    for seed in range(2):
        env = parallel_env(
            "paper-hw-2",
            n_robots=3,
            n_slots=2,
            size_m=6.0,
            kappa=2,
            n_steps=12,
            sigma_t_m=2.0,
            outliers="bearing",
            third_party="ignore",
            estimator=estimator,
        )
        env.reset(seed=seed)
        rng = np.random.default_rng(seed)
        while env.agents:
            env.step({agent: np.array([*rng.uniform(-0.3, 0.3, 2), 1.0]) for agent in env.agents})
            assert np.isfinite(env.tick.belief.paths.estimate).all()
            assert np.isfinite(env.tick.belief.paths.covariance).all()


def test_underflow_stays_harmless() -> None:
    with np.errstate(all="raise"):
        assert likelihood(np.array([3.0]), sigma_rad=0.01)[0] == 0.0
        z, far = np.array([[5.0, 0.0, 0.0]]), np.array([3.0])
        assert range_aware_weights(z, np.array([1e-3]), far, sigma_rad=0.01)[0] == 0.0


@pytest.mark.parametrize("faint", [1e-20, 1e-200, 1e-320])
@pytest.mark.parametrize("dims", [2, 3])
def test_robots_end_where_information_differs_beyond_all_digits(dims: int, faint: float) -> None:
    """One measurement outweighs the others by more than floats have digits: found, or "not converged"."""
    _, graph = random_graph(1, dims={2: 3, 3: 7}[dims])
    weight = np.full(len(graph.tail), faint)
    weight[::3] = 1.0
    graph = graph.with_weight(weight)
    with np.errstate(all="ignore"):
        poses, report = solve_distributed(graph)
    assert np.isfinite(poses).all()
    assert report.converged in {True, False}
