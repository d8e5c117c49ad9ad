"""The chordal cost of a pose graph and the two linear problems that nearly minimise it.

    F = 1/2 sum_ij  w_turn |R_i Rbar_ij - R_j|_F^2 + w_shift |t_j - t_i - R_i tbar_ij|^2

First the rotations: as matrices without constraint they are the solution of a linear problem,
then projected. Then the poses: F at R_i exp(delta_i), t_i to first order in delta (Choudhary et
al., Distributed mapping with privacy and communication constraints, IJRR 2017, Secs. 4 and 5).
w_shift and w_turn are the mean information of translation and rotation, times the weight.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csc_array

from wifipgo import se2, se3
from wifipgo.arithmetic import harmless_underflow
from wifipgo.graph.factorised import factorised_sparse
from wifipgo.graph.posegraph import PoseGraph
from wifipgo.graph.subgraphs import held

# Tangent directions of rotations in the plane and in space: exp(sum_k a_k G_k).
GENERATORS = {2: np.array([[[0.0, -1.0], [1.0, 0.0]]]), 3: se3.cross_matrix(np.eye(3))}
MAX_STEPS, STEP_SIZE = 100, 1e-11  # Gauss-Newton on F: steps at most, and the largest change that ends it


class Poses(NamedTuple):
    """Rotation matrices and positions.

    Attributes:
        R: Rotations, body to world.
        t_m: Positions in the world, m.
    """

    R: Float[np.ndarray, "n d d"]
    t_m: Float[np.ndarray, "n d"]


class Links(NamedTuple):
    """Measurements as the chordal cost takes them.

    Attributes:
        tail: Row of the pose in whose frame the measurement is.
        head: Row of the measured pose.
        z: Measured rotation and position of the head in the frame of the tail.
        w_turn: Weight of the rotation, 1 / rad^2.
        w_shift: Weight of the position, 1 / m^2.
    """

    tail: Int[np.ndarray, " links"]
    head: Int[np.ndarray, " links"]
    z: Poses
    w_turn: Float[np.ndarray, " links"]
    w_shift: Float[np.ndarray, " links"]


class Normal(NamedTuple):
    """Blocks of the normal equations H x = g of one kind of problem, one set of four for each link.

    Attributes:
        tail_tail: Block of H at (tail, tail).
        head_head: Block of H at (head, head).
        tail_head: Block of H at (tail, head); its transpose is at (head, tail).
        g_tail: Part of g at the tail.
        g_head: Part of g at the head.
    """

    tail_tail: Float[np.ndarray, "links k k"]
    head_head: Float[np.ndarray, "links k k"]
    tail_head: Float[np.ndarray, "links k k"]
    g_tail: Float[np.ndarray, "links k c"]
    g_head: Float[np.ndarray, "links k c"]


def matrices(rows: Float[np.ndarray, "n dims"]) -> Poses:
    """Rotation matrices and positions of pose rows."""
    if rows.shape[1] == 7:
        return Poses(se3.rotation_matrix(rows[:, 3:]), rows[:, :3])
    return Poses(se2.rotation_matrix(rows[:, 2]), rows[:, :2])


def pose_rows(poses: Poses) -> Float[np.ndarray, "n dims"]:
    """Pose rows of rotation matrices and positions."""
    if poses.R.shape[-1] == 3:
        return np.concatenate([poses.t_m, se3.quaternion(poses.R)], axis=-1)
    yaw_rad = np.arctan2(poses.R[:, 1, 0], poses.R[:, 0, 0])
    return np.concatenate([poses.t_m, yaw_rad[:, None]], axis=-1)


def links(graph: PoseGraph) -> Links:
    """Measurements of positive weight."""
    used = graph.weight > 0.0
    z = matrices(graph.z[used])
    d = z.t_m.shape[1]
    precision = graph.weight[used, None] * np.diagonal(graph.information[used], axis1=1, axis2=2)
    w_turn, w_shift = precision[:, d:].mean(axis=1), precision[:, :d].mean(axis=1)
    return Links(graph.tail[used], graph.head[used], z, w_turn, w_shift)


def chosen(edges: Links, rows: Bool[np.ndarray, " links"]) -> Links:
    """Some of the measurements."""
    z = Poses(edges.z.R[rows], edges.z.t_m[rows])
    return Links(edges.tail[rows], edges.head[rows], z, edges.w_turn[rows], edges.w_shift[rows])


def nearest_rotations(M: Float[np.ndarray, "n d d"]) -> Float[np.ndarray, "n d d"]:
    """Rotation nearest to each matrix in the Frobenius norm."""
    U, _, Vt = np.linalg.svd(M)
    U[..., -1] *= np.linalg.det(U @ Vt)[:, None]
    return U @ Vt


@harmless_underflow
def chordal_cost(poses: Poses, edges: Links) -> float:
    """F of the module's first lines."""
    R_i, R_j = poses.R[edges.tail], poses.R[edges.head]
    turn = R_i @ edges.z.R - R_j
    off = poses.t_m[edges.head] - poses.t_m[edges.tail] - _times(R_i, edges.z.t_m)
    return 0.5 * float(edges.w_turn @ (turn**2).sum(axis=(1, 2)) + edges.w_shift @ (off**2).sum(axis=1))


