"""Lidar as a function of what stands where: rays against edges and against discs."""

import numpy as np
from jaxtyping import Float, Int

from wifipgo import segments
from wifipgo.rows import Chance
from wifipgo.world.boxes import bounds, meeting
from wifipgo.world.neighbours import neighbours

N_LIDAR_RAYS = 16
# Rays start this far outside the hull, so that touching robots do not blind each other.
_GAP_M = 1e-3
_RAYS_RAD = 2.0 * np.pi / N_LIDAR_RAYS * np.arange(N_LIDAR_RAYS)


def ray_directions(yaw_rad: Float[np.ndarray, " robots"]) -> Float[np.ndarray, "robots rays 2"]:
    """Unit vectors of every robot's rays in the world, counter-clockwise from ahead."""
    angle_rad = yaw_rad[:, None] + _RAYS_RAD
    out = np.empty((*angle_rad.shape, 2))
    np.cos(angle_rad, out=out[..., 0])
    np.sin(angle_rad, out=out[..., 1])
    return out


def scan(
    poses: Float[np.ndarray, "rows 3"],
    edges_m: Float[np.ndarray, "*worlds edges 2 2"],
    *,
    robot_radius_m: float,
    range_m: float,
) -> Float[np.ndarray, "rows rays"]:
    """Free distance from each robot's hull along its rays, up to ``range_m``.

    Args:
        poses: ``T_world_robot``, world after world.
        edges_m: Walls and edges of obstacles; of each world, if there are several.
        robot_radius_m: Radius of every robot's hull.
        range_m: How far the rays reach.

    Returns:
        Distance to the nearest edge or other robot of the same world, m.
    """
    edges_m = edges_m if edges_m.ndim == 4 else edges_m[None]
    n = len(poses) // len(edges_m)
    rays, p_m = ray_directions(poses[:, 2]), poses[:, :2]
    start_m = p_m[:, None] + (robot_radius_m + _GAP_M) * rays
    reach_m = robot_radius_m + _GAP_M + range_m
    free_m = np.full(rays.shape[:2], range_m)
    row, edge = meeting(p_m - reach_m, p_m + reach_m, bounds(edges_m), np.arange(len(p_m)) // n)
    if len(row):
        _shorten(free_m, row, _to_edges(start_m[row], rays[row], edges_m[row // n, edge]))
    seer, other, *_ = neighbours(p_m, n, reach_m + robot_radius_m)
    if len(seer):
        _shorten(free_m, seer, _to_discs(start_m[seer], rays[seer], p_m[other], robot_radius_m))
    return free_m


def noisy(
    free_m: Float[np.ndarray, "rows rays"], *, sigma_m: float, range_m: float, rng: Chance
) -> Float[np.ndarray, "rows rays"]:
    """Distances as a lidar measures them: white noise on those that end at something, within its range."""
    if sigma_m == 0.0:
        return free_m
    measured_m = np.clip(free_m + sigma_m * rng.standard_normal(free_m.shape), 0.0, range_m)
    return np.where(free_m < range_m, measured_m, range_m)


def _shorten(
    free_m: Float[np.ndarray, "rows rays"],
    row: Int[np.ndarray, " pairs"],
    to_m: Float[np.ndarray, "pairs rays"],
) -> None:
    """Cut each robot's rays, in place, to the nearest of what it is paired with."""
    n = free_m.shape[1]
    place = row[:, None] * n + np.arange(n)
    np.minimum.at(free_m.reshape(-1), place.reshape(-1), to_m.reshape(-1))  # quick along one axis only


def _to_edges(
    start_m: Float[np.ndarray, "pairs rays 2"],
    rays: Float[np.ndarray, "pairs rays 2"],
    edges_m: Float[np.ndarray, "pairs 2 2"],
) -> Float[np.ndarray, "pairs rays"]:
    """Distance along each ray to its edge, inf where it misses, m."""
    along = (edges_m[:, 1] - edges_m[:, 0])[:, None]
    gap = edges_m[:, None, 0] - start_m
    det = segments.cross(rays, along)
    safe = np.where(det == 0.0, 1.0, det)
    distance_m, share = segments.cross(gap, along) / safe, segments.cross(gap, rays) / safe
    hit = (det != 0.0) & (distance_m >= 0.0) & (share >= 0.0) & (share <= 1.0)
    return np.where(hit, distance_m, np.inf)


def _to_discs(
    start_m: Float[np.ndarray, "pairs rays 2"],
    rays: Float[np.ndarray, "pairs rays 2"],
    centre_m: Float[np.ndarray, "pairs 2"],
    radius_m: float,
) -> Float[np.ndarray, "pairs rays"]:
    """Distance along each ray to its disc, 0 from inside, inf where it misses, m."""
    gap = centre_m[:, None] - start_m
    along_m = (gap * rays).sum(axis=-1)
    inside = radius_m**2 - segments.cross(gap, rays) ** 2
    distance_m = np.maximum(along_m - np.sqrt(np.maximum(inside, 0.0)), 0.0)
    return np.where((inside >= 0.0) & (along_m > 0.0), distance_m, np.inf)
