"""Conduct of teams: measures counted by hand, worlds that ended early, and why a policy is below."""

from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

from baselines.conduct.conduct import Conduct, conduct_of
from baselines.conduct.failures import furthest_below, shortfalls, usual_world
from baselines.conduct.findings import Findings
from baselines.conduct.measures import error_by_distance, longest_apart, met_within, since_met
from baselines.conduct.tables import score_table, shortfall_table
from baselines.evaluation.episodes import Episode
from baselines.suite.definition import Part, Suite
from wifipgo.scenarios import SCENARIOS

N_STEPS = 6


def met_at(*robots: set[int]) -> np.ndarray:
    """One world: iterations at which each robot met."""
    return np.array([[[t in those for those in robots] for t in range(1, N_STEPS + 1)]])


@pytest.mark.parametrize(
    ("robots", "apart", "since"),
    [
        ([set(), set()], 6.0, 6.0),
        ([{6}, {6}], 5.0, 0.0),
        ([{2, 3}, {2}], (3 + 4) / 2, (3 + 4) / 2),
        ([{1, 2, 3, 4, 5, 6}, {1}], (0 + 5) / 2, (0 + 5) / 2),
        ([{4}, set()], (3 + 6) / 2, (2 + 6) / 2),
    ],
)
def test_times_between_meetings(robots: list[set[int]], apart: float, since: float) -> None:
    met = met_at(*robots)
    assert longest_apart(met).tolist() == [apart]
    assert since_met(met).tolist() == [since]


def test_meetings_within_windows() -> None:
    """Windows of four iterations and of the two that are left; twice in one counts once."""
    np.testing.assert_array_equal(met_within(met_at({1, 2}, {6}), 4), [[0.5, 0.5]])


def conduct(**arrays: Any) -> Conduct:
    """Worlds, robots and iterations of the arrays that are given; all else is zero."""
    n_worlds = len(next(iter(arrays.values())))
    shape = (n_worlds, N_STEPS, 2)
    nothing: dict[str, Any] = {name: np.zeros(shape) for name in Conduct._fields}
    nothing |= {name: np.zeros(shape, dtype=bool) for name in ("met", "calling")}
    nothing |= {name: np.zeros(shape[:2]) for name in ("mapped", "seen")}
    return Conduct(**nothing | arrays)


def test_errors_by_distance_are_means_over_robots_and_iterations() -> None:
    rng = np.random.default_rng(0)
    from_start_m, error_m = rng.uniform(0.0, 5.0, (3, N_STEPS, 2)), rng.uniform(0.0, 1.0, (3, N_STEPS, 2))
    from_start_m[1] = np.minimum(from_start_m[1], 1.5)
    edges_m = np.array([0.0, 2.0, 4.0])
    found = error_by_distance(conduct(from_start_m=from_start_m, error_m=error_m), edges_m)
    for world in range(3):
        for k in range(2):
            inside = (edges_m[k] <= from_start_m[world]) & (from_start_m[world] < edges_m[k + 1])
            expected = error_m[world][inside].mean() if inside.any() else np.nan
            assert found[world, k] == pytest.approx(expected, nan_ok=True)
    assert np.isnan(found[1, 1])


