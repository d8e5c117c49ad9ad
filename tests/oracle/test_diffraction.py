"""Diffraction against exact solutions of conductors, another ray tracer and a second, scalar one."""

import json
from typing import Any

import numpy as np
import pytest
from scipy.special import fresnel, hankel2, jv
from support.data_dir import data_dir
from support.edge_paths import edge_paths
from support.random_rooms import Scene, notched, scene

from wifipgo.radio.propagation.diffraction import diffraction_factor
from wifipgo.radio.propagation.materials import SPEED_OF_LIGHT_M_S, Slab
from wifipgo.radio.propagation.paths import DIFFRACTED, Paths, Surfaces, surfaces_of, trace_paths
from wifipgo.se2 import wrap_angle
from wifipgo.segments import cross, polygon_edges

CARRIER_HZ = 5.0e9
UNIT_BOX = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def conductor(tx_rad: float, rx_rad: np.ndarray, open_rad: float, distance: float) -> np.ndarray:
    """Factor of a perfectly conducting wedge."""
    minus_one = np.full(len(rx_rad), -1.0 + 0.0j)
    from_rad, opened, far = (np.full(len(rx_rad), value) for value in (tx_rad, open_rad, distance))
    return diffraction_factor(from_rad, rx_rad, opened, far, reflection_0=minus_one, reflection_n=minus_one)


def sommerfeld(tx_rad: float, rx_rad: np.ndarray, kr: float) -> np.ndarray:
    """Total field of a plane wave at a conducting half plane (Sommerfeld 1896), 1 at the edge."""

    def wave(angle_rad: np.ndarray) -> np.ndarray:
        edge = -np.sqrt(2.0 * kr) * np.cos(0.5 * angle_rad)
        sine, cosine = fresnel(edge * np.sqrt(2.0 / np.pi))
        rest = np.sqrt(0.5 * np.pi) * ((0.5 - cosine) - 1j * (0.5 - sine))
        scaled: np.ndarray = np.exp(1j * kr * np.cos(angle_rad)) * np.exp(0.25j * np.pi) / np.sqrt(np.pi)
        return scaled * rest

    return wave(rx_rad - tx_rad) - wave(rx_rad + tx_rad)


@pytest.mark.parametrize("tx_deg", [20.0, 90.0, 140.0])
@pytest.mark.parametrize("kr", [0.5, 10.0, 300.0])
def test_a_half_plane_is_sommerfelds(tx_deg: float, kr: float) -> None:
    """Of a plane wave at a screen the coefficient is exact, at any distance."""
    tx_rad, rx_rad = np.deg2rad(tx_deg), np.deg2rad(np.arange(0.37, 360.0, 1.0))
    optics = (rx_rad < np.pi + tx_rad) * np.exp(1j * kr * np.cos(rx_rad - tx_rad))
    optics -= (rx_rad < np.pi - tx_rad) * np.exp(1j * kr * np.cos(rx_rad + tx_rad))
    total = optics + conductor(tx_rad, rx_rad, 2.0 * np.pi, kr) * np.exp(-1j * kr)
    np.testing.assert_allclose(total, sommerfeld(tx_rad, rx_rad, kr), atol=1e-11)


def exact_wedge(tx_rad: float, rx_rad: np.ndarray, open_rad: float, ks_tx: float, ks_rx: float) -> np.ndarray:
    """Field of a line source, alone H0(2)(k R), at a conducting wedge: a series of Bessel functions."""
    turns, near, far = np.pi / open_rad, min(ks_tx, ks_rx), max(ks_tx, ks_rx)
    order = turns * np.arange(1, int((near + 60.0) / turns))
    radial = jv(order, near) * hankel2(order, far)
    angular = np.sin(order * tx_rad) * np.sin(order * rx_rad[:, None])
    series: np.ndarray = (angular * radial).sum(axis=1)
    return 4.0 * turns * series


