"""What must hold of diffraction at any edge: continuity, reciprocity, the symmetries of paths."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from property.test_paths import CARRIER_HZ, SEEDS, Scene, assert_same, by_delay
from wifipgo.radio.propagation.materials import MATERIALS, SPEED_OF_LIGHT_M_S, Slab
from wifipgo.radio.propagation.paths import DIFFRACTED, Paths, Surfaces, reverse, trace_paths
from wifipgo.se2 import apply

SLABS = [Slab(name, thickness_m) for name in MATERIALS for thickness_m in (0.004, 0.03, 0.2)]


def wedge(open_rad: float, slabs: list[Slab]) -> Surfaces:
    """Two faces that meet at the origin, open from the direction of x counter-clockwise."""
    end_m = 50.0 * np.array([np.cos(open_rad), np.sin(open_rad)])
    return Surfaces(
        ends_m=np.array([[[50.0, 0.0], [0.0, 0.0]], [[0.0, 0.0], end_m]]),
        permittivity=np.array([slab.permittivity(CARRIER_HZ) for slab in slabs]),
        thickness_m=np.array([slab.thickness_m for slab in slabs]),
        n_walls=0,
    )


def at(about_rad: np.ndarray, away_m: float) -> np.ndarray:
    """Places at a distance from the edge."""
    return away_m * np.stack([np.cos(about_rad), np.sin(about_rad)], axis=-1)


def traced(surfaces: Surfaces, tx_m: np.ndarray, rx_m: np.ndarray, *, penetration: bool = False) -> Paths:
    return trace_paths(tx_m, rx_m, surfaces, carrier_hz=CARRIER_HZ, penetration=penetration, diffraction=True)


WEDGES = st.tuples(st.floats(1.05, 1.95), st.lists(st.sampled_from(SLABS), min_size=2, max_size=2))
DISTANCES = st.floats(0.05, 8.0)


@settings(max_examples=30)
@given(
    shape=WEDGES, share=st.floats(0.05, 0.95), s_tx_m=DISTANCES, s_rx_m=DISTANCES, penetration=st.booleans()
)
def test_the_field_is_continuous_where_rays_begin_and_end(
    shape: tuple[float, list[Slab]], share: float, s_tx_m: float, s_rx_m: float, penetration: bool
) -> None:
    """Over a shift of 1e-6 rad the sum moves as its phase does, at every shadow and reflection boundary."""
    open_rad, tx_rad = shape[0] * np.pi, shape[0] * np.pi * share
    surfaces = wedge(open_rad, shape[1])
    boundaries = np.array([np.pi - tx_rad, 2.0 * open_rad - np.pi - tx_rad, tx_rad + np.pi, tx_rad - np.pi])
    boundaries = boundaries[(boundaries > 0.01) & (boundaries < open_rad - 0.01)]
    shift = 5e-7
    rx_m = at(np.stack([boundaries - shift, boundaries + shift], axis=-1).ravel(), s_rx_m)
    tx_m = np.tile(at(np.array(tx_rad), s_tx_m), (len(rx_m), 1))
    if len(rx_m):
        paths = traced(surfaces, tx_m, rx_m, penetration=penetration)
        free = SPEED_OF_LIGHT_M_S / CARRIER_HZ / (4.0 * np.pi * (s_tx_m + s_rx_m))
        fields = (paths.gain.sum(axis=1) / free).reshape(-1, 2)
        assert np.abs(fields[:, 1] - fields[:, 0]).max() < 2e-3
        n_rays = (paths.order >= 0).sum(axis=1).reshape(-1, 2)
        assert penetration or (n_rays[:, 0] != n_rays[:, 1]).all()  # there is something to make up for


@settings(max_examples=20)
@given(shape=WEDGES, shares=st.tuples(st.floats(0.02, 0.98), st.floats(0.02, 0.98)))
def test_swapping_the_ends_changes_nothing_where_they_are_nearer_to_different_faces(
    shape: tuple[float, list[Slab]], shares: tuple[float, float]
) -> None:
    """Face 0 is the one nearer to the transmitter, so each keeps its angle. Of conductors any will do."""
    open_rad = shape[0] * np.pi
    conducting = (shares[0] < 0.5) == (shares[1] < 0.5)
    surfaces = wedge(open_rad, [Slab("metal", 0.1)] * 2 if conducting else shape[1])
    ends_m = [
        at(np.array([share * open_rad]), away_m) for share, away_m in zip(shares, (2.0, 3.1), strict=True)
    ]
    there, back = (traced(surfaces, *pair) for pair in (ends_m, ends_m[::-1]))
    gains = [paths.gain[paths.order == DIFFRACTED] for paths in (there, back)]
    free = SPEED_OF_LIGHT_M_S / CARRIER_HZ / (4.0 * np.pi * 5.1)
    assert len(gains[0]) == len(gains[1]) == 1
    np.testing.assert_allclose(gains[0], gains[1], rtol=1e-7, atol=(2e-3 if conducting else 1e-12) * free)


def bent_paths(scene: Scene, *, penetration: bool) -> Paths:
    """Paths of a random room without reflections."""
    return trace_paths(
        scene.tx_m,
        scene.rx_m,
        scene.surfaces(),
        carrier_hz=CARRIER_HZ,
        max_order=0,
        penetration=penetration,
        diffraction=True,
    )


@settings(max_examples=10)
@given(seed=SEEDS, yaw_rad=st.floats(-np.pi, np.pi), penetration=st.booleans())
def test_moving_everything_turns_azimuths_only(seed: int, yaw_rad: float, penetration: bool) -> None:
    scene, move = Scene.draw(seed), np.array([7.0, -20.0, yaw_rad])
    moved = Scene(
        apply(move, scene.corners_m),
        [apply(move, box_m) for box_m in scene.boxes_m],
        scene.slabs,
        apply(move, scene.tx_m),
        apply(move, scene.rx_m),
    )
    there, turned = (bent_paths(one, penetration=penetration) for one in (scene, moved))
    assert_same(by_delay(turned), by_delay(there), turned_rad=yaw_rad)


@settings(max_examples=10)
@given(seed=SEEDS)
def test_swapped_ends_have_the_same_paths_with_directions_swapped(seed: int) -> None:
    """Which paths there are, how long and from where: that is symmetric, whatever walls are made of."""
    scene = Scene.draw(seed)
    there = by_delay(reverse(bent_paths(scene, penetration=True)))
    back = by_delay(bent_paths(replace(scene, tx_m=scene.rx_m, rx_m=scene.tx_m), penetration=True))
    assert_same(back._replace(gain=there.gain), there)


def test_behind_a_screen_that_lets_everything_through_nothing_bends() -> None:
    """In line with the edge of an opaque one it is half the field."""
    screen = Surfaces(
        ends_m=np.array([[[50.0, 0.0], [0.0, 0.0]], [[0.0, 0.0], [50.0, 0.0]]]),
        permittivity=np.full(2, 1.0 + 0.0j),
        thickness_m=np.full(2, 1e-6),
        n_walls=0,
    )
    tx_m, rx_m = np.array([[1.0, 2.0]]), np.array([[-1.0, -2.0]])
    free = SPEED_OF_LIGHT_M_S / CARRIER_HZ / (4.0 * np.pi * np.sqrt(20.0))
    for penetration, share in ((True, 0.0), (False, 0.5)):
        paths = traced(screen, tx_m, rx_m, penetration=penetration)
        bent = np.where(paths.order == DIFFRACTED, np.abs(paths.gain) / free, 0.0)
        assert bent.max() == pytest.approx(share, abs=1e-3)
