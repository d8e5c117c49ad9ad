"""Paths and slabs against an independent ray tracer and against closed forms."""

import json
from typing import Any

import numpy as np
import pytest
from support.data_dir import data_dir

from wifipgo.radio.propagation.materials import (
    MATERIALS,
    SPEED_OF_LIGHT_M_S,
    Slab,
    relative_permittivity,
    slab_reflection,
    slab_transmission,
)
from wifipgo.radio.propagation.paths import Paths, surfaces_of, trace_paths
from wifipgo.se2 import wrap_angle
from wifipgo.segments import polygon_edges

CARRIER_HZ = 5.0e9
WAVELENGTH_M = SPEED_OF_LIGHT_M_S / CARRIER_HZ
ROOMS = ("room_6x5_empty_concrete", "room_6x5_4_metal_boxes", "room_20x20_4_mixed_boxes")
UNIT_BOX = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
NO_WALLS = np.empty((0, 2, 2))


def reference(name: str) -> dict[str, Any]:
    """One file of the reference data."""
    content: dict[str, Any] = json.loads((data_dir("sionna") / f"{name}.json").read_text("utf-8"))
    return content


def traced(room: dict[str, Any], *, max_order: int = 2) -> Paths:
    """Our paths of every pair of a reference room, boxes opaque."""
    walls, boxes, pairs = room["room"]["walls"], room["boxes"], room["pairs"]
    surfaces = surfaces_of(
        np.array([[wall["from_m"], wall["to_m"]] for wall in walls]),
        [np.array(box["centre_m"]) + np.array(box["half_extents_m"]) * UNIT_BOX for box in boxes],
        carrier_hz=room["carrier_hz"],
        wall=[Slab(wall["material"], wall["thickness_m"]) for wall in walls],
        obstacle=[Slab(box["material"], box["thickness_m"]) for box in boxes],
    )
    tx_m, rx_m = (np.array([pair[end] for pair in pairs]) for end in ("tx_m", "rx_m"))
    carrier_hz = room["carrier_hz"]
    return trace_paths(tx_m, rx_m, surfaces, carrier_hz=carrier_hz, max_order=max_order, penetration=False)


def agree(ours: Paths, link: int, theirs: list[dict[str, Any]]) -> np.ndarray:
    """Which paths of the reference (rows) are which of ours (columns), within the tolerances of the data."""
    there = ours.order[link] >= 0
    delay_s, azimuth_rx_rad, azimuth_tx_rad, order = (
        np.array([path[key] for path in theirs])[:, None]
        for key in ("delay_s", "azimuth_rx_rad", "azimuth_tx_rad", "order")
    )
    gain = np.array([complex(path["gain_re"], path["gain_im"]) for path in theirs])[:, None]
    ratio = ours.gain[link, there] / gain
    return (
        (ours.order[link, there] == order)
        & (np.abs(ours.delay_s[link, there] - delay_s) < 1e-12)
        & (np.abs(wrap_angle(ours.azimuth_rx_rad[link, there] - azimuth_rx_rad)) < np.deg2rad(0.01))
        & (np.abs(wrap_angle(ours.azimuth_tx_rad[link, there] - azimuth_tx_rad)) < np.deg2rad(0.1))
        & (np.abs(20.0 * np.log10(np.abs(ratio))) < 0.05)
        & (np.abs(np.angle(ratio)) < np.deg2rad(0.2))
    )


@pytest.mark.parametrize("name", ROOMS)
@pytest.mark.parametrize("max_order", [0, 1, 2])
def test_rooms_match_ray_tracer_one_to_one(name: str, max_order: int) -> None:
    """Every path of the reference up to this order is one of ours, and ours are no more."""
    room = reference(name)
    ours = traced(room, max_order=max_order)
    for link, pair in enumerate(room["pairs"]):
        theirs = [path for path in pair["paths"] if path["order"] <= max_order]
        same = agree(ours, link, theirs) if theirs else np.empty((0, int((ours.order[link] >= 0).sum())))
        assert same.shape[0] == same.shape[1], (
            f"pair {link}: {len(theirs)} in reference, {same.shape[1]} ours"
        )
        assert (same.sum(axis=0) == 1).all(), f"pair {link}"
        assert (same.sum(axis=1) == 1).all(), f"pair {link}"


def test_rooms_hold_all_paths_of_the_reference() -> None:
    """So that the comparison above cannot be empty: 39 lines of sight, 149 and 288 reflections."""
    rooms = [reference(name) for name in ROOMS]
    theirs = [path["order"] for room in rooms for pair in room["pairs"] for path in pair["paths"]]
    ours = np.concatenate([traced(room).order.ravel() for room in rooms])
    assert [theirs.count(order) for order in range(3)] == [39, 149, 288]
    assert [np.count_nonzero(ours == order) for order in range(3)] == [39, 149, 288]