@pytest.mark.parametrize("open_deg", [200.0, 270.0, 300.0, 345.0])
@pytest.mark.parametrize("tx_deg", [25.0, 60.0, 110.0, 165.0])
def test_a_conducting_wedge_is_the_exact_one(open_deg: float, tx_deg: float) -> None:
    """Within 1e-3 of free space, for wedges from nearly flat to sharp, 24 and 41 wavelengths away."""
    tx_rad, opened = np.deg2rad([tx_deg, open_deg])
    rx_rad = np.deg2rad(np.arange(0.63, open_deg, 1.0))
    ks_tx, ks_rx = 150.0, 260.0
    way = ks_tx + ks_rx
    total = conductor(tx_rad, rx_rad, opened, ks_tx * ks_rx / way) * far_field(way)
    for sign, angle_rad in (
        (1.0, rx_rad - tx_rad),
        (-1.0, rx_rad + tx_rad),
        (-1.0, 2.0 * opened - rx_rad - tx_rad),
    ):
        apart = np.sqrt(ks_tx**2 + ks_rx**2 - 2.0 * ks_tx * ks_rx * np.cos(angle_rad))
        total = total + sign * (np.abs(angle_rad) < np.pi) * hankel2(0.0, apart)
    exact = exact_wedge(tx_rad, rx_rad, opened, ks_tx, ks_rx)
    assert np.abs((total - exact) / far_field(way)).max() < 1e-3


def far_field(kr: float) -> complex:
    """The Hankel function H0(2) of a large number, which is how a field leaves a line source."""
    return complex(np.sqrt(2.0 / (np.pi * kr)) * np.exp(-1j * (kr - 0.25 * np.pi)))


def content(name: str) -> dict[str, Any]:
    """One file of the reference data."""
    read: dict[str, Any] = json.loads((data_dir("sionna_diffraction") / f"{name}.json").read_text("utf-8"))
    return read


def corner_of(case: dict[str, Any], carrier_hz: float) -> Surfaces:
    """The two faces of a wedge in open space: the solid is where x and y are negative."""
    slab = Slab(case["material"], case["thickness_m"])
    return Surfaces(
        ends_m=np.array([[[0.0, -60.0], [0.0, 0.0]], [[0.0, 0.0], [-60.0, 0.0]]]),
        permittivity=np.full(2, slab.permittivity(carrier_hz)),
        thickness_m=np.full(2, slab.thickness_m),
        n_walls=0,
    )


def gain_of(place: dict[str, Any], key: str) -> np.ndarray:
    """Column of a gain of all positions of a case; 0 where there is no such path."""
    return np.array([complex(*(position[key] or (0.0, 0.0))) for position in place["positions"]])


@pytest.mark.parametrize("index", range(4))
def test_wedges_are_those_of_the_ray_tracer(index: int) -> None:
    """0.05 dB and 0.3 degrees, totals within 1e-3 of free space; metal also beside the exact conductor."""
    read = content("wedge_5ghz")
    case, carrier_hz = read["cases"][index], read["carrier_hz"]
    rx_m = np.array([position["rx_m"] for position in case["positions"]])
    tx_m = np.tile(case["tx_m"], (len(rx_m), 1))
    surfaces = corner_of(case, carrier_hz)
    paths = trace_paths(tx_m, rx_m, surfaces, carrier_hz=carrier_hz, penetration=False, diffraction=True)
    bent = paths.order == DIFFRACTED
    assert (bent.sum(axis=1) == 1).all()
    way_m = np.linalg.norm(tx_m, axis=1) + np.linalg.norm(rx_m, axis=1)
    np.testing.assert_allclose(paths.delay_s[bent] * SPEED_OF_LIGHT_M_S, way_m, rtol=1e-12)
    np.testing.assert_allclose(paths.azimuth_rx_rad[bent], np.arctan2(*-rx_m.T[::-1]), atol=1e-12)
    np.testing.assert_allclose(paths.azimuth_tx_rad[bent], np.arctan2(*-tx_m.T[::-1]), atol=1e-12)
    free = SPEED_OF_LIGHT_M_S / carrier_hz / (4.0 * np.pi * way_m)
    total = paths.gain.sum(axis=1)
    assert np.abs((total - gain_of(case, "gain_total")) / free).max() < 1e-3
    assert_near(paths.gain[bent], gain_of(case, "gain_diffracted"))
    if case["material"] == "metal":
        assert_near(paths.gain[bent], gain_of(case, "exact_diffracted"), phase_deg=0.5)
        assert np.abs((total - gain_of(case, "exact_total")) / free).max() < 1e-3


