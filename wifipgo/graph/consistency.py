"""Pairwise consistent measurements (PCM): the largest set between two robots that agrees with itself.

Mangelson, Dominic, Eustice, Vasudevan: *Pairwise Consistent Measurement Set Maximization for
Robust Multi-Robot Map Merging*, ICRA 2018. Two measurements and the odometry between them close a
loop; they are consistent if the loop's error is likely under its covariance.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.special import chdtri

from wifipgo import se2
from wifipgo.arithmetic import harmless_underflow
from wifipgo.graph.edges import Edges, select
from wifipgo.graph.outliers.cliques import largest_clique

CONFIDENCE = 0.99  # share of pairs of good measurements that pass
_GAP_SIGMA = 1e3  # m and rad, of a step without odometry: nothing is inconsistent across it
_QUARTER_TURN = np.array([[0.0, -1.0], [1.0, 0.0]])


@harmless_underflow
def consistent(edges: Edges, *, n_robots: int, confidence: float = CONFIDENCE) -> Bool[np.ndarray, " edges"]:
    """Which measurements to keep: for each pair of robots, a largest set that is pairwise consistent.

    Measurements within one robot are kept. Weights are not looked at. Of several largest sets it
    takes one that does not depend on the order of the measurements. Where a pair has so many
    that an exact search would take long, the set is a large one that a bounded search found, see
    `wifipgo.graph.outliers.cliques`.
    """
    keep = ~edges.between_robots
    pairs = np.sort(np.stack([edges.tail[:, 0], edges.head[:, 0]], axis=1), axis=1)
    chains = _chains(edges, n_robots)
    for pair in np.unique(pairs[~keep], axis=0):
        rows = np.flatnonzero((pairs == pair).all(axis=1))
        rows = rows[np.lexsort((*edges.z[rows].T, *edges.head[rows].T, *edges.tail[rows].T))]
        agree = loop_chi2(select(edges, rows), chains, pair) <= chdtri(3, 1.0 - confidence)
        keep[rows[largest_clique(agree & agree.T).members]] = True
    return keep


class Chains(NamedTuple):
    """Odometry of each robot: where it leads, and the sums over its noise up to each pose.

    Attributes:
        poses: Of the robot in the frame of its first.
        shift: Sum of the variances of the steps' positions, m^2.
        turn: Sum of the variances of the steps' yaw; each acts at the end of its step.
        first: The same sum weighted by where it acts.
        second: The same sum weighted by the outer product of where it acts.
    """

    poses: Float[np.ndarray, "robots times 3"]
    shift: Float[np.ndarray, "robots times"]
    turn: Float[np.ndarray, "robots times"]
    first: Float[np.ndarray, "robots times 2"]
    second: Float[np.ndarray, "robots times 2 2"]


def _chains(edges: Edges, n_robots: int) -> Chains:
    """Chain the odometry; a missing step leads nowhere and is as good as unknown."""
    times = 1 + int(max(edges.tail[:, 1].max(initial=0), edges.head[:, 1].max(initial=0)))
    step = np.flatnonzero(~edges.between_robots & (edges.head[:, 1] == edges.tail[:, 1] + 1))
    robot, index = edges.head[step].T
    z, sigma = np.zeros((n_robots, times, 3)), np.full((n_robots, times, 2), _GAP_SIGMA)
    z[robot, index], sigma[robot, index] = edges.z[step], edges.sigma[step]
    sigma[:, 0] = 0.0
    poses = np.zeros_like(z)
    for t in range(1, times):
        poses[:, t] = se2.compose(poses[:, t - 1], z[:, t])
    p_m, turn = poses[..., :2], sigma[..., 1] ** 2
    first = turn[..., None] * p_m
    second = first[..., None] * p_m[..., None, :]
    sums = (np.cumsum(x, axis=1) for x in (sigma[..., 0] ** 2, turn, first, second))
    return Chains(poses, *sums)


def loop_chi2(edges: Edges, chains: Chains, pair: Int[np.ndarray, "2"]) -> Float[np.ndarray, "edges edges"]:
    """Squared Mahalanobis error of the loop through each two measurements between robots a and b.

    Measurement k and the odometry of both robots say where b was at the time of l, and so does l.
    To first order, noise in yaw turns all that comes after about the place where it acts,
    which is the head of its measurement; noise in position is the same in every direction.
    """
    a, b = pair.tolist()
    forth = edges.tail[:, 0] == a
    t_a, t_b = np.where(forth, (edges.tail[:, 1], edges.head[:, 1]), (edges.head[:, 1], edges.tail[:, 1]))
    z = np.where(forth[:, None], edges.z, se2.inverse(edges.z))
    in_a = se2.compose(chains.poses[a, t_a], z)  # where each measurement puts b
    in_b = chains.poses[b, t_b]
    acts = np.where(forth[:, None], in_a, chains.poses[a, t_a])[:, :2]
    variance = edges.sigma**2
    chi2 = np.empty((len(edges), len(edges)))
    for k in range(len(edges)):
        expected = se2.compose(in_a[k : k + 1], se2.between(in_b[k : k + 1], in_b))
        off = in_a - expected
        off[:, 2] = se2.wrap_angle(off[:, 2])
        own = _acting(variance[k : k + 1], acts[k : k + 1], expected) + _acting(variance, acts, expected)
        along_a = _between(chains, a, int(t_a[k]), t_a, expected[:, :2])
        along_b = _between(chains, b, int(t_b[k]), t_b, in_b[:, :2])
        covariance = own + along_a + _turned(along_b, in_a[k, 2] - in_b[k, 2])
        chi2[k] = (off * np.linalg.solve(covariance, off[..., None])[..., 0]).sum(axis=-1)
        chi2[k, k] = 0.0
    return chi2


def _acting(
    variance: Float[np.ndarray, "#edges 2"],
    acts_m: Float[np.ndarray, "#edges 2"],
    end: Float[np.ndarray, "edges 3"],
) -> Float[np.ndarray, "edges 3 3"]:
    """Covariance at ``end`` of noise that acts at one place."""
    lever = end[:, :2] - acts_m
    shift, turn = np.broadcast_to(variance, (len(end), 2)).T
    outer = turn[:, None, None] * lever[..., None] * lever[:, None, :]
    return _covariance(shift, turn, turn[:, None] * lever, outer)


def _between(
    chains: Chains, robot: int, t: int, times: Int[np.ndarray, " edges"], end_m: Float[np.ndarray, "edges 2"]
) -> Float[np.ndarray, "edges 3 3"]:
    """Covariance at ``end_m`` of a robot's odometry between two times, in the frame of its first pose."""
    sums = (np.asarray(x[robot, times] - x[robot, t]) for x in chains[1:])
    sign = np.where(times >= t, 1.0, -1.0)
    shift, turn, first, second = (sign.reshape(-1, *[1] * (x.ndim - 1)) * x for x in sums)
    cross = first[..., None] * end_m[:, None, :]
    outer = turn[:, None, None] * end_m[..., None] * end_m[:, None, :] - cross - cross.swapaxes(1, 2) + second
    return _covariance(shift, turn, turn[:, None] * end_m - first, outer)


def _covariance(
    shift: Float[np.ndarray, " edges"],
    turn: Float[np.ndarray, " edges"],
    lever: Float[np.ndarray, "edges 2"],
    outer: Float[np.ndarray, "edges 2 2"],
) -> Float[np.ndarray, "edges 3 3"]:
    """Covariance of a pose from variances and the first two moments of the levers of the turns."""
    covariance = np.zeros((len(shift), 3, 3))
    covariance[:, :2, :2] = shift[:, None, None] * np.eye(2) + _QUARTER_TURN @ outer @ _QUARTER_TURN.T
    covariance[:, :2, 2] = covariance[:, 2, :2] = lever @ _QUARTER_TURN.T
    covariance[:, 2, 2] = turn
    return covariance


def _turned(covariance: Float[np.ndarray, "edges 3 3"], yaw_rad: float) -> Float[np.ndarray, "edges 3 3"]:
    """The same covariance seen in a frame that is turned against its own."""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return rotation @ covariance @ rotation.T
