"""Two robots drive, drift, see each other three times, and solve their graph together.

Run: python examples/02_solve_a_pose_graph.py
"""

import numpy as np

from wifipgo import Edges, ate_trans, residual_error, se2, solve
from wifipgo.graph import extended

rng, n_times, sigma = np.random.default_rng(1), 30, (0.1, 0.05)


def noisy(z: np.ndarray) -> np.ndarray:
    """Measure relative poses with the noise that `sigma` states."""
    return z + rng.standard_normal(z.shape) * [sigma[0], sigma[0], sigma[1]]


# True trajectories: two arcs that come close in the end.
turn = np.array([[0.5, 0.0, 0.08], [0.5, 0.0, -0.08]])
truth = [np.array([[0.0, 0.0, 0.0], [0.0, 6.0, 0.0]])]
for _ in range(n_times - 1):
    truth.append(se2.compose(truth[-1], turn))
poses = np.stack(truth, axis=1)

# Odometry, and what the robots believe from it alone.
step = noisy(se2.between(poses[:, :-1], poses[:, 1:]))
estimate = [poses[:, 0]]
for k in range(n_times - 1):
    estimate.append(se2.compose(estimate[-1], step[:, k]))
belief = np.stack(estimate, axis=1)
robot, index = (a.ravel() for a in np.meshgrid([0, 1], np.arange(n_times - 1), indexing="ij"))
odometry = Edges.measured(
    tail=np.stack([robot, index], 1), head=np.stack([robot, index + 1], 1), z=step.reshape(-1, 3), sigma=sigma
)

# Robot 0 sees robot 1 in the last three iterations.
times = np.arange(n_times - 3, n_times)
sightings = Edges.measured(
    tail=np.stack([np.zeros(3, int), times], 1),
    head=np.stack([np.ones(3, int), times], 1),
    z=noisy(se2.between(poses[0, times], poses[1, times])),
    sigma=sigma,
    reported_pose=belief[1, times],
)
edges = extended(odometry, sightings)
solved, report = solve(belief, edges, robots=[0, 1])
print("Err (Eq. 4) before:", residual_error(belief, edges).round(2))
print("ATE (Eq. 12) before:", ate_trans(belief, poses).round(3), "after:", ate_trans(solved, poses).round(3))
print(f"{report.n_used} measurements, chi-square {report.chi2_before:.1f} -> {report.chi2_after:.1f}")
