"""People in the way: the knife edges of TR 38.901, the geometry of a leg, walks that stay in the room."""

import numpy as np
import pytest

from wifipgo.radio.propagation.materials import SPEED_OF_LIGHT_M_S, Slab
from wifipgo.radio.propagation.passing_bodies import RADIUS_M, Bodies, behind_bodies, draw_bodies
from wifipgo.radio.propagation.paths import reverse, surfaces_of, trace_paths

CARRIER_HZ = 5.0e9
TX_M, RX_M = np.array([[2.0, 2.0]]), np.array([[10.0, 2.0]])
WALLS_M = np.array([[[0, 0], [20, 0]], [[20, 0], [20, 8]], [[20, 8], [0, 8]], [[0, 8], [0, 0]]], dtype=float)


def left_of(body_m: tuple[float, float], *, order: int = 0) -> np.ndarray:
    """Share of amplitude that a body leaves of every path of a link along a wall."""
    room = surfaces_of(WALLS_M, carrier_hz=CARRIER_HZ, wall=Slab())
    paths = trace_paths(TX_M, RX_M, room, carrier_hz=CARRIER_HZ, max_order=order)
    weaker = behind_bodies(paths, TX_M, RX_M, np.array([[body_m]]), carrier_hz=CARRIER_HZ)
    back = behind_bodies(reverse(paths), RX_M, TX_M, np.array([[body_m]]), carrier_hz=CARRIER_HZ)
    np.testing.assert_allclose(back.gain, weaker.gain, rtol=1e-9)
    return np.abs(weaker.gain / paths.gain)[0]


def test_a_body_in_the_middle_costs_what_the_model_says() -> None:
    """Both edges alike: 1 - 2 atan(pi / 2 sqrt(pi / lambda (D1 + D2 - r))) / pi, by hand."""
    detour_m = 2.0 * np.hypot(4.0, RADIUS_M) - 8.0
    depth = np.arctan(np.pi / 2.0 * np.sqrt(np.pi * detour_m * CARRIER_HZ / SPEED_OF_LIGHT_M_S)) / np.pi
    assert left_of((6.0, 2.0))[0] == pytest.approx(1.0 - 2.0 * depth, rel=1e-9)


def test_amplitude_falls_to_a_half_at_the_edge_and_comes_back() -> None:
    """With the edge on the line, the near edge lets half through, the far one nearly all that is left."""
    away = np.array([left_of((6.0, 2.0 + y))[0] for y in np.linspace(0.0, 5.9, 60)])
    at_edge = left_of((6.0, 2.0 + RADIUS_M))[0]
    assert 0.5 < at_edge < 0.75
    assert np.all(np.diff(away) > -1e-12)
    assert away[-1] == pytest.approx(1.0, abs=0.01)


def test_only_the_leg_that_it_stands_on() -> None:
    """The echo off the upper wall turns at (6, 8): beside that turn only it is weaker, behind an end none."""
    names = ("sight", "lower", "right", "upper", "left")
    left = dict(zip(names, left_of((7.0, 6.5), order=1), strict=True))
    assert left["upper"] < 0.5
    assert min(left["sight"], left["lower"]) > 0.95
    np.testing.assert_array_equal(left_of((13.0, 2.0))[0], 1.0)


def test_walks_stay_in_the_room_and_are_as_long_as_stated() -> None:
    bodies = draw_bodies(count=5, step_m=1.5, size_m=10.0, rng=np.random.default_rng(2), n_worlds=3)
    at_m = np.stack([bodies.at(t) for t in range(40)])
    assert np.all((at_m >= 0.0) & (at_m <= 10.0))
    step_m = np.hypot(*np.moveaxis(np.diff(at_m, axis=0), -1, 0))
    assert np.median(step_m) == pytest.approx(1.5)
    assert step_m.max() <= 1.5 + 1e-9
    turned_back = Bodies(np.array([[[9.0, 5.0]]]), np.array([[[2.0, 0.0]]]), 10.0)
    np.testing.assert_allclose(turned_back.at(1), [[[9.0, 5.0]]])
