"""Weights for relative poses from the direction their signal came from (paper Eqs. 7 to 9, 11).

Beside the paper's gate stands one that knows the range of what it judges.

All angles are radians: Eq. 7 as printed depends on their unit. The peak of Eq. 10
is chosen where the profiles are; here it is an azimuth.
"""

import numpy as np
from jaxtyping import Float

from wifipgo.arithmetic import harmless_underflow
from wifipgo.se2 import wrap_angle

PAPER_SIGMA_RAD = float(np.deg2rad(2.96))  # puts the knee of Eq. 7 at the paper's gate
PAPER_GATE_RAD = float(np.deg2rad(7.2))  # paper Sec. 7.3


def bearing(z: Float[np.ndarray, "*edges dims"]) -> Float[np.ndarray, "*edges"]:
    """Azimuth of a reported relative position, rad (paper Eq. 8); only x and y of a row are read."""
    return np.arctan2(z[..., 1], z[..., 0])


def elevation(offset_m: Float[np.ndarray, "*edges 3"]) -> Float[np.ndarray, "*edges"]:
    """Elevation of a reported relative position ``(dx, dy, dz)``, rad (paper Eq. 9); 0 in the plane."""
    return np.arctan2(offset_m[..., 2], np.hypot(offset_m[..., 0], offset_m[..., 1]))


@harmless_underflow
def likelihood(
    difference_rad: Float[np.ndarray, "*edges"], *, sigma_rad: float = PAPER_SIGMA_RAD
) -> Float[np.ndarray, "*edges"]:
    """How likely a reported direction is, g of paper Eq. 7 on one angle: min(1, sqrt(2 pi) f).

    The density f peaks at ``1 / (sqrt(2 pi) sigma)``, so in radians g is exactly 1 up
    to ``sigma sqrt(2 ln(1 / sigma))``: 7.2 deg for the paper's sigma of 2.96 deg.

    Args:
        difference_rad: Reported direction less the nearest peak; wrapped here.
        sigma_rad: Standard deviation of the direction of arrival.

    Returns:
        g, in [0, 1].
    """
    off = wrap_angle(difference_rad) / sigma_rad
    return np.minimum(1.0, np.exp(-0.5 * off**2) / sigma_rad)


@harmless_underflow
def paper_weights(
    bearing_rad: Float[np.ndarray, "*edges"],
    peak_rad: Float[np.ndarray, "*edges"],
    *,
    sigma_rad: float = PAPER_SIGMA_RAD,
    gate_rad: float = PAPER_GATE_RAD,
) -> Float[np.ndarray, "*edges"]:
    """Factor on the information of each relative pose (paper Eq. 11): W at or beyond the gate, else 1.

    In the plane the elevation agrees, so W of Eq. 7 is its azimuth factor alone.
    """
    off_rad = wrap_angle(bearing_rad - peak_rad)
    return np.where(np.abs(off_rad) >= gate_rad, likelihood(off_rad, sigma_rad=sigma_rad), 1.0)


@harmless_underflow
def range_aware_weights(
    z: Float[np.ndarray, "edges 3"],
    sigma_t_m: Float[np.ndarray, " edges"],
    peak_rad: Float[np.ndarray, " edges"],
    *,
    sigma_rad: float = PAPER_SIGMA_RAD,
    gate_rad: float = PAPER_GATE_RAD,
) -> Float[np.ndarray, " edges"]:
    """Eq. 11 with a gate that is as wide as a good measurement's direction is uncertain (ours).

    The direction of a position at range r is itself uncertain by ``sigma_t / r``, so the sigma of the
    difference is ``s = sqrt(sigma_aoa^2 + sigma_t^2 / r^2)``. The gate lies as many of these sigmas
    out as the paper's does of its own, and the weight falls from 1 there as the Gaussian
    does. For exact positions that is Eq. 11.

    Args:
        z: Reported relative poses.
        sigma_t_m: Standard deviation of their positions, each axis.
        peak_rad: The peak closest to each.
        sigma_rad: Standard deviation of the direction of arrival.
        gate_rad: Gate for an exact position.

    Returns:
        Weight, in [0, 1].
    """
    range_m = np.maximum(np.hypot(z[:, 0], z[:, 1]), np.finfo(float).tiny)
    off_sigmas = wrap_angle(bearing(z) - peak_rad) / np.hypot(sigma_rad, sigma_t_m / range_m)
    beyond = np.maximum(off_sigmas**2 - (gate_rad / sigma_rad) ** 2, 0.0)
    return np.exp(-0.5 * beyond)
