"""Polygons of any shape against shapes made of squares, whose every property is a count of cells."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from support.polyominoes import grown, outline, solid

from wifipgo.world.map_checks import check_apart
from wifipgo.world.polygons import area_m2, convex_parts, inside_polygon, is_simple

seeds = st.integers(0, 100_000)
Point = tuple[int, int]


def with_straight_corners(corners: np.ndarray) -> np.ndarray:
    """The same shape, with one more corner in the middle of every edge."""
    return np.stack([corners, (corners + np.roll(corners, -1, axis=0)) / 2.0], axis=1).reshape(-1, 2)


def turned(corners: np.ndarray, by_rad: float) -> np.ndarray:
    cos, sin = np.cos(by_rad), np.sin(by_rad)
    return corners @ np.array([[cos, sin], [-sin, cos]])


@given(seed=seeds, n=st.integers(1, 14), first=st.integers(0, 40), backwards=st.booleans())
def test_inside_is_what_the_cells_say(seed: int, n: int, first: int, backwards: bool) -> None:
    """Random points, and all that are on edges, at corners and level with them."""
    rng = np.random.default_rng(seed)
    cells = grown(rng, n, 5)
    corners = np.roll(np.array(outline(cells)), first, axis=0)[:: -1 if backwards else 1]
    halves = np.arange(-1.0, 6.5, 0.5)
    points = np.concatenate(
        [rng.uniform(-1.0, 6.0, (60, 2)), np.stack(np.meshgrid(halves, halves), -1).reshape(-1, 2)]
    )
    np.testing.assert_array_equal(inside_polygon(points, corners), solid(points, cells))


@settings(max_examples=60)
@given(seed=seeds, n=st.integers(1, 20), straight=st.booleans(), by_rad=st.floats(0.0, 6.0))
def test_convex_parts_fill_the_polygon_once(seed: int, n: int, straight: bool, by_rad: float) -> None:
    rng = np.random.default_rng(seed)
    cells = grown(rng, n, 6)
    corners = np.array(outline(cells))
    corners = turned(with_straight_corners(corners) if straight else corners, by_rad)
    parts = convex_parts(corners)
    assert area_m2(corners) == pytest.approx(len(cells))
    assert sum(map(area_m2, parts)) == pytest.approx(len(cells))
    for part in parts:
        assert ConvexHull(part).volume == pytest.approx(area_m2(part))  # in the plane, its area
        assert {tuple(corner) for corner in part.tolist()} <= {tuple(corner) for corner in corners.tolist()}
    points = rng.uniform(0.0, 6.0, (200, 2))
    n_parts = np.sum([inside_polygon(turned(points, by_rad), part) for part in parts], axis=0)
    np.testing.assert_array_equal(n_parts, solid(points, cells))


def test_a_convex_polygon_is_its_own_part() -> None:
    corners = np.array(outline({(0, 0), (1, 0)}))
    (part,) = convex_parts(corners)
    np.testing.assert_array_equal(part, corners)


@given(seed=seeds, n=st.integers(1, 9))
def test_overlap_is_a_shared_cell(seed: int, n: int) -> None:
    """Among them many that only touch, or lie in each other's notches."""
    rng = np.random.default_rng(seed)
    a, b = grown(rng, n, 5), grown(rng, 10 - n, 5)
    try:
        check_apart([outline(a), outline(b)])
        overlap = False
    except ValueError as problem:
        overlap = "obstacles_m[1] must be clear of ArenaConfig.obstacles_m[0]" in str(problem)
    assert overlap == bool(a & b)


def side(a: Point, b: Point, c: Point) -> int:
    """Of the line from a to b on which c lies: 1 left, -1 right, 0 on it."""
    area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    return (area > 0) - (area < 0)


def meet(a: Point, b: Point, c: Point, d: Point) -> bool:
    """Whether two closed segments share a point, in whole numbers."""
    if side(a, b, c) != side(a, b, d) and side(c, d, a) != side(c, d, b):
        return True
    pairs = ((a, b, c), (a, b, d), (c, d, a), (c, d, b))
    return any(on_segment(start, end, point) for start, end, point in pairs)


def on_segment(a: Point, b: Point, p: Point) -> bool:
    low, high = np.minimum(a, b), np.maximum(a, b)
    return side(a, b, p) == 0 and bool((low <= p).all() and (p <= high).all())


def simple_in_whole_numbers(corners: list[Point]) -> bool:
    """Whether no two edges share a point but the corner between them."""
    n = len(corners)
    for i, j in itertools.combinations(range(n), 2):
        a, b, c, d = corners[i], corners[(i + 1) % n], corners[j], corners[(j + 1) % n]
        if b == c and (on_segment(a, b, d) or on_segment(c, d, a)):
            return False
        if d == a and (on_segment(c, d, b) or on_segment(a, b, c)):
            return False
        if b != c and d != a and meet(a, b, c, d):
            return False
    return all(corners[k - 1] != corners[k] for k in range(n))


@settings(max_examples=300)
@given(corners=st.lists(st.tuples(st.integers(0, 4), st.integers(0, 4)), min_size=3, max_size=7))
def test_simple_is_what_whole_numbers_say(corners: list[Point]) -> None:
    assert is_simple(np.array(corners, dtype=float)) == simple_in_whole_numbers(corners)
