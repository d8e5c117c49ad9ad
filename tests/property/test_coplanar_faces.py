"""Obstacles that touch each other or a wall: one reflection a place, whatever their order, never nan."""

import itertools

import numpy as np
import pytest

from wifipgo.errors import BadInputError
from wifipgo.radio.propagation.materials import Slab, slab_transmission
from wifipgo.radio.propagation.paths import Paths, Surfaces, surfaces_of, trace_paths
from wifipgo.segments import polygon_edges

CARRIER_HZ = 5.0e9
CORNERS_M = np.array([[0.0, 0.0], [12.0, 0.0], [12.0, 9.0], [0.0, 9.0]])
WOOD, BRICK = Slab("wood", 0.03), Slab("brick", 0.1)


def box(x0: float, y0: float, x1: float, y1: float) -> np.ndarray:
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


# A tall one whose right face is partly covered by a low one, which stands on the floor's wall as it does.
TALL, LOW, LYING = box(4.0, 0.0, 5.0, 6.0), box(5.0, 0.0, 6.0, 2.0), box(4.0, 6.0, 5.0, 7.0)
SCENE = [(TALL, BRICK), (LOW, WOOD), (LYING, WOOD)]


def scene(placed: list[tuple[np.ndarray, Slab]]) -> Surfaces:
    boxes_m, slabs = zip(*placed, strict=True)
    return surfaces_of(
        polygon_edges(CORNERS_M), boxes_m, carrier_hz=CARRIER_HZ, wall=Slab(), obstacle=list(slabs)
    )


def traced(surfaces: Surfaces, tx_m: np.ndarray, rx_m: np.ndarray, *, penetration: bool = True) -> Paths:
    return trace_paths(tx_m, rx_m, surfaces, carrier_hz=CARRIER_HZ, max_order=2, penetration=penetration)


def links() -> tuple[np.ndarray, np.ndarray]:
    """Ends on a grid about the boxes, many of whose reflections hit where faces coincide."""
    at_m = np.array(list(itertools.product((1.0, 3.0, 7.0, 8.0, 10.0), (0.5, 1.0, 2.0, 5.0, 6.0, 8.0))))
    pairs = np.array(list(itertools.combinations(range(len(at_m)), 2)))
    return at_m[pairs[:, 0]], at_m[pairs[:, 1]]


def as_sets(paths: Paths) -> list[np.ndarray]:
    """Each link's paths by delay, however they were listed."""
    rows = zip(paths.delay_s, paths.gain, strict=True)
    return [np.array(sorted(zip(d[g != 0], g[g != 0], strict=True), key=lambda row: row[0])) for d, g in rows]


@pytest.mark.parametrize("penetration", [True, False])
def test_the_order_of_obstacles_does_not_matter(penetration: bool) -> None:
    tx_m, rx_m = links()
    first = as_sets(traced(scene(SCENE), tx_m, rx_m, penetration=penetration))
    for order in itertools.permutations(SCENE):
        for one, other in zip(
            first, as_sets(traced(scene(list(order)), tx_m, rx_m, penetration=penetration)), strict=True
        ):
            assert one.shape == other.shape
            assert np.isfinite(other).all()
            np.testing.assert_allclose(
                np.sort_complex(one.ravel()), np.sort_complex(other.ravel()), rtol=1e-6, atol=1e-12
            )


@pytest.mark.parametrize("shift_m", [0.0, 0.3, 1.0 / 3.0])
def test_a_covered_face_reflects_once_and_what_covers_it_is_crossed_once_each_way(shift_m: float) -> None:
    """From the right at heights 1.2 and 0.8: through the low box's right face, off the tall one, and back."""
    moved = [(corners + np.array([shift_m, 0.0]), slab) for corners, slab in SCENE]
    tx_m, rx_m = np.array([[9.0 + shift_m, 1.2]]), np.array([[9.0 + shift_m, 0.8]])
    alone, both = (traced(scene(placed), tx_m, rx_m) for placed in (moved[:1], moved[:2]))
    delay_s = np.hypot(8.0, 0.4) / 299_792_458.0
    (bare,), (covered,) = (
        paths.gain[(paths.order == 1) & (np.abs(paths.delay_s - delay_s) < 1e-13)] for paths in (alone, both)
    )
    through = slab_transmission(
        np.array([relative_permittivity_of(WOOD)]),
        np.array([0.03]),
        np.array([8.0 / np.hypot(8.0, 0.4)]),
        CARRIER_HZ,
    )[0]
    assert covered == pytest.approx(bare * through**2, rel=1e-9)


def relative_permittivity_of(slab: Slab) -> complex:
    return slab.permittivity(CARRIER_HZ)


def test_a_wall_that_is_covered_reflects_once() -> None:
    """Off the wall under the low box: the wall reflects, and no face in its plane is crossed."""
    tx_m, rx_m = np.array([[5.5 - 1.0, 8.0]]), np.array([[5.5 + 1.0, 8.0]])
    paths = traced(scene(SCENE[1:2]), tx_m, rx_m)
    delay_s = np.hypot(16.0, 2.0) / 299_792_458.0
    at_wall = (paths.order == 1) & (np.abs(paths.delay_s - delay_s) < 1e-13)
    assert np.count_nonzero(at_wall) == 1
    bare = trace_paths(
        tx_m,
        rx_m,
        surfaces_of(polygon_edges(CORNERS_M), carrier_hz=CARRIER_HZ, wall=Slab()),
        carrier_hz=CARRIER_HZ,
    )
    (gain,) = bare.gain[(bare.order == 1) & (np.abs(bare.delay_s - delay_s) < 1e-13)]
    through = slab_transmission(
        np.array([relative_permittivity_of(WOOD)]),
        np.array([0.03]),
        np.array([16.0 / np.hypot(16.0, 2.0)]),
        CARRIER_HZ,
    )[0]
    assert paths.gain[at_wall][0] == pytest.approx(gain * through**2, rel=1e-9)  # the top, down and up


def test_a_ray_through_the_seam_crosses_both_faces() -> None:
    tx_m, rx_m = np.array([[2.0, 1.0]]), np.array([[9.0, 1.0]])
    straight = traced(scene(SCENE[:2]), tx_m, rx_m).gain[0, 0]
    free = traced(scene([(box(8.0, 7.0, 8.5, 7.5), WOOD)]), tx_m, rx_m).gain[0, 0]
    each = [
        slab_transmission(
            np.array([relative_permittivity_of(s)]), np.array([s.thickness_m]), np.ones(1), CARRIER_HZ
        )[0]
        for s in (WOOD, BRICK)
    ]
    assert straight == pytest.approx(free * each[0] ** 2 * each[1] ** 2, rel=1e-9)


def test_two_faces_that_look_the_same_way_at_one_place_are_refused() -> None:
    with pytest.raises(BadInputError, match="look the same way at one place"):
        scene([(TALL, WOOD), (TALL, BRICK)])
    scene([(box(4.0, 0.0, 5.0, 2.0), WOOD), (box(5.0, 0.0, 6.0, 2.0), BRICK)])  # side by side they are fine
