"""Bad input of the path tracer: refused with place and rule, or an explicit 'no path'; never nan."""

from typing import Any

import numpy as np
import pytest

from wifipgo.errors import UnknownNameError
from wifipgo.radio.channel.csi import RadioConfig
from wifipgo.radio.links import probe_links
from wifipgo.radio.propagation.materials import MATERIALS, Material, Slab, relative_permittivity
from wifipgo.radio.propagation.paths import Paths, Surfaces, surfaces_of, trace_paths
from wifipgo.segments import polygon_edges

CARRIER_HZ = 5.0e9
ROOM_M = np.array([[0.0, 0.0], [12.0, 0.0], [12.0, 9.0], [0.0, 9.0]])
# The same room without its upper left corner: the origin of (12, 9) and (1, 8) is not in sight of all of it.
L_SHAPED_M = np.array([[0.0, 0.0], [12.0, 0.0], [12.0, 9.0], [6.0, 9.0], [6.0, 4.5], [0.0, 4.5]])
BOX_M = np.array([[8.0, 2.0], [10.0, 2.0], [10.0, 4.0], [8.0, 4.0]])
WOODEN = Slab("wood", 0.03)


def scene(corners_m: np.ndarray = ROOM_M) -> Surfaces:
    """A room of concrete with a wooden box."""
    return surfaces_of(polygon_edges(corners_m), [BOX_M], carrier_hz=CARRIER_HZ, wall=Slab(), obstacle=WOODEN)


def trace(tx_m: Any, rx_m: Any, surfaces: Surfaces | None = None, **options: Any) -> Paths:
    """Paths of order 0 to 2."""
    ends_m = [np.array(points_m, dtype=float).reshape(-1, 2) for points_m in (tx_m, rx_m)]
    options = {"carrier_hz": CARRIER_HZ, "max_order": 2} | options
    return trace_paths(ends_m[0], ends_m[1], scene() if surfaces is None else surfaces, **options)


