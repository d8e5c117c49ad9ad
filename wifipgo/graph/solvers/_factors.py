"""Measurements in the plane as gtsam factors. Variables are integers: rows of the participants' poses."""

from typing import Any

import gtsam
import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo import se2
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.edges import Edges
from wifipgo.graph.solvers._losses import geman_mcclure, huber
from wifipgo.graph.solvers._near_bearings import near_bearing

Models = dict[tuple[Any, ...], gtsam.noiseModel.Base]


def keys(ends: Int[np.ndarray, "rows 2"], first_key: Int[np.ndarray, " robots"]) -> list[int]:
    """Variables of some (robot, index) pairs."""
    found: list[int] = (first_key[ends[:, 0]] + ends[:, 1]).tolist()
    return found


def add_anchors(
    graph: gtsam.NonlinearFactorGraph,
    start: Float[np.ndarray, "poses 3"],
    known: Int[np.ndarray, " known"],
    sigma: Float[np.ndarray, "known 2"],
) -> None:
    """Hold poses that are known where they are, as firmly as they are known."""
    for key, (sigma_t_m, sigma_r_rad) in zip(known.tolist(), sigma.tolist(), strict=True):
        noise = gtsam.noiseModel.Diagonal.Sigmas(np.array([sigma_t_m, sigma_t_m, sigma_r_rad]))
        graph.addPriorPose2(key, gtsam.Pose2(*start[key].tolist()), noise)


def between_factors(
    edges: Edges,
    first_key: Int[np.ndarray, " robots"],
    doubted: Bool[np.ndarray, " edges"],
    models: Models | None = None,
) -> list[gtsam.NonlinearFactor]:
    """Measurements among participants, Huber's loss on doubted ones; equal noise shares one model.

    Noise models that are there already are used again, and new ones added to them.
    """
    models = {} if models is None else models
    factors: list[gtsam.NonlinearFactor] = []
    sigma = edges.sigma / np.sqrt(edges.weight)[:, None]
    noises = zip(*sigma.T.tolist(), doubted.tolist(), strict=True)
    ends = zip(keys(edges.tail, first_key), keys(edges.head, first_key), edges.z.tolist(), strict=True)
    for (i, j, z), noise in zip(ends, noises, strict=True):
        if noise not in models:
            sigma_t_m, sigma_r_rad, doubt = noise
            model = gtsam.noiseModel.Diagonal.Sigmas(np.array([sigma_t_m, sigma_t_m, sigma_r_rad]))
            models[noise] = huber(model) if doubt else model
        factors.append(gtsam.BetweenFactorPose2(i, j, gtsam.Pose2(*z), models[noise]))
    return factors


def told_factors(
    edges: Edges,
    told_sigma: Float[np.ndarray, "#edges 2"],
    first_key: Int[np.ndarray, " robots"],
    *,
    doubted: bool,
) -> list[gtsam.NonlinearFactor]:
    """Ties of tails to what outsiders told."""
    T_world_tail, variance, lever_m = told_tails(edges, told_sigma)
    lever = np.column_stack([lever_m, np.ones(len(edges))])
    turn = variance[:, 1, None, None] * lever[:, :, None] * lever[:, None, :]
    covariance = turn + variance[:, 0, None, None] * np.diag([1.0, 1.0, 0.0])
    noises = [gtsam.noiseModel.Gaussian.Covariance(cov) for cov in covariance]
    rows = zip(keys(edges.tail, first_key), T_world_tail.tolist(), noises, strict=True)
    return [
        gtsam.PriorFactorPose2(i, gtsam.Pose2(*pose), huber(noise) if doubted else noise)
        for i, pose, noise in rows
    ]


def add(graph: gtsam.NonlinearFactorGraph, factors: list[gtsam.NonlinearFactor]) -> None:
    """Add factors one by one."""
    for factor in factors:
        graph.add(factor)


def told_tails(
    edges: Edges, told_sigma: Float[np.ndarray, "#edges 2"]
) -> tuple[Float[np.ndarray, "edges 3"], Float[np.ndarray, "edges 2"], Float[np.ndarray, "edges 2"]]:
    """Where tails are by what outsiders told: T_world_tail = T_world_head T_tail_head^-1.

    Noise of z and of the told pose both sit at the head. Seen from the tail, a turn
    there is a turn here and a shift along (y, -x) of z, which is exact to first order
    and needs no further variable.

    Returns:
        Poses; variances of position, m^2 on each axis, and heading, rad^2; and the shift in axes of the
        tail, m, that comes with an error of one rad of the heading.
    """
    variance = edges.sigma**2 / edges.weight[:, None] + told_sigma**2
    shift = se2.adjoint(edges.z)[:, :2, 2]
    T_world_tail = edges.reported_pose.copy()
    T_world_tail[:, 2] = se2.wrap_angle(edges.reported_pose[:, 2] - edges.z[:, 2])
    T_world_tail[:, :2] -= se2.rotate(T_world_tail[:, 2], edges.z[:, :2])
    return T_world_tail, variance, shift


def add_bearings(
    graph: gtsam.NonlinearFactorGraph,
    bearings: Bearings,
    first_key: Int[np.ndarray, " robots"],
    *,
    near: bool = False,
) -> None:
    """Add the highest peak of each profile as a bearing with Geman-McClure's loss.

    Those to be searched ``near`` zero range have a bounded slope there, and take longer.
    """
    models = {sigma: geman_mcclure(sigma) for sigma in set(bearings.sigma_rad.tolist())}
    ends = zip(keys(bearings.observer, first_key), keys(bearings.target, first_key), strict=True)
    peaks = zip(bearings.azimuth_rad[:, 0].tolist(), bearings.sigma_rad.tolist(), strict=True)
    for (i, j), (azimuth_rad, sigma) in zip(ends, peaks, strict=True):
        graph.add(
            near_bearing(i, j, azimuth_rad, models[sigma])
            if near
            else gtsam.BearingFactorPose2(i, j, gtsam.Rot2(azimuth_rad), models[sigma])
        )