def rotation_normal(edges: Links) -> Normal:
    """Normal equations for Y_i = R_i^T without constraint, from the terms |Rbar^T Y_i - Y_j|_F^2.

    The columns of Y do not touch each other, so d unknowns a pose with d right-hand sides do.
    """
    w = edges.w_turn[:, None, None]
    diagonal, none = w * np.eye(edges.z.R.shape[-1]), np.zeros_like(edges.z.R)
    return Normal(diagonal, diagonal, -w * edges.z.R, none, none)


def pose_normal(edges: Links, R: Float[np.ndarray, "n d d"]) -> Normal:
    """Normal equations for (delta_i, t_i) of F to first order at rotations ``R``."""
    d = R.shape[-1]
    R_i, R_j, G = R[edges.tail], R[edges.head], GENERATORS[d]
    turn_i = np.einsum("eab,kbc,ecd->eadk", R_i, G, edges.z.R).reshape(len(R_i), d * d, len(G))
    turn_j = -np.einsum("eab,kbc->eack", R_j, G).reshape(len(R_i), d * d, len(G))
    lever = -np.einsum("eab,kbc,ec->eak", R_i, G, edges.z.t_m)
    flat, one = np.zeros((len(R_i), d * d, d)), np.broadcast_to(np.eye(d), (len(R_i), d, d))
    J_i = np.concatenate([np.dstack([turn_i, flat]), np.dstack([lever, -one])], axis=1)
    J_j = np.concatenate([np.dstack([turn_j, flat]), np.dstack([np.zeros_like(lever), one])], axis=1)
    off = np.concatenate(
        [(R_i @ edges.z.R - R_j).reshape(len(R_i), d * d), -_times(R_i, edges.z.t_m)], axis=1
    )
    w = np.concatenate(
        [np.repeat(edges.w_turn[:, None], d * d, 1), np.repeat(edges.w_shift[:, None], d, 1)], axis=1
    )
    W_i, W_j = np.swapaxes(J_i * w[..., None], 1, 2), np.swapaxes(J_j * w[..., None], 1, 2)
    return Normal(W_i @ J_i, W_j @ J_j, W_i @ J_j, -W_i @ off[..., None], -W_j @ off[..., None])


def moved(R: Float[np.ndarray, "n d d"], x: Float[np.ndarray, "n k"]) -> Poses:
    """Poses of the unknowns of `pose_normal`: R exp(delta) and t."""
    d = R.shape[-1]
    delta = x[:, :-d]
    if d == 2:
        turn = se2.rotation_matrix(delta[:, 0])
    else:
        turn = se3.rotation_matrix(se3.exp(np.pad(delta, ((0, 0), (3, 0))))[:, 3:])
    return Poses(R @ turn, x[:, -d:])


