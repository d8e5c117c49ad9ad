"""Directions around a robot: bins of AOA profiles, rays of the lidar, and discrete motions along these.

A discrete motion drives along a ray as far as the way is free, or stays; times a call. Motion k < 16 follows
ray k, counter-clockwise from ahead, and motion 16 stays. A *choice* is one number for motion and call:
``motion`` alone, or ``17 + motion`` with a call up: 34 choices.
"""

import numpy as np
from jaxtyping import Bool, Float, Int, Int8

from wifipgo.world.lidar import N_LIDAR_RAYS

# Bins of an observed AOA profile.
N_BINS = 72
STAY = N_LIDAR_RAYS
N_MOTIONS = N_LIDAR_RAYS + 1
N_CHOICES = 2 * N_MOTIONS
# A ray is open if a step along it ends this far (in steps) from what it hits.
ROOM_AHEAD_STEPS = 0.15


def bin_azimuths() -> Float[np.ndarray, " bins"]:
    """Direction at the middle of each profile bin, body frame, rad."""
    return -np.pi + 2.0 * np.pi / N_BINS * (np.arange(N_BINS) + 0.5)


def ray_azimuths() -> Float[np.ndarray, " rays"]:
    """Directions of the rays, body frame, rad."""
    return 2.0 * np.pi / N_LIDAR_RAYS * np.arange(N_LIDAR_RAYS)


def safe_lengths(free_steps: Float[np.ndarray, "robots rays"]) -> Float[np.ndarray, "robots rays"]:
    """Whole step along the rays that are open, else what is left before they hit."""
    return np.clip(free_steps - ROOM_AHEAD_STEPS, 0.0, 1.0)


def waypoints_of(
    motion: Int[np.ndarray, " robots"], free_steps: Float[np.ndarray, "robots rays"]
) -> Float[np.ndarray, "robots 2"]:
    """Waypoints in the body frame, in steps, that motions mean where the lidar sees so far."""
    stays = motion == STAY
    ray = np.where(stays, 0, motion)
    length = np.where(stays, 0.0, safe_lengths(free_steps)[np.arange(len(ray)), ray])
    angle_rad = ray_azimuths()[ray]
    return np.stack([length * np.cos(angle_rad), length * np.sin(angle_rad)], axis=1)


def choice_mask(
    free_steps: Float[np.ndarray, "robots rays"], reaches: Bool[np.ndarray, " robots"]
) -> Int8[np.ndarray, "robots choices"]:
    """1 where a choice does something of its own; to stay without a call is always among them.

    0 means that another choice does exactly the same: a way that ends before it begins is to stay, and a
    call that nobody hears is none. So a mask forbids nothing that could help.

    Args:
        free_steps: Lidar, in step lengths.
        reaches: Whether a ping of anybody passes, so that a call would be placed.
    """
    motion = np.ones((len(free_steps), N_MOTIONS), dtype=np.int8)
    motion[:, :STAY] = safe_lengths(free_steps) > 0.0
    return np.concatenate([motion, motion * reaches[:, None].astype(np.int8)], axis=1)
