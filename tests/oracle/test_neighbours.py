"""Neighbours: what a tree finds is what measuring every pair finds, in the same order and to the bit."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from wifipgo.world import neighbours as module
from wifipgo.world.neighbours import neighbours
from wifipgo.world.sensing import robots_in_view, sight_robots


def both_ways(monkeypatch: pytest.MonkeyPatch, call: Callable[[], Any]) -> tuple[Any, Any]:
    """By a table of distances, and by a tree."""
    out = []
    for few in (10**9, 0):
        monkeypatch.setattr(module, "_FEW", few)
        out.append(call())
    return out[0], out[1]


@pytest.mark.parametrize("range_m", [0.0, 1.0, 2.2, 50.0])
@pytest.mark.parametrize("n_worlds", [1, 3])
def test_a_tree_finds_what_all_pairs_are(
    monkeypatch: pytest.MonkeyPatch, n_worlds: int, range_m: float
) -> None:
    """Some robots on a lattice of 1 m, where distances are exactly the range."""
    rng = np.random.default_rng(0)
    p_m = np.concatenate(
        [rng.integers(0, 9, (n_worlds * 30, 2)) * 1.0, rng.uniform(0, 9, (n_worlds * 30, 2))]
    )
    dense, tree = both_ways(monkeypatch, lambda: neighbours(p_m, 60, range_m))
    for a, b in zip(dense, tree, strict=True):
        np.testing.assert_array_equal(a, b)
    apart_m = np.hypot(*(p_m[:, None] - p_m).transpose(2, 0, 1))
    near = (apart_m <= range_m) & (np.arange(len(p_m))[:, None] // 60 == np.arange(len(p_m)) // 60)
    np.fill_diagonal(near, False)
    assert len(dense.row) == near.sum()


def test_sensors_show_the_same_by_tree(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(1)
    poses = rng.uniform(0.0, 12.0, (50, 3))
    faces_m = rng.uniform(0.0, 12.0, (8, 2, 2))
    for call in (
        lambda: robots_in_view(poses, faces_m, range_m=2.2),
        lambda: sight_robots(poses, faces_m, range_m=6.0, rng=np.random.default_rng(0)),
    ):
        dense, tree = both_ways(monkeypatch, call)
        assert dense.any()
        np.testing.assert_array_equal(dense, tree)