@harmless_underflow
def two_stage(graph: PoseGraph, poses: Poses, fixed: Int[np.ndarray, " fixed"] | None = None) -> Poses:
    """Both linear problems, by a centre that knows all; ``fixed`` poses stay, see `held`."""
    edges, rows = links(graph), held(graph, fixed)
    Y = _solved(rotation_normal(edges), edges, np.swapaxes(poses.R, 1, 2), rows)
    return gauss_newton_step(edges, Poses(nearest_rotations(np.swapaxes(Y, 1, 2)), poses.t_m), rows)


@harmless_underflow
def chordal_optimum(graph: PoseGraph, poses: Poses, fixed: Int[np.ndarray, " fixed"] | None = None) -> Poses:
    """Least F, by Gauss-Newton from a start near it; ``fixed`` poses stay, see `held`."""
    edges, rows = links(graph), held(graph, fixed)
    for _ in range(MAX_STEPS):
        last, poses = poses, gauss_newton_step(edges, poses, rows)
        if max(np.abs(poses.R - last.R).max(), np.abs(poses.t_m - last.t_m).max()) < STEP_SIZE:
            break
    return poses


def gauss_newton_step(edges: Links, poses: Poses, fixed: Int[np.ndarray, " fixed"]) -> Poses:
    """Solve the second problem at the rotations of ``poses``; fixed poses stay."""
    delta = np.zeros((len(poses.R), len(GENERATORS[poses.R.shape[-1]])))
    x = np.concatenate([delta, poses.t_m], axis=1)[..., None]
    return moved(poses.R, _solved(pose_normal(edges, poses.R), edges, x, fixed)[..., 0])


def _solved(
    normal: Normal, edges: Links, x: Float[np.ndarray, "n k c"], fixed: Int[np.ndarray, " fixed"]
) -> Float[np.ndarray, "n k c"]:
    """Solve the normal equations for all but the fixed poses, which keep their values in ``x``."""
    n, k, c = x.shape
    free = np.setdiff1d(np.arange(n), fixed)
    if len(free) == 0:
        return x
    H, g = assembled(normal, edges, n)
    rows = (free[:, None] * k + np.arange(k)).ravel()
    held = x.copy()
    held[free] = 0.0
    rhs = (g - H @ held.reshape(-1, c))[rows]
    held[free] = factorised_sparse(H[rows][:, rows])(rhs).reshape(len(free), k, c)
    return held


def assembled(normal: Normal, edges: Links, n: int) -> tuple[csc_array, Float[np.ndarray, "rows c"]]:
    """H as a sparse matrix and g as columns, over n poses."""
    blocks = np.concatenate([*normal[:3], np.swapaxes(normal.tail_head, 1, 2)])
    rows = np.concatenate([edges.tail, edges.head, edges.tail, edges.head])
    columns = np.concatenate([edges.tail, edges.head, edges.head, edges.tail])
    k, c = normal.g_tail.shape[1:]
    H = block_matrix(blocks, rows, columns, (n, n))
    g = np.zeros((n, k, c))
    np.add.at(g, edges.tail, normal.g_tail)
    np.add.at(g, edges.head, normal.g_head)
    return H, g.reshape(n * k, c)


def block_matrix(
    blocks: Float[np.ndarray, "m k k"],
    rows: Int[np.ndarray, " m"],
    columns: Int[np.ndarray, " m"],
    shape: tuple[int, int],
) -> csc_array:
    """Sparse matrix of square blocks, of ``shape`` in blocks; blocks at one place add up."""
    k = blocks.shape[-1]
    at = np.arange(k)
    i = np.broadcast_to((rows[:, None] * k + at)[:, :, None], blocks.shape)
    j = np.broadcast_to((columns[:, None] * k + at)[:, None, :], blocks.shape)
    return csc_array((blocks.ravel(), (i.ravel(), j.ravel())), shape=(shape[0] * k, shape[1] * k))


def _times(R: Float[np.ndarray, "n d d"], v: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "n d"]:
    return np.einsum("eab,eb->ea", R, v)