@pytest.mark.parametrize(
    ("tx_m", "rx_m", "options", "message"),
    [
        ([[1, 1], [2, 2]], [[1, 2], [2, 2]], {}, "must differ.* at link 1"),
        ([[1, 1]], [[1, 1 + 1e-9]], {}, "must differ.* at link 0"),
        ([[1, 1], [2, np.nan]], [[1, 2], [3, 2]], {}, "tx_m must be finite.* at link 1"),
        ([[1, 1]], [[np.inf, 1]], {}, "rx_m must be finite.* at link 0"),
        ([[1, 1]], [[2, 1]], {"max_order": 3}, "max_order must be 0, 1 or 2, got 3"),
        ([[1, 1]], [[2, 1]], {"max_order": -1}, "max_order must be 0, 1 or 2, got -1"),
        ([[1, 1]], [[2, 1]], {"carrier_hz": np.nan}, "carrier_hz must be in 1000..1"),
        ([[1, 1]], [[2, 1]], {"carrier_hz": 0.0}, "carrier_hz must be in 1000..1"),
    ],
)
def test_bad_links_are_refused(tx_m: Any, rx_m: Any, options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        trace(tx_m, rx_m, **options)


@pytest.mark.parametrize("corners_m", [ROOM_M, L_SHAPED_M])
@pytest.mark.parametrize(
    "point_m", [[9.0, 3.0], [8.002, 3.0], [12.002, 3.0], [-5.0, 1.0], [9.0, 2.0011], [1e6, 1e6]]
)
def test_robot_inside_obstacle_or_outside_room_is_refused(
    point_m: list[float], corners_m: np.ndarray
) -> None:
    message = r"must be inside the room and outside obstacles, got .* at link 1, .* m from the nearest face"
    with pytest.raises(ValueError, match=f"rx_m {message}"):
        trace([[1, 1], [1, 1]], [[2, 1], point_m], scene(corners_m))
    with pytest.raises(ValueError, match=f"tx_m {message}"):
        trace([[2, 1], point_m], [[1, 1], [1, 1]], scene(corners_m))


def test_corner_that_a_room_lacks_is_outside_it() -> None:
    with pytest.raises(ValueError, match="tx_m must be inside the room"):
        trace([[1, 8]], [[11, 8]], scene(L_SHAPED_M))
    assert trace([[1, 1]], [[11, 8]], scene(L_SHAPED_M)).order[0, 0] == 0


@pytest.mark.parametrize("corners_m", [ROOM_M, L_SHAPED_M])
@pytest.mark.parametrize("penetration", [True, False])
@pytest.mark.parametrize(
    ("point_m", "out"),
    [([7.9999, 3.0], [-1, 0]), ([8.0009, 3.0], [-1, 0]), ([9.0, 2.0005], [0, -1]), ([5.0, -0.0009], [0, 1])],
)
def test_a_millimetre_of_overlap_is_taken_as_touching(
    point_m: list[float], out: list[int], penetration: bool, corners_m: np.ndarray
) -> None:
    """What is seen just in front of the face is seen on its wrong side too."""
    surfaces, in_front_m = scene(corners_m), np.array(point_m) + 1e-3 * np.array(out)
    touching = trace([[5, 1]], [point_m], surfaces, penetration=penetration)
    clear = trace([[5, 1]], [in_front_m], surfaces, penetration=penetration)
    np.testing.assert_array_equal(touching.order, clear.order)
    np.testing.assert_allclose(touching.delay_s, clear.delay_s, atol=4e-12)
    assert np.isfinite(touching.gain).all()


def test_dark_link_is_a_row_without_paths() -> None:
    """Three sides of a yard, opaque: nothing gets in from behind, and the robots hear nothing."""
    closed = surfaces_of(np.empty((0, 2, 2)), [BOX_M], carrier_hz=CARRIER_HZ, wall=(), obstacle=WOODEN)
    ends_m = np.array([[7.0, 3.0], [11.0, 3.0], [7.0, 3.5]])
    paths = trace(ends_m[[0, 0]], ends_m[1:], closed, penetration=False)
    assert paths.order.tolist() == [[-1, -1], [0, 1]]
    assert all((column[0] == 0.0).all() for column in paths[:-1])
    links = probe_links(ends_m, closed, RadioConfig(max_order=2, penetration=False))
    assert links.rate_mbit_s[0, 1] == 0.0
    assert np.isfinite(links.esnr_db).all()


@pytest.mark.parametrize(
    ("corners_m", "boxes_m", "wall", "message"),
    [
        (ROOM_M, [BOX_M[::-1]], Slab(), r"obstacles_m\[0\] must be counter-clockwise"),
        (ROOM_M, [], [Slab(), Slab()], "number of wall slabs must be 4, got 2"),
        (ROOM_M[[0, 1, 1, 2, 3]], [], Slab(), "faces of at least 1e-09 m"),
        (ROOM_M * np.nan, [], Slab(), "must be finite"),
        (ROOM_M, [], Slab("brick", 0.1), r"carrier_hz must be in 1e\+09..4e\+10 .*, got 50000000000.0"),
    ],
)
def test_bad_scenes_are_refused(
    corners_m: np.ndarray, boxes_m: list[np.ndarray], wall: Slab | list[Slab], message: str
) -> None:
    carrier_hz = 50e9 if isinstance(wall, Slab) and wall.material == "brick" else CARRIER_HZ
    with pytest.raises(ValueError, match=message):
        surfaces_of(polygon_edges(corners_m), boxes_m, carrier_hz=carrier_hz, wall=wall, obstacle=WOODEN)


def test_open_room_that_is_not_convex_is_refused() -> None:
    """Without its last wall there is no inside; a convex one needs no last wall."""
    with pytest.raises(ValueError, match="a convex room or a closed outline"):
        surfaces_of(polygon_edges(L_SHAPED_M)[:-1], carrier_hz=CARRIER_HZ, wall=Slab())
    ends_m = polygon_edges(L_SHAPED_M)
    with pytest.raises(ValueError, match="a convex room in its first n_walls faces"):
        Surfaces(ends_m=ends_m, permittivity=np.full(6, 4.0 + 0.0j), thickness_m=np.full(6, 0.1), n_walls=6)
    surfaces_of(polygon_edges(ROOM_M)[:-1], carrier_hz=CARRIER_HZ, wall=Slab())


def test_bad_slabs_and_materials_are_refused() -> None:
    with pytest.raises(UnknownNameError, match="known: brick, chipboard"):
        Slab("cheese", 0.1)
    with pytest.raises(ValueError, match=r"thickness_m must be in 1e-06..10"):
        Slab("brick", 0.0)
    for constants, message in (
        ((0.5, 0.0, 0.0, 0.0), "Material.a must be in 1..1e"),
        ((2.0, np.nan, 0.0, 0.0), "Material.b must be in -10..10, got nan"),
        ((2.0, 0.0, -1.0, 0.0), "Material.c must be in 0..1e"),
        ((2.0, 0.0, 0.0, np.inf), "Material.d must be in -10..10, got inf"),
        ((2.0, 0.0, 0.0, 0.0, 2e9, 1e9), "Material.lowest_hz must be <= highest_hz"),
    ):
        with pytest.raises(ValueError, match=message):
            Material(*constants)


@pytest.mark.parametrize("carrier_hz", [0.0, -5e9, 0.999e9, 40.1e9, float("nan"), float("inf")])
def test_frequency_that_a_material_does_not_have_is_refused(carrier_hz: float) -> None:
    """ITU-R P.2040 gives brick from 1 to 40 GHz."""
    with pytest.raises(ValueError, match=r"carrier_hz must be in 1e\+09..4e\+10 for Material\(a=3.91"):
        relative_permittivity(MATERIALS["brick"], carrier_hz)