def assert_near(ours: np.ndarray, theirs: np.ndarray, *, phase_deg: float = 0.3) -> None:
    """Gains within the tolerances of the data."""
    ratio = ours / theirs
    assert np.abs(20.0 * np.log10(np.abs(ratio))).max() < 0.05
    assert np.abs(np.angle(ratio, deg=True)).max() < phase_deg


def test_every_diffraction_of_a_room_is_found_and_none_extra() -> None:
    room = content("room_10x8_3_metal_boxes")
    surfaces = surfaces_of(
        np.array([[wall["from_m"], wall["to_m"]] for wall in room["room"]["walls"]]),
        [np.array(box["centre_m"]) + np.array(box["half_extents_m"]) * UNIT_BOX for box in room["boxes"]],
        carrier_hz=room["carrier_hz"],
        wall=[Slab(wall["material"], wall["thickness_m"]) for wall in room["room"]["walls"]],
        obstacle=[Slab(box["material"], box["thickness_m"]) for box in room["boxes"]],
    )
    tx_m, rx_m = (np.array([pair[end] for pair in room["pairs"]]) for end in ("tx_m", "rx_m"))
    paths = trace_paths(
        tx_m,
        rx_m,
        surfaces,
        carrier_hz=room["carrier_hz"],
        max_order=2,
        penetration=False,
        diffraction=True,
    )
    n_bent = 0
    for link, pair in enumerate(room["pairs"]):
        known = [path for path in pair["paths"] if path["kind"] == "diffraction"]
        assert np.count_nonzero(paths.order[link] >= 0) == len(pair["paths"])
        bent = np.flatnonzero(paths.order[link] == DIFFRACTED)
        delay_s = np.array([path["delay_s"] for path in known])
        azimuth_rad = np.array([path["azimuth_rx_rad"] for path in known])
        same = np.abs(paths.delay_s[link, bent, None] - delay_s) < 1e-12
        same &= np.abs(wrap_angle(paths.azimuth_rx_rad[link, bent, None] - azimuth_rad)) < 1e-5
        assert (same.sum(axis=0) == 1).all()
        assert (same.sum(axis=1) == 1).all()
        gain = np.array([complex(path["gain_re"], path["gain_im"]) for path in known])
        assert_near(paths.gain[link, bent], gain[same.argmax(axis=1)])
        n_bent += len(known)
    assert n_bent == 75


@pytest.mark.parametrize("penetration", [True, False])
@pytest.mark.parametrize("convex", [True, False])
@pytest.mark.parametrize("seed", range(8))
def test_random_scenes_match_the_second_tracer(seed: int, convex: bool, penetration: bool) -> None:
    """Corners of any angle, of obstacles and of rooms with notches, behind obstacles of any material."""
    for drawn in (scene(seed, convex=convex), notched(seed)):
        assert_as_second_tracer(drawn, penetration=penetration)


def assert_as_second_tracer(drawn: Scene, *, penetration: bool) -> None:
    surfaces = drawn.surfaces()
    paths = trace_paths(
        drawn.tx_m,
        drawn.rx_m,
        surfaces,
        carrier_hz=drawn.carrier_hz,
        max_order=0,
        penetration=penetration,
        diffraction=True,
    )
    faces = drawn.faces(walls_block=surfaces.n_walls == 0)
    for link, (tx, rx) in enumerate(zip(drawn.tx_m @ (1.0, 1.0j), drawn.rx_m @ (1.0, 1.0j), strict=True)):
        theirs = edge_paths(tx, rx, faces, carrier_hz=drawn.carrier_hz, penetration=penetration)
        ours = only_bent(paths, link)
        assert len(ours) == len(theirs)
        for (delay_s, gain), (length_m, other) in zip(ours, theirs, strict=True):
            assert delay_s * SPEED_OF_LIGHT_M_S == pytest.approx(length_m, rel=1e-12)
            assert gain == pytest.approx(other, rel=1e-7, abs=1e-30)


def only_bent(paths: Paths, link: int) -> list[tuple[float, complex]]:
    """Delays and gains of the paths of a link that go over an edge, by delay."""
    bent = np.flatnonzero(paths.order[link] == DIFFRACTED)
    found = zip(paths.delay_s[link, bent].tolist(), paths.gain[link, bent].tolist(), strict=True)
    return sorted(found, key=lambda path: path[0])


ROOM_M = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 8.0], [0.0, 8.0]])

RIDGE_M = np.array([[4.5, 5.0], [5.5, 5.0], [5.0, 5.2]])


