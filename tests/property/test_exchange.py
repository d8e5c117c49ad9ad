"""Meetings of several worlds in one iteration leave each world as it would be alone, to the bit."""

from typing import Any

import numpy as np
import pytest
from support.stacked_graphs import TeamGraph, stacked, team_graph

from wifipgo.graph.anchor_bearings import NO_PINGS
from wifipgo.loop.exchange import exchange
from wifipgo.loop.routes import LOWEST_MBIT_S, routed_mbit_s
from wifipgo.rendezvous import Calls
from wifipgo.rows import Generators
from wifipgo.scenarios import Scenario, scenario_named
from wifipgo.state import MeasurementLog, Paths, Team

N, KAPPA = 3, 3
TEAMS = [team_graph(seed, n_times=6, n_met=6) for seed in range(3)]
PAIRS = [[(0, 1)], [], [(0, 2), (1, 2)]]  # of each world, that are due


def state(graph: TeamGraph, worlds: list[int]) -> tuple[Paths, MeasurementLog, Team, np.ndarray]:
    """What some worlds believe when meetings are due."""
    rng = np.random.default_rng(0)
    observed, held = np.zeros((2, len(TEAMS) * N, N), dtype=int)
    rate, callee = np.zeros((len(TEAMS) * N, N)), rng.integers(-1, N, len(TEAMS) * N)
    for k, pairs in enumerate(PAIRS):
        for i, j in pairs:
            for a, b in ((i, j), (j, i)):
                observed[k * N + a, b], rate[k * N + a, b] = KAPPA, 1e3
                held[k * N + a, b] = 1 + a + b
    rows = np.concatenate([np.arange(k * N, (k + 1) * N) for k in worlds])
    n, times = graph.poses.shape[:2]
    cov = np.zeros((n, times, 3, 3))
    team = Team(
        calls=Calls(callee[rows], np.ones(n)),
        observed=observed[rows],
        held=held[rows],
        last_met=np.zeros(n, dtype=int),
        met=(),
        bytes_sent=np.arange(len(worlds)) * 0,
        airtime_s=np.zeros(len(worlds)),
        under_way_bytes=np.zeros(rate[rows].shape),
    )
    log = MeasurementLog(graph.edges, graph.bearings, NO_PINGS)
    return Paths(graph.poses, cov[:, -1], cov, cov), log, team, rate[rows]


def held(worlds: list[int], scenario: Scenario) -> tuple[Paths, MeasurementLog, Team]:
    """The meetings that are due in some worlds."""
    paths, log, team, rate = state(stacked([TEAMS[k] for k in worlds]), worlds)
    rng = Generators([np.random.default_rng(k) for k in worlds])
    return exchange(paths, log, team, rate, scenario=scenario, rng=rng)


@pytest.mark.parametrize(
    "how",
    [
        {},
        {"outliers": "bearing"},
        {"backend": "distributed", "message_loss": 0.3},
        {"estimator": "every_step"},
    ],
    ids=str,
)
def test_a_world_among_others_meets_as_alone(how: dict[str, Any]) -> None:
    scenario = scenario_named("paper-sim-2", n_robots=N, kappa=KAPPA, **how)
    paths, log, team = held([0, 1, 2], scenario)
    assert team.met == ((0, 1), (6, 7, 8))
    for k in range(len(TEAMS)):
        rows = slice(k * N, (k + 1) * N)
        own_paths, own_log, own_team = held([k], scenario)
        np.testing.assert_array_equal(paths.estimate[rows], own_paths.estimate)
        np.testing.assert_array_equal(paths.covariance[rows], own_paths.covariance)
        mine = log.edges.tail[:, 0] // N == k
        np.testing.assert_array_equal(log.edges.reported_pose[mine], own_log.edges.reported_pose)
        for name in ("observed", "held", "last_met"):
            np.testing.assert_array_equal(getattr(team, name)[rows], getattr(own_team, name))
        np.testing.assert_array_equal(team.calls.callee[rows], own_team.calls.callee)
        assert team.bytes_sent[k] == own_team.bytes_sent[0]
        assert team.airtime_s[k] == own_team.airtime_s[0]
    assert (team.bytes_sent > 0).tolist() == [True, False, True]


def test_what_a_meeting_loses_does_not_depend_on_the_meetings_before() -> None:
    """Streams go on alike whoever meets, so robots that meet then lose the same messages."""
    scenario = scenario_named("paper-sim-2", n_robots=N, kappa=KAPPA, backend="distributed", message_loss=0.3)
    paths, log, team, rate = state(stacked(TEAMS), [0, 1, 2])
    nobody = np.zeros_like(rate)
    found = []
    for before in (rate, nobody):
        rng = Generators([np.random.default_rng(k) for k in range(len(TEAMS))])
        exchange(paths, log, team, before, scenario=scenario, rng=rng)
        found.append(exchange(paths, log, team, rate, scenario=scenario, rng=rng)[2].bytes_sent)
    np.testing.assert_array_equal(found[0], found[1])


@pytest.mark.parametrize("backend", ["distributed", "two_level"])
def test_messages_take_the_time_of_the_links_where_robots_meet(backend: str) -> None:
    """At half the rate the same poses and bytes, and twice the time beside that of packets' preambles."""
    scenario = scenario_named("paper-sim-2", n_robots=N, kappa=KAPPA, backend=backend, q_mbit_s=1.0)
    paths, log, team, rate = state(stacked(TEAMS[:1]), [0])
    found = []
    for share in (0.02, 0.01, 0.005):
        rng = Generators([np.random.default_rng(0)])
        found.append(exchange(paths, log, team, share * rate, scenario=scenario, rng=rng))
    for k in (1, 2):
        np.testing.assert_array_equal(found[k][0].estimate, found[0][0].estimate)
        np.testing.assert_array_equal(found[k][2].bytes_sent, found[0][2].bytes_sent)
    airtime_s = [team.airtime_s for *_, team in found]
    np.testing.assert_allclose(airtime_s[2] - airtime_s[1], 2.0 * (airtime_s[1] - airtime_s[0]))
    assert airtime_s[0] > 0.0


def test_who_is_out_of_reach_is_relayed() -> None:
    """Two links of 10 and 40 Mb/s in a row carry 8; a detour that is quicker than a slow link is taken."""
    rate = np.zeros((6, 3))
    rate[3:] = [[0.0, 10.0, 0.0], [10.0, 0.0, 40.0], [0.0, 40.0, 0.0]]
    assert routed_mbit_s(rate, [3, 4, 5])(3, 5) == pytest.approx(8.0)
    rate[3, 2] = rate[5, 0] = 2.0
    assert routed_mbit_s(rate, [3, 4, 5])(5, 3) == pytest.approx(8.0)
    assert routed_mbit_s(rate, [3, 5])(5, 3) == pytest.approx(2.0)
    assert routed_mbit_s(rate, [0, 1])(0, 1) == LOWEST_MBIT_S