@pytest.mark.parametrize("name", [*ROOMS, "thin_wall_transmission"])
def test_materials_match_reference(name: str) -> None:
    content = reference(name)
    for material, constants in content["materials"].items():
        ours = MATERIALS[material]
        assert (ours.a, ours.b, ours.c, ours.d) == tuple(constants[key] for key in "abcd")
        permittivity = complex(constants["eps_r_re"], constants["eps_r_im"])
        assert relative_permittivity(ours, content["carrier_hz"]) == pytest.approx(permittivity, rel=1e-8)


def thin_wall_cases() -> tuple[dict[str, Any], np.ndarray, np.ndarray]:
    """The thin-wall file with its gains through the wall and without it."""
    content = reference("thin_wall_transmission")
    gains = [
        np.array([complex(case[f"{key}_re"], case[f"{key}_im"]) for case in content["cases"]])
        for key in ("gain_through_wall", "gain_free_space")
    ]
    return content, gains[0], gains[1]


def test_transmission_matches_ray_tracer() -> None:
    """30 slabs and angles: 0.002 dB and 0.02 deg, five times the reference's own deviation."""
    content, through, free = thin_wall_cases()
    cases, carrier_hz = content["cases"], content["carrier_hz"]
    eps = np.array([relative_permittivity(MATERIALS[case["material"]], carrier_hz) for case in cases])
    cos_incidence = np.array([(case["rx_m"][0] - case["tx_m"][0]) / case["length_m"] for case in cases])
    thickness_m = np.array([case["thickness_m"] for case in cases])
    ratio = slab_transmission(eps, thickness_m, cos_incidence, carrier_hz) / (through / free)
    np.testing.assert_allclose(20.0 * np.log10(np.abs(ratio)), 0.0, atol=0.002)
    np.testing.assert_allclose(np.rad2deg(np.angle(ratio)), 0.0, atol=0.02)


def test_link_through_thin_box_crosses_two_faces() -> None:
    """A box around the reference's wall costs its transmission twice, and leaves one path."""
    content, through, free = thin_wall_cases()
    box_m = np.array([3.0, 0.0]) + UNIT_BOX * np.array([0.05, 3.0])
    for case, through_wall, free_space in zip(content["cases"], through, free, strict=True):
        surfaces = surfaces_of(
            NO_WALLS,
            [box_m],
            carrier_hz=content["carrier_hz"],
            wall=(),
            obstacle=Slab(case["material"], case["thickness_m"]),
        )
        tx_m, rx_m = np.array([case["tx_m"]]), np.array([case["rx_m"]])
        paths = trace_paths(tx_m, rx_m, surfaces, carrier_hz=content["carrier_hz"])
        assert paths.order.tolist() == [[0]]
        np.testing.assert_allclose(paths.gain[0, 0], through_wall**2 / free_space, rtol=1e-3)


@pytest.mark.parametrize("clockwise", [False, True])
def test_empty_rectangle_matches_images(clockwise: bool) -> None:
    """Four images, one in each wall, whichever way round the walls are given; metal reflects with -1."""
    width_m, height_m = 6.0, 5.0
    corners_m = (UNIT_BOX + 1.0) / 2.0 * np.array([width_m, height_m])
    walls_m = polygon_edges(corners_m[::-1] if clockwise else corners_m)
    surfaces = surfaces_of(walls_m, carrier_hz=CARRIER_HZ, wall=Slab("metal", 0.1))
    (x, y), rx_m = (1.2, 3.4), np.array([4.1, 0.7])
    images_m = np.array([[x, y], [x, -y], [2 * width_m - x, y], [x, 2 * height_m - y], [-x, y]])
    paths = trace_paths(np.array([[x, y]]), rx_m[None], surfaces, carrier_hz=CARRIER_HZ)
    order = [0, *(walls_order(walls_m, corners_m) + 1)]
    away_m = images_m[order] - rx_m
    length_m = np.hypot(*away_m.T)
    assert paths.order.tolist() == [[0, 1, 1, 1, 1]]
    np.testing.assert_allclose(paths.delay_s[0] * SPEED_OF_LIGHT_M_S, length_m, rtol=1e-13)
    np.testing.assert_allclose(paths.azimuth_rx_rad[0], np.arctan2(away_m[:, 1], away_m[:, 0]), atol=1e-13)
    friis = WAVELENGTH_M / (4.0 * np.pi * length_m) * np.exp(-2j * np.pi * length_m / WAVELENGTH_M)
    np.testing.assert_allclose(paths.gain[0] / friis, np.where(paths.order[0] == 0, 1.0, -1.0), atol=1e-3)


