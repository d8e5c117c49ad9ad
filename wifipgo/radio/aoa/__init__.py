"""Angle of arrival: profiles over direction, their peaks, and what accuracy is possible (Eqs. 5, 6, 10)."""

from wifipgo.radio.aoa.bartlett import bartlett_profiles, eq5_profiles, profiles
from wifipgo.radio.aoa.estimators import (
    ESTIMATORS,
    AoaConfig,
    Estimator,
    least_packets,
    pair_profiles,
    pair_snapshots,
    product_signal,
    ratio_signal,
    turn_headings,
)
from wifipgo.radio.aoa.music import music_profiles
from wifipgo.radio.aoa.peaks import Directions, Peaks, closest_peak, find_directions, find_peaks
from wifipgo.radio.aoa.steering import (
    Aperture,
    azimuth_grid,
    displacement_steering,
    moving_antenna,
    turn_steering,
    turning_pair,
)

__all__ = [
    "ESTIMATORS",
    "AoaConfig",
    "Aperture",
    "Directions",
    "Estimator",
    "Peaks",
    "azimuth_grid",
    "bartlett_profiles",
    "closest_peak",
    "displacement_steering",
    "eq5_profiles",
    "find_directions",
    "find_peaks",
    "least_packets",
    "moving_antenna",
    "music_profiles",
    "pair_profiles",
    "pair_snapshots",
    "product_signal",
    "profiles",
    "ratio_signal",
    "turn_headings",
    "turn_steering",
    "turning_pair",
]
