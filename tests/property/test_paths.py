"""What must hold for paths in any scene: reciprocity, symmetry, energy, finite answers where rays graze."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wifipgo.radio.propagation.materials import (
    MATERIALS,
    Material,
    Slab,
    relative_permittivity,
    slab_reflection,
    slab_transmission,
)
from wifipgo.radio.propagation.paths import Paths, Surfaces, reverse, surfaces_of, trace_paths
from wifipgo.se2 import apply, wrap_angle
from wifipgo.segments import polygon_edges

CARRIER_HZ = 5.0e9
ROOM_M = np.array([[0.0, 0.0], [12.0, 0.0], [12.0, 9.0], [0.0, 9.0]])
UNIT_BOX = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
WOODEN = Slab("wood", 0.03)
SEEDS = st.integers(0, 2**32 - 1)
SOME = settings(max_examples=40)


@dataclass(frozen=True)
class Scene:
    """A room, boxes turned at random that do not touch, and links between points outside them."""

    corners_m: np.ndarray
    boxes_m: Sequence[np.ndarray]
    slabs: Sequence[Slab]
    tx_m: np.ndarray
    rx_m: np.ndarray

    @classmethod
    def draw(cls, seed: int, n_links: int = 6) -> "Scene":
        """Up to six boxes, one to a cell of 4 m x 4.5 m; the links keep to the aisles between the cells."""
        rng = np.random.default_rng(seed)
        cells = rng.permutation(6)[: rng.integers(0, 7)]
        centres_m = np.stack([cells % 3 * 4.0 + 2.0, cells // 3 * 4.5 + 2.25], axis=-1)
        turned = [(0.0, 0.0, yaw_rad) for yaw_rad in rng.uniform(-np.pi, np.pi, len(cells))]
        boxes_m = [
            centre_m + apply(np.array(turn), UNIT_BOX * rng.uniform(0.2, 0.8, 2))
            for centre_m, turn in zip(centres_m, turned, strict=True)
        ]
        names = rng.choice([name for name in MATERIALS if name != "metal"], len(cells)).tolist()
        slabs = [Slab(name, float(rng.uniform(0.01, 0.2))) for name in names]
        aisle_x_m = rng.uniform(-0.3, 0.3, (2, n_links)) + rng.choice([0.5, 4.0, 8.0, 11.5], (2, n_links))
        ends_m = np.stack([aisle_x_m, rng.uniform(0.1, 8.9, (2, n_links))], axis=-1)
        return cls(ROOM_M, boxes_m, slabs, ends_m[0], ends_m[1])

    def surfaces(self) -> Surfaces:
        """The scene as the radio sees it, in walls of concrete."""
        walls_m = polygon_edges(self.corners_m)
        slabs = self.slabs
        return surfaces_of(walls_m, self.boxes_m, carrier_hz=CARRIER_HZ, wall=Slab(), obstacle=slabs)

    def paths(self, *, penetration: bool = True) -> Paths:
        """All its paths with up to two reflections."""
        return trace_paths(
            self.tx_m,
            self.rx_m,
            self.surfaces(),
            carrier_hz=CARRIER_HZ,
            max_order=2,
            penetration=penetration,
        )


def by_delay(paths: Paths) -> Paths:
    """Each row sorted by delay."""
    order = np.argsort(np.where(paths.order < 0, np.inf, paths.delay_s), axis=1)
    return Paths(*(np.take_along_axis(column, order, axis=1) for column in paths))


def assert_same(got: Paths, expected: Paths, *, turned_rad: float = 0.0) -> None:
    """Equal but for rounding, azimuths after a turn of the whole scene."""
    np.testing.assert_array_equal(got.order, expected.order)
    np.testing.assert_allclose(got.gain, expected.gain, rtol=1e-7)
    np.testing.assert_allclose(got.delay_s, expected.delay_s, rtol=1e-9)
    there = got.order >= 0
    for ours, theirs in (
        (got.azimuth_rx_rad, expected.azimuth_rx_rad),
        (got.azimuth_tx_rad, expected.azimuth_tx_rad),
    ):
        np.testing.assert_allclose(wrap_angle(ours - theirs - turned_rad)[there], 0.0, atol=1e-8)


@SOME
@given(seed=SEEDS, penetration=st.booleans())
def test_swapping_ends_reverses_paths(seed: int, penetration: bool) -> None:
    """A path goes back the way it came, with the same delay and gain, in the other order of its faces."""
    scene = Scene.draw(seed)
    swapped = replace(scene, tx_m=scene.rx_m, rx_m=scene.tx_m).paths(penetration=penetration)
    there = scene.paths(penetration=penetration)
    assert_same(by_delay(swapped), by_delay(reverse(there)))


@SOME
@given(
    seed=SEEDS,
    yaw_rad=st.floats(-np.pi, np.pi),
    x_m=st.floats(-50.0, 50.0),
    y_m=st.floats(-50.0, 50.0),
    penetration=st.booleans(),
)
def test_moving_everything_turns_azimuths_only(
    seed: int, yaw_rad: float, x_m: float, y_m: float, penetration: bool
) -> None:
    scene, move = Scene.draw(seed), np.array([x_m, y_m, yaw_rad])
    moved = Scene(
        apply(move, scene.corners_m),
        [apply(move, box_m) for box_m in scene.boxes_m],
        scene.slabs,
        apply(move, scene.tx_m),
        apply(move, scene.rx_m),
    )
    assert_same(
        moved.paths(penetration=penetration), scene.paths(penetration=penetration), turned_rad=yaw_rad
    )


@SOME
@given(seed=SEEDS)
def test_order_of_faces_and_links_does_not_matter(seed: int) -> None:
    """Permuted faces give the same paths, and each link has the same ones in any company."""
    scene, rng = Scene.draw(seed), np.random.default_rng(seed)
    surfaces, n = scene.surfaces(), len(scene.boxes_m) * 4
    faces = np.concatenate([rng.permutation(4), 4 + rng.permutation(n)])
    links = rng.permutation(len(scene.tx_m))
    permuted = Surfaces(
        ends_m=surfaces.ends_m[faces],
        permittivity=surfaces.permittivity[faces],
        thickness_m=surfaces.thickness_m[faces],
        n_walls=surfaces.n_walls,
    )
    got = trace_paths(scene.tx_m[links], scene.rx_m[links], permuted, carrier_hz=CARRIER_HZ, max_order=2)
    assert_same(by_delay(got), by_delay(Paths(*(column[links] for column in scene.paths()))))


@SOME
@given(seed=SEEDS)
def test_opaque_boxes_leave_the_paths_that_cross_none(seed: int) -> None:
    """What is left with opaque boxes is unchanged by letting waves through; the rest loses."""
    scene = Scene.draw(seed)
    opaque, open_ = scene.paths(penetration=False), scene.paths()
    for link in range(len(opaque.gain)):
        left = opaque.gain[link, opaque.order[link] >= 0]
        off = np.abs(left[:, None] - open_.gain[link]).min(axis=1, initial=np.inf)
        assert (off <= 1e-13 * np.abs(left)).all()  # but for rounding: of few rays it is another
        assert np.count_nonzero(open_.order[link] == 0) == 1
    there = open_.order >= 0
    wavelengths = CARRIER_HZ * open_.delay_s[there]
    assert (np.abs(open_.gain[there]) <= 1.0 / (4.0 * np.pi * wavelengths) * (1.0 + 1e-12)).all()


LATTICE = st.lists(st.integers(0, 8), min_size=4, max_size=4)


@SOME
@given(
    links=st.lists(LATTICE, min_size=1, max_size=8),
    metal=st.booleans(),
    penetration=st.booleans(),
    diffraction=st.booleans(),
)
def test_grazing_geometry_gives_no_nan(
    links: list[list[int]], metal: bool, penetration: bool, diffraction: bool
) -> None:
    """Points on a grid that meets faces, corners and walls: finite answers, gain 0 only for no path."""
    inside = [[2, 2], [6, 4]]
    links = [
        link for link in links if link[:2] != link[2:] and link[:2] not in inside and link[2:] not in inside
    ]
    ends_m = np.array(links, dtype=float).reshape(-1, 2, 2)
    boxes_m = [UNIT_BOX + 2.0, UNIT_BOX + np.array([6.0, 4.0]), UNIT_BOX[::2] + np.array([3.0, 6.0])]
    surfaces = surfaces_of(
        polygon_edges(4.0 * UNIT_BOX + 4.0),
        boxes_m,
        carrier_hz=CARRIER_HZ,
        wall=Slab(),
        obstacle=Slab("metal", 0.1) if metal else WOODEN,
    )
    paths = trace_paths(
        ends_m[:, 0],
        ends_m[:, 1],
        surfaces,
        carrier_hz=CARRIER_HZ,
        max_order=2,
        penetration=penetration,
        diffraction=diffraction,
    )
    assert all(np.isfinite(column).all() for column in paths)
    np.testing.assert_array_equal(paths.gain == 0.0, paths.order == -1)
    assert paths.gain.shape[1] == max(1, (paths.order >= 0).sum(axis=1).max(initial=0))


@given(
    name=st.sampled_from(sorted(MATERIALS)),
    lossless=st.booleans(),
    thickness_m=st.floats(1e-4, 1.0),
    cos_incidence=st.floats(1e-3, 1.0),
    carrier_hz=st.floats(1e9, 1e10),
)
def test_slab_makes_no_energy(
    name: str, lossless: bool, thickness_m: float, cos_incidence: float, carrier_hz: float
) -> None:
    """What it reflects and lets through is at most what arrives, and exactly that without conductivity."""
    material = MATERIALS[name]
    if lossless:
        material = Material(material.a + 1.0, material.b, 0.0, material.d)
    slab = (
        np.array([relative_permittivity(material, carrier_hz)]),
        np.array([thickness_m]),
        np.array([cos_incidence]),
    )
    power = sum(
        abs(coefficient(*slab, carrier_hz)[0]) ** 2 for coefficient in (slab_reflection, slab_transmission)
    )
    assert power <= 1.0 + 1e-9
    assert not lossless or power == pytest.approx(1.0, abs=1e-9)


def test_no_links_give_no_rows() -> None:
    scene = replace(Scene.draw(0), tx_m=np.empty((0, 2)), rx_m=np.empty((0, 2)))
    assert scene.paths().gain.shape == (0, 1)
