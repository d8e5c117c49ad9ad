"""Paths of random scenes against a second image method that is slow, scalar and shares no code."""

import numpy as np
import pytest
from support.image_method import all_paths
from support.random_rooms import Scene, notched, scene

from wifipgo.radio.propagation.materials import SPEED_OF_LIGHT_M_S
from wifipgo.radio.propagation.paths import Paths, trace_paths
from wifipgo.se2 import wrap_angle
from wifipgo.segments import cross, polygon_edges


@pytest.mark.parametrize("penetration", [True, False])
@pytest.mark.parametrize("convex", [True, False])
@pytest.mark.parametrize("seed", range(12))
def test_random_scenes_match_second_tracer(seed: int, convex: bool, penetration: bool) -> None:
    """Same paths of order 0 to 2 one to one, with the same delays, azimuths and gains."""
    compare(scene(seed, convex=convex), penetration=penetration)


def compare(drawn: Scene, *, penetration: bool) -> Paths:
    """Hold our paths to those of the second tracer; returns ours."""
    surfaces = drawn.surfaces()
    ours = trace_paths(
        drawn.tx_m, drawn.rx_m, surfaces, carrier_hz=drawn.carrier_hz, max_order=2, penetration=penetration
    )
    faces = drawn.faces(walls_block=surfaces.n_walls == 0)
    for link, (tx, rx) in enumerate(zip(drawn.tx_m @ (1.0, 1.0j), drawn.rx_m @ (1.0, 1.0j), strict=True)):
        theirs = all_paths(tx, rx, faces, carrier_hz=drawn.carrier_hz, max_order=2, penetration=penetration)
        n = np.count_nonzero(ours.order[link] >= 0)
        row = np.lexsort((ours.delay_s[link, :n], ours.order[link, :n]))
        assert ours.order[link, row].tolist() == [path.order for path in theirs]
        for got, expected in (
            (ours.delay_s, [path.length_m / SPEED_OF_LIGHT_M_S for path in theirs]),
            (ours.gain, [path.gain for path in theirs]),
        ):
            np.testing.assert_allclose(got[link, row], expected, rtol=1e-6)
        for got, expected in (
            (ours.azimuth_rx_rad, [path.azimuth_rx_rad for path in theirs]),
            (ours.azimuth_tx_rad, [path.azimuth_tx_rad for path in theirs]),
        ):
            np.testing.assert_allclose(wrap_angle(got[link, row] - expected), 0.0, atol=1e-7)
    return ours


@pytest.mark.parametrize("penetration", [True, False])
def test_links_in_notches_match_second_tracer(penetration: bool) -> None:
    """Ls, Us and worse: faces that see each other, and rays that an obstacle's own arms cut."""
    n_short = 0
    for seed in range(10):
        ours = compare(notched(seed), penetration=penetration)
        near = ours.delay_s * SPEED_OF_LIGHT_M_S < 4.0
        n_short += int(np.count_nonzero(near & (ours.order > 0)))
    assert n_short > 20  # echoes off the obstacles: a way by a wall of the room is longer


def test_random_scenes_are_of_all_kinds() -> None:
    """So that the comparison above cannot miss a kind: rooms that are not convex, both signs of turn."""
    rooms = [scene(seed, convex=False) for seed in range(12)]
    assert sum(drawn.surfaces().n_walls == 0 for drawn in rooms) >= 6
    obstacles_m = [corners_m for drawn in rooms for corners_m in drawn.obstacles_m]
    turns = [
        cross(edges[:, 1] - edges[:, 0], np.roll(edges[:, 1] - edges[:, 0], -1, axis=0))
        for edges in map(polygon_edges, obstacles_m)
    ]
    assert sum(bool((turn < 0.0).any()) for turn in turns) >= 3
