"""Measurements of graphs with any keys, in the plane or in space, as gtsam factors. Keys are rows."""

from types import MappingProxyType
from typing import Any

import gtsam
import numpy as np
from jaxtyping import Float, Int

from wifipgo import se3
from wifipgo.graph.posegraph import PoseGraph, normalised
from wifipgo.graph.solvers._losses import huber as as_huber
from wifipgo.graph.subgraphs import held

ANCHOR_SIGMA = 1e-6  # m and rad
ORDER = MappingProxyType({3: [0, 1, 2], 6: [3, 4, 5, 0, 1, 2]})  # in space gtsam puts rotation first


def factors_of(
    graph: PoseGraph,
    rows: Float[np.ndarray, "poses dims"],
    fixed: Int[np.ndarray, " fixed"] | None,
    *,
    huber: bool,
) -> tuple[gtsam.NonlinearFactorGraph, Int[np.ndarray, " used"]]:
    """Anchors, then one factor for each measurement that counts, and which those are."""
    factors, order = gtsam.NonlinearFactorGraph(), ORDER[graph.freedom]
    prior, between = (
        (gtsam.PriorFactorPose2, gtsam.BetweenFactorPose2)
        if graph.freedom == 3
        else (gtsam.PriorFactorPose3, gtsam.BetweenFactorPose3)
    )
    anchors = held(graph, fixed)
    rigid = gtsam.noiseModel.Isotropic.Sigma(graph.freedom, ANCHOR_SIGMA)
    for row, pose in zip(anchors.tolist(), _gtsam_poses(rows[anchors]), strict=True):
        factors.add(prior(row, pose, rigid))
    used = np.flatnonzero(graph.weight > 0.0)
    information = (graph.weight[used, None, None] * graph.information[used])[:, order][:, :, order]
    noise = _noise_models(information, huber & ~graph.odometry[used])
    ends = zip(graph.tail[used].tolist(), graph.head[used].tolist(), strict=True)
    for (i, j), z, model in zip(ends, _gtsam_poses(graph.z[used]), noise, strict=True):
        factors.add(between(i, j, z, model))
    return factors, used


def _noise_models(
    information: Float[np.ndarray, "used freedom freedom"], huber: np.ndarray
) -> list[gtsam.noiseModel.Base]:
    """One model for each matrix; equal ones share it."""
    models: dict[tuple[bytes, bool], gtsam.noiseModel.Base] = {}
    out = []
    for matrix, robust in zip(information, huber.tolist(), strict=True):
        key = (matrix.tobytes(), robust)
        if key not in models:
            plain = gtsam.noiseModel.Gaussian.Information(matrix)
            models[key] = as_huber(plain) if robust else plain
        out.append(models[key])
    return out


def _gtsam_poses(rows: Float[np.ndarray, "n dims"]) -> list[Any]:
    if rows.shape[1] == 3:
        return [gtsam.Pose2(*row) for row in rows.tolist()]
    quaternions = rows[:, [6, 3, 4, 5]].tolist()
    return [gtsam.Pose3(gtsam.Rot3.Quaternion(*q), p) for q, p in zip(quaternions, rows[:, :3], strict=True)]


def values_of(rows: Float[np.ndarray, "poses dims"]) -> gtsam.Values:
    """Poses as gtsam's."""
    values = gtsam.Values()
    for key, pose in enumerate(_gtsam_poses(rows)):
        values.insert(key, pose)
    return values


def rows_of(values: gtsam.Values, freedom: int) -> Float[np.ndarray, "poses dims"]:
    """Pose rows of values whose keys are rows."""
    if freedom == 3:
        return normalised(gtsam.utilities.extractPose2(values))
    table = gtsam.utilities.extractPose3(values)
    R, t_m = table[:, :9].reshape(-1, 3, 3), table[:, 9:]
    return np.concatenate([t_m, se3.quaternion(R)], axis=-1)


def name_of(graph: PoseGraph, row: int) -> str:
    """A pose, and the surest of its measurements: where digits end, it is the one that is too sure."""
    place = f"pose {graph.index[row]} of robot {graph.robot[row]}"
    touching = np.flatnonzero(((graph.tail == row) | (graph.head == row)) & (graph.weight > 0.0))
    if not len(touching):
        return place
    sure = np.abs(graph.information[touching]).max(axis=(1, 2))
    k = int(touching[sure.argmax()])
    other = int(graph.head[k] if graph.tail[k] == row else graph.tail[k])
    end = f"pose {graph.index[other]} of robot {graph.robot[other]}"
    return f"{place}, whose surest measurement is with {end} (information {sure.max():.3g})"