def test_empty_rectangle_matches_images_of_images() -> None:
    """Eight images of images, each seen once; two reflections off metal change no sign."""
    (width_m, height_m), (x, y), rx_m = (6.0, 5.0), (1.2, 3.4), np.array([4.13, 0.72])
    walls_m = polygon_edges((UNIT_BOX + 1.0) / 2.0 * np.array([width_m, height_m]))
    surfaces = surfaces_of(walls_m, carrier_hz=CARRIER_HZ, wall=Slab("metal", 0.1))
    around = [(2 * width_m - x, -y), (-x, -y), (2 * width_m - x, 2 * height_m - y), (-x, 2 * height_m - y)]
    across = [(x + 2 * width_m, y), (x - 2 * width_m, y), (x, y + 2 * height_m), (x, y - 2 * height_m)]
    away_m = np.array(around + across) - rx_m
    away_m = away_m[np.argsort(np.hypot(*away_m.T))]
    length_m = np.hypot(*away_m.T)
    paths = trace_paths(np.array([[x, y]]), rx_m[None], surfaces, carrier_hz=CARRIER_HZ, max_order=2)
    assert paths.order.tolist() == [[0, 1, 1, 1, 1, *[2] * 8]]
    row = 5 + np.argsort(paths.delay_s[0, 5:])
    np.testing.assert_allclose(paths.delay_s[0, row] * SPEED_OF_LIGHT_M_S, length_m, rtol=1e-13)
    np.testing.assert_allclose(
        paths.azimuth_rx_rad[0, row], np.arctan2(away_m[:, 1], away_m[:, 0]), atol=1e-13
    )
    friis = WAVELENGTH_M / (4.0 * np.pi * length_m) * np.exp(-2j * np.pi * length_m / WAVELENGTH_M)
    np.testing.assert_allclose(paths.gain[0, row] / friis, 1.0, atol=2e-3)


def walls_order(walls_m: np.ndarray, corners_m: np.ndarray) -> np.ndarray:
    """Place of each wall among the edges of the counter-clockwise rectangle."""
    middle_m = polygon_edges(corners_m).mean(axis=1)
    return np.array([np.argmin(np.abs(middle_m - wall.mean(axis=0)).sum(axis=1)) for wall in walls_m])


def test_reflection_off_box_leaves_at_equal_angles() -> None:
    """Ends 3 m apart, 2 m from a face: over the hit at its middle, both legs are 2.5 m and cos is 0.8."""
    slab = Slab("brick", 0.1)
    surfaces = surfaces_of(NO_WALLS, [UNIT_BOX], carrier_hz=CARRIER_HZ, wall=(), obstacle=slab)
    paths = trace_paths(np.array([[-1.5, 3.0]]), np.array([[1.5, 3.0]]), surfaces, carrier_hz=CARRIER_HZ)
    eps = np.array([relative_permittivity(MATERIALS["brick"], CARRIER_HZ)])
    reflection = slab_reflection(eps, np.array([0.1]), np.array([0.8]), CARRIER_HZ)[0]
    assert paths.order.tolist() == [[0, 1]]
    np.testing.assert_allclose(paths.delay_s[0] * SPEED_OF_LIGHT_M_S, [3.0, 5.0], rtol=1e-14)
    np.testing.assert_allclose(paths.azimuth_tx_rad[0], [0.0, -np.arctan2(2.0, 1.5)], rtol=1e-14)
    np.testing.assert_allclose(paths.azimuth_rx_rad[0], [np.pi, -np.arctan2(2.0, -1.5)], rtol=1e-14)
    np.testing.assert_allclose(np.abs(paths.gain[0, 1]), abs(reflection) * WAVELENGTH_M / (20.0 * np.pi))


def test_slab_of_half_a_wave_is_transparent() -> None:
    """Lossless, normal incidence: no reflection at half a wave, (1 - eps) / (1 + eps) at a quarter."""
    eps, cos = np.array([4.0 + 0.0j, 4.0 + 0.0j]), np.ones(2)
    thickness_m = WAVELENGTH_M / 2.0 * np.array([0.5, 0.25])
    reflection = slab_reflection(eps, thickness_m, cos, CARRIER_HZ)
    np.testing.assert_allclose(reflection, [0.0, -0.6], atol=1e-12)
    np.testing.assert_allclose(
        np.abs(slab_transmission(eps, thickness_m, cos, CARRIER_HZ)), [1.0, 0.8], rtol=1e-12
    )


def test_metal_is_opaque_without_warnings() -> None:
    eps = np.array([relative_permittivity(MATERIALS["metal"], CARRIER_HZ)] * 2)
    thickness_m, cos = np.full(2, 0.1), np.array([1e-3, 1.0])
    assert (slab_transmission(eps, thickness_m, cos, CARRIER_HZ) == 0.0).all()
    np.testing.assert_allclose(slab_reflection(eps, thickness_m, cos, CARRIER_HZ), -1.0, atol=1e-3)


@pytest.mark.parametrize(
    ("material", "thickness_m", "loss_db"),
    [("concrete", 0.2, 24.7), ("brick", 0.1, 3.9), ("plasterboard", 0.026, 1.9)],
)
def test_penetration_loss_at_5_ghz(material: str, thickness_m: float, loss_db: float) -> None:
    """Loss at normal incidence of the walls that offices are made of, to the printed digit."""
    eps = np.array([relative_permittivity(MATERIALS[material], CARRIER_HZ)])
    through = slab_transmission(eps, np.array([thickness_m]), np.ones(1), CARRIER_HZ)
    assert -20.0 * np.log10(np.abs(through[0])) == pytest.approx(loss_db, abs=0.06)
