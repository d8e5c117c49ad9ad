"""Boxes that meet: sorted and swept they are those of looking at all pairs."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wifipgo.segments import crossings
from wifipgo.world import boxes as module
from wifipgo.world.boxes import bounds, meeting
from wifipgo.world.layout import padded
from wifipgo.world.line_of_sight import in_sight, in_sight_from


def scene(seed: int, n_worlds: int) -> tuple[np.random.Generator, np.ndarray]:
    """Short edges on a lattice, so that many boxes just touch, some as wide as the room, and padding."""
    rng = np.random.default_rng(seed)
    each = []
    for _ in range(n_worlds):
        start_m = rng.integers(0, 20, (rng.integers(0, 40), 2)) * 1.0
        short = np.stack([start_m, start_m + rng.integers(-2, 3, start_m.shape)], axis=1)
        wide = rng.uniform(0.0, 20.0, (rng.integers(0, 4), 2, 2))
        each.append(np.concatenate([short, wide]))
    each[0] = np.concatenate([each[0], rng.uniform(0.0, 20.0, (1, 2, 2))])
    return rng, padded(each)


@settings(max_examples=60)
@given(st.integers(0, 10_000), st.integers(1, 4))
def test_a_sweep_finds_what_all_pairs_are(seed: int, n_worlds: int) -> None:
    rng, edges_m = scene(seed, n_worlds)
    low_m = rng.integers(0, 20, (30, 2)) * 1.0
    high_m, world = low_m + rng.integers(0, 3, (30, 2)), rng.integers(0, n_worlds, 30)
    found = []
    with pytest.MonkeyPatch.context() as patch:
        for few in (10**9, 0):
            patch.setattr(module, "_FEW", few)
            row, edge = meeting(low_m, high_m, bounds(edges_m), world)
            assert (np.diff(row) >= 0).all()
            found.append(sorted(zip(row.tolist(), edge.tolist(), strict=True)))
    assert found[0] == found[1]


@pytest.mark.parametrize("few", [10**9, 0])
@settings(max_examples=40)
@given(st.integers(0, 10_000), st.integers(1, 3))
def test_lines_of_sight_are_those_past_every_edge(few: int, seed: int, n_worlds: int) -> None:
    rng, edges_m = scene(seed, n_worlds)
    p_m = rng.uniform(0.0, 20.0, (4 * n_worlds, 2))
    row = np.repeat(np.arange(len(p_m)), 6)
    end_m = p_m[row] + rng.uniform(-2.0, 2.0, (len(row), 2))
    clear = ~crossings(p_m[row], end_m, edges_m[row // 4]).any(axis=1)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "_FEW", few)
        np.testing.assert_array_equal(in_sight(p_m[row], end_m, edges_m, row // 4), clear)
        np.testing.assert_array_equal(in_sight_from(p_m, row, end_m, edges_m, 3.0), clear)