def test_a_world_that_ended_early_stays_as_it_ended() -> None:
    """Robot 0 drives along x from (1, 1), and believes to be 0.5 m beside; robot 1 stands and calls."""
    n = 3
    along = np.arange(1.0, n + 1.0)
    one = np.ones((n, 1))
    steps = {
        "x_true_m": np.hstack([1.0 + along[:, None], 5.0 * one]),
        "y_true_m": np.hstack([one, 5.0 * one]),
        "x_estimate_m": np.hstack([1.0 + along[:, None], 5.0 * one]),
        "y_estimate_m": np.hstack([1.5 * one, 5.0 * one]),
        "mapped_share": np.hstack([0.1 * along[:, None]] * 2),
        "coverage": np.hstack([0.2 * along[:, None]] * 2),
        "met": np.ones((n, 2), dtype=bool),
        "calling": np.array([[False, True]] * n),
        "distance_m": np.hstack([along[:, None], 0.0 * one]),
        "bumps": np.zeros((n, 2), dtype=np.int64),
    }
    reference = np.array([[[1.0, 1.0, 0.0]], [[5.0, 5.0, 0.0]]])
    episode = object.__new__(Episode)
    for name, value in (("steps", steps), ("reference", reference)):
        object.__setattr__(episode, name, value)
    found = conduct_of([episode], N_STEPS)
    np.testing.assert_allclose(found.mapped[0], [0.1, 0.2, 0.3, 0.3, 0.3, 0.3])
    np.testing.assert_allclose(found.seen[0], [0.2, 0.4, 0.6, 0.6, 0.6, 0.6])
    np.testing.assert_allclose(found.from_start_m[0].T, [[1, 2, 3, 3, 3, 3], [0] * 6])
    np.testing.assert_allclose(found.error_m[0].T, [[0.5] * 6, [0.0] * 6])
    assert found.met[0].sum(axis=0).tolist() == [3, 3]
    assert found.calling[0].sum(axis=0).tolist() == [0, 3]
    assert found.driven_m[0, -1].tolist() == [3.0, 0.0]


@pytest.fixture
def findings() -> Findings:
    """Four worlds: better; lost, never met; saw less, met twice; as good."""
    n = 4
    full = np.ones((n, N_STEPS))
    met = np.zeros((n, N_STEPS, 2), dtype=bool)
    met[2, [1, 4]] = True
    rule = conduct(mapped=0.6 * full, seen=0.7 * full)
    mapped, seen = np.array([0.8, 0.3, 0.4, 0.6]), np.array([0.9, 0.7, 0.45, 0.7])
    policy = conduct(mapped=mapped[:, None] * full, seen=seen[:, None] * full, met=met)
    part = Part(SCENARIOS["paper-sim-2"], 6100, ("--scenario", "paper-sim-2", "--seed", "1"))
    suite = Suite(name="suite-v1", parts=MappingProxyType({"sim": part}), worlds=n)
    played = {"sim": {"rule": rule, "mine": policy, "mine without calls": rule}}
    return Findings(suite, "mine", "rule", ("mine without calls",), ("rule", "mine"), played)


def test_why_a_policy_is_below(findings: Findings) -> None:
    found = shortfalls(findings, "sim")
    assert found.below.tolist() == [False, True, True, False]
    np.testing.assert_allclose(found.points, [-20.0, 30.0, 20.0, 0.0], atol=1e-9)
    assert found.lost.tolist() == [False, True, False, False]
    assert found.never_met.tolist() == [False, True, False, False]
    assert shortfall_table(findings).splitlines()[-1] == "| sim | 2 of 4 | 25.0 | 1 | 1 | 1 |"


def test_the_worst_worlds_come_first_with_what_happened(findings: Findings) -> None:
    worst, second = furthest_below(findings, "sim", 3)
    assert (worst.trial, second.trial) == (1, 2)
    assert worst.seed == findings.suite.parts["sim"].seeds(range(4))[1]
    assert (round(worst.rule), round(worst.policy)) == (60, 30)
    assert (
        worst.told
        == "lost: 40 (10) % seen, but misplaced; off by 0.0 (0.0) m at the end; never met (0 times)"
    )
    assert second.told.startswith("saw less: 45 (70) %; drove 0 (0) m")
    assert second.told.endswith("met 2 (0) times, last at iteration 5")


def test_the_usual_world_has_the_median_difference(findings: Findings) -> None:
    """Differences 20, -30, -20 and 0, whose median is -10: two worlds are as near."""
    assert usual_world(findings, "sim").trial in {2, 3}


def test_scores_stand_beside_the_whole_policy(findings: Findings) -> None:
    head, _, rule, mine, without = score_table(findings).splitlines()
    assert head == "| mapped, % | sim |"
    assert rule.startswith("| rule | 60.0; +7.5 [")
    assert mine == "| mine | 52.5 |"
    assert without.startswith("| mine without calls | 60.0; +7.5 [")
