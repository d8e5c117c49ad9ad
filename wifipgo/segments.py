"""Line segments in the plane as ``(n, 2, 2)`` arrays: crossings, sight lines, mirror images."""

import numpy as np
from jaxtyping import Bool, Float

_TINY_M2 = 1e-300


def polygon_edges(corners_m: Float[np.ndarray, "corners 2"]) -> Float[np.ndarray, "corners 2 2"]:
    """Edges of a closed polygon, in its own order."""
    edges_m = np.empty((len(corners_m), 2, 2))
    edges_m[:, 0], edges_m[:-1, 1], edges_m[-1:, 1] = corners_m, corners_m[1:], corners_m[:1]
    return edges_m


def cross(a: Float[np.ndarray, "... 2"], b: Float[np.ndarray, "... 2"]) -> Float[np.ndarray, "..."]:
    """Planar cross product ``a_x b_y - a_y b_x``."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def crossings(
    start_m: Float[np.ndarray, "rays 2"],
    end_m: Float[np.ndarray, "rays 2"],
    walls_m: Float[np.ndarray, "*own walls 2 2"],
    *,
    margin: float = 1e-9,
) -> Bool[np.ndarray, "rays walls"]:
    """Which open segments start-end properly cross which walls.

    Both parameters must lie in ``(margin, 1 - margin)`` along the ray and in
    ``[0, 1)`` along the wall: half open, so that a ray through the corner shared
    by two edges of a polygon is counted once.

    Args:
        start_m: Where rays start.
        end_m: Where they end.
        walls_m: The same for all rays, or each ray's own.
        margin: Share of a ray at either end that does not count.
    """
    ray = (end_m - start_m)[:, None]
    wall = walls_m[..., 1, :] - walls_m[..., 0, :]
    gap = walls_m[..., 0, :] - start_m[:, None]
    det = cross(ray, wall)
    parallel = det == 0.0
    det = np.where(parallel, 1.0, det)
    along_ray, along_wall = cross(gap, wall) / det, cross(gap, ray) / det
    hit = (along_ray > margin) & (along_ray < 1.0 - margin) & (along_wall >= 0.0) & (along_wall < 1.0)
    return hit & ~parallel


def in_sight(
    start_m: Float[np.ndarray, "rays 2"],
    end_m: Float[np.ndarray, "rays 2"],
    walls_m: Float[np.ndarray, "*own walls 2 2"],
) -> Bool[np.ndarray, " rays"]:
    """Whether none of the walls, the same for all or each ray's own, is between the two ends of each ray."""
    return np.logical_not(crossings(start_m, end_m, walls_m).any(axis=1))


def mirror(
    p_m: Float[np.ndarray, "points 2"],
    walls_m: Float[np.ndarray, "walls 2 2"],
) -> Float[np.ndarray, "points walls 2"]:
    """Image of every point in the infinite line through every wall, m."""
    direction = walls_m[:, 1] - walls_m[:, 0]
    normal = np.stack([-direction[:, 1], direction[:, 0]], axis=-1)
    normal = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    height_m = np.einsum("pwk,wk->pw", p_m[:, None] - walls_m[None, :, 0], normal)
    return p_m[:, None] - 2.0 * height_m[..., None] * normal[None]


def distance_to_segments(
    p_m: Float[np.ndarray, "points 2"], walls_m: Float[np.ndarray, "*own walls 2 2"]
) -> Float[np.ndarray, "points walls"]:
    """Distance from every point to every segment, the same for all or each point's own, m."""
    base_m, direction = walls_m[..., 0, :], walls_m[..., 1, :] - walls_m[..., 0, :]
    dx_m, dy_m = direction[..., 0], direction[..., 1]
    x_m, y_m = p_m[:, None, 0] - base_m[..., 0], p_m[:, None, 1] - base_m[..., 1]
    square_m2 = np.maximum(dx_m * dx_m + dy_m * dy_m, _TINY_M2)  # a segment without length is a point
    along = np.minimum(np.maximum((x_m * dx_m + y_m * dy_m) / square_m2, 0.0), 1.0)
    off_x_m, off_y_m = x_m - along * dx_m, y_m - along * dy_m
    away_m: np.ndarray = np.sqrt(off_x_m * off_x_m + off_y_m * off_y_m)
    return away_m