def box_m(x_m: float, y_m: float) -> np.ndarray:
    """A box of 2 m by 2 m, by its lower left corner."""
    return np.array([x_m + 1.0, y_m + 1.0]) + UNIT_BOX


def edges_met(obstacles_m: list[np.ndarray], tx_m: list[float], rx_m: list[float]) -> list[list[float]]:
    """Edges over which a link has paths past obstacles of metal, by their coordinates."""
    surfaces = surfaces_of(
        polygon_edges(ROOM_M), obstacles_m, carrier_hz=CARRIER_HZ, wall=Slab(), obstacle=Slab("metal", 0.1)
    )
    ends_m = np.array([[tx_m], [rx_m]])
    paths = trace_paths(
        ends_m[0], ends_m[1], surfaces, carrier_hz=CARRIER_HZ, penetration=False, diffraction=True
    )
    bent = paths.order[0] == DIFFRACTED
    leave, arrive = (
        np.stack([np.cos(azimuth_rad[0, bent]), np.sin(azimuth_rad[0, bent])], axis=-1)
        for azimuth_rad in (paths.azimuth_tx_rad, paths.azimuth_rx_rad)
    )
    gap_m = ends_m[1, 0] - ends_m[0, 0]
    away_m = cross(gap_m, arrive) / cross(leave, arrive)
    found: list[list[float]] = np.round(ends_m[0] + away_m[:, None] * leave, 6).tolist()
    return sorted(found)


@pytest.mark.parametrize(
    ("obstacles_m", "edges_m"),
    [
        ([box_m(4, 3)], [[4, 5], [6, 5]]),  # of the lower corners neither end sees both
        ([np.insert(box_m(4, 3), 3, [5.0, 5.0], axis=0)], [[4, 5], [6, 5]]),  # a corner on a straight side
        ([box_m(4, 3), box_m(6, 3)], [[4, 5], [8, 5]]),  # side by side: one long box
        ([box_m(4, 3), box_m(6 + 1e-13, 3 + 1e-13)], [[4, 5], [8, 5]]),
        ([box_m(4, 3), box_m(6, 2.5)], [[4, 5], [6, 5], [8, 4.5]]),  # a step, which has a notch
        ([box_m(2, 4), box_m(4, 2)], [[2, 6], [4, 6]]),  # corner to corner
        (
            [box_m(4, 3), box_m(5.5, 2.5)],
            [[4, 5], [6, 5], [7.5, 4.5]],
        ),  # they overlap
        ([box_m(4, 0)], [[4, 2], [6, 2]]),  # at a wall
        ([box_m(4, 3), RIDGE_M], [[4, 5], [5, 5.2], [6, 5]]),
        ([np.array([[4.0, 5.0], [6.0, 5.0]])], [[4, 5], [6, 5]]),  # a screen without thickness
        ([np.array([[5.0, 0.0], [5.0, 5.0]])], [[5, 5]]),  # one that stands on a wall
    ],
)
def test_what_sticks_out_is_an_edge(obstacles_m: list[np.ndarray], edges_m: list[list[float]]) -> None:
    assert edges_met(obstacles_m, [1.0, 7.0], [9.0, 7.3]) == edges_m


def test_where_obstacles_touch_corner_to_corner_a_quarter_is_open_and_no_edge() -> None:
    assert edges_met([box_m(2, 4), box_m(4, 2)], [7.0, 6.5], [9.0, 7.3]) == [
        [2, 6],
        [4, 6],
        [6, 2],
        [6, 4],
    ]


def test_a_room_with_a_notch_has_an_edge_and_a_convex_one_has_none() -> None:
    notched_m = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 8.0], [6.0, 8.0], [6.0, 4.0], [0.0, 4.0]])
    tx_m, rx_m = np.array([[1.0, 2.0]]), np.array([[9.0, 7.0]])
    for corners_m, n_edges in ((notched_m, 1), (notched_m[::-1], 1), (ROOM_M, 0)):
        surfaces = surfaces_of(polygon_edges(corners_m), carrier_hz=CARRIER_HZ, wall=Slab())
        paths = trace_paths(tx_m, rx_m, surfaces, carrier_hz=CARRIER_HZ, diffraction=True)
        assert np.count_nonzero(paths.order == DIFFRACTED) == n_edges
