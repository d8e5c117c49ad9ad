"""Pings: what one sender says again and again counts little more than what it said once."""

import numpy as np
import pytest

from wifipgo.graph.anchor_bearings import NO_PINGS, Pings, extended_pings
from wifipgo.loop.aoa_measurements import Heard, pings_of
from wifipgo.radio.aoa.peaks import Peaks
from wifipgo.rendezvous import NOBODY
from wifipgo.scenarios import Scenario, scenario_named
from wifipgo.state import Paths
from wifipgo.world.sensing import RelativePoses

N = 3  # robots of each of two worlds
KNOWN_M2 = np.array([[0.2, 0.05], [0.05, 0.1]])


def heard(slots: list[list[int]]) -> Heard:
    """Everybody hears whom it listens to, loudly, straight ahead."""
    table, row = np.array(slots), np.full((2 * N, N), NOBODY)
    robot, slot = np.nonzero(table != NOBODY)
    row[robot, table[robot, slot]] = np.arange(len(robot))
    peaks = Peaks(np.zeros((len(robot), 1)), np.ones((len(robot), 1)))
    return Heard(table, np.zeros((2 * N, 2, 4)), row, np.zeros((len(robot), 4)), peaks)


def paths(t: int) -> Paths:
    covariance = np.tile(np.eye(3), (2 * N, 1, 1))
    covariance[:, :2, :2] = KNOWN_M2
    history = np.zeros((2 * N, t + 1, 3, 3))
    return Paths(np.zeros((2 * N, t + 1, 3)), covariance, history, history)


def in_view(pairs: list[tuple[int, int]], t: int) -> RelativePoses:
    ends = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    tail, head = (np.column_stack([ends[:, k], np.full(len(ends), t)]) for k in (0, 1))
    n = len(ends)
    return RelativePoses(tail, head, np.zeros((n, 3)), np.ones((n, 2)), np.zeros(n, dtype=bool))


def factors(**fields: str) -> Scenario:
    return scenario_named("paper-sim-2", n_robots=N, estimator="every_step", aoa_factors=True, **fields)


def test_the_kth_ping_of_a_sender_counts_a_kth() -> None:
    """Counted by pair: others that are heard, in the same world or another, change nothing."""
    x, pings = NOBODY, NO_PINGS
    turns = [
        [[1, x], [x, x], [x, x], [1, x], [x, x], [x, x]],
        [[2, x], [x, x], [0, x], [1, 2], [x, x], [x, x]],
        [[1, 2], [0, x], [x, x], [1, x], [x, x], [x, x]],
    ]
    times = {(0, 1): [1, 2], (3, 4): [1, 2, 3], (0, 2): [1, 2], (2, 0): [1], (3, 5): [1], (1, 0): [1]}
    for t, slots in enumerate(turns):
        more = pings_of(heard(slots), pings, in_view([], t), paths(t), factors())
        pings = extended_pings(pings, more)
    assert len(pings.sender) == sum(map(len, times.values()))
    for (observer, sender), counts in times.items():
        own = (pings.observer[:, 0] == observer) & (pings.sender == sender)
        told_m2 = KNOWN_M2 + 1e-4 * np.eye(2)
        np.testing.assert_allclose(pings.covariance_m2[own], np.array(counts)[:, None, None] * told_m2)


@pytest.mark.parametrize(("outliers", "n_pings"), [("none", 2), ("bearing", 1)])
def test_a_direction_is_not_taken_twice(outliers: str, n_pings: int) -> None:
    """Of a robot in view it is a bearing already, where the outlier method has a use for it."""
    x = NOBODY
    slots = [[1, 2], [x, x], [x, x], [x, x], [x, x], [x, x]]
    found: Pings = pings_of(
        heard(slots), NO_PINGS, in_view([(0, 1)], 0), paths(0), factors(outliers=outliers)
    )
    assert found.sender.tolist() == [1, 2][2 - n_pings :]
