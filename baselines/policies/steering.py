"""Where to drive next: at random, or towards a bearing; around what the lidar sees."""

import numpy as np
from jaxtyping import Bool, Float

from envs.directions import ROOM_AHEAD_STEPS, safe_lengths
from wifipgo.rows import Chance
from wifipgo.se2 import wrap_angle

# Turning to the other side of an obstacle costs as much as this detour: without it robots dither.
_CHANGE_SIDE_RAD = 1.0


def ray_angles(n_rays: int) -> Float[np.ndarray, " rays"]:
    """Directions of the lidar's rays in the body frame, rad."""
    return wrap_angle(2.0 * np.pi / n_rays * np.arange(n_rays))


def open_rays(free_steps: Float[np.ndarray, "robots rays"]) -> Bool[np.ndarray, "robots rays"]:
    """Rays along which a whole step fits."""
    return free_steps >= 1.0 + ROOM_AHEAD_STEPS


def _waypoint(angle_rad: np.ndarray, length_steps: np.ndarray) -> np.ndarray:
    return length_steps[:, None] * np.stack([np.cos(angle_rad), np.sin(angle_rad)], axis=-1)


def _safe_length(free_steps: np.ndarray, ray: np.ndarray) -> np.ndarray:
    """Whole step if the ray is open, else what is left before it hits."""
    return safe_lengths(free_steps)[np.arange(len(ray)), ray]


def random_step(
    free_steps: Float[np.ndarray, "robots rays"], *, rng: Chance
) -> Float[np.ndarray, "robots 2"]:
    """RandomWalk of paper Sec. 5: a step in a direction drawn uniformly from the open ones.

    In a dead end the most open ray is taken as far as it goes. Every robot draws the same
    number of times whatever it sees, so that walks of two policies stay paired.
    """
    n, n_rays = free_steps.shape
    draw, jitter = rng.random((n, n_rays)), rng.random(n) - 0.5
    ray = np.where(open_rays(free_steps), draw, -1.0 + 1e-3 * free_steps).argmax(axis=1)
    angle = ray_angles(n_rays)[ray] + jitter * 2.0 * np.pi / n_rays
    return _waypoint(angle, _safe_length(free_steps, ray))


def step_towards(
    bearing_rad: Float[np.ndarray, " robots"],
    length_steps: Float[np.ndarray, " robots"],
    free_steps: Float[np.ndarray, "robots rays"],
    side: Float[np.ndarray, " robots"],
) -> tuple[Float[np.ndarray, "robots 2"], Float[np.ndarray, " robots"]]:
    """A step along a bearing, or along the open ray nearest to it if that way is blocked.

    Args:
        bearing_rad: Wanted direction, body frame.
        length_steps: Wanted length.
        free_steps: Lidar, in step lengths.
        side: On which side each robot passed the last obstacle: -1, 1, or 0 for none.

    Returns:
        Waypoints in step lengths, and the sides now taken.
    """
    n_rays = free_steps.shape[1]
    off = wrap_angle(ray_angles(n_rays)[None] - bearing_rad[:, None])
    ahead = np.abs(off).argmin(axis=1)
    clear = _safe_length(free_steps, ahead) >= np.minimum(length_steps, 1.0)
    detour = np.abs(off) + _CHANGE_SIDE_RAD * (np.sign(off) == -side[:, None])
    ray = np.where(open_rays(free_steps), detour, 10.0 - 1e-2 * free_steps).argmin(axis=1)
    around = ray_angles(n_rays)[ray]
    angle = np.where(clear, bearing_rad, around)
    length = np.where(clear, length_steps, np.minimum(length_steps, _safe_length(free_steps, ray)))
    taken = np.sign(off[np.arange(len(ray)), ray])
    return _waypoint(angle, length), np.where(clear, 0.0, taken)
