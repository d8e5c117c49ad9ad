"""Tables of methods: a row more is a method more, everywhere that methods are named."""

from collections.abc import Sequence
from types import MappingProxyType

import numpy as np
import pytest

import wifipgo.graph.config
import wifipgo.loop.exchange
import wifipgo.radio.aoa.estimators as aoa_estimators
from baselines.reproduce.encounters import EncounterConfig, simulate_encounter
from wifipgo.errors import BadInputError
from wifipgo.graph.backends import BACKENDS, Backend, Solution
from wifipgo.graph.config import GraphConfig
from wifipgo.graph.distributed.channel import Channel, Message
from wifipgo.graph.losses import LOSSES
from wifipgo.graph.outliers.methods import GATES, Gate, OutlierMethod, solve_robust
from wifipgo.graph.solvers import _searches
from wifipgo.loop.first_tick import start
from wifipgo.radio import aoa
from wifipgo.scenarios.lookup import scenario_named
from wifipgo.streams import Streams


def phase_slope(csi: np.ndarray) -> np.ndarray:
    """Products of the antennas, whose phase turns with the heading."""
    return (csi[:, 0] * csi[:, 1].conj()).sum(axis=-1)


def line(signal: np.ndarray, steering: np.ndarray, cfg: aoa.AoaConfig) -> np.ndarray:
    """One line at the direction whose steering vector fits best: directions, and no spectrum."""
    profile = np.zeros((len(signal), steering.shape[1]), np.float32)
    heard = signal.any(axis=1)
    best = np.abs(signal.conj() @ steering).argmax(axis=1)
    profile[np.flatnonzero(heard), best[heard]] = 1.0
    return profile


def test_an_aoa_estimator_that_finds_directions_is_one_row(monkeypatch: pytest.MonkeyPatch) -> None:
    row = aoa.Estimator(snapshots=phase_slope, spectrum=line, least_packets=lambda cfg: 5, meaning="a line")
    rows = MappingProxyType({**aoa.ESTIMATORS, "line": row})
    monkeypatch.setattr(aoa_estimators, "ESTIMATORS", rows)
    found = {}
    for name in ("line", "product"):
        scenario = scenario_named("paper-hw-2", n_steps=2, aoa_estimator=name)
        _, tick = start(scenario, Streams.for_episode(3, 0))
        found[name] = tick.belief.radio.profile
    loud = found["product"].any(axis=-1)
    assert loud.any()
    assert (np.count_nonzero(found["line"], axis=-1) == loud).all()
    peaks = {name: aoa.find_peaks(profile[loud], n_peaks=1) for name, profile in found.items()}
    off = np.angle(np.exp(1j * (peaks["line"].azimuth_rad - peaks["product"].azimuth_rad)))
    np.testing.assert_allclose(off, 0.0, atol=np.deg2rad(3.0))


def stay(
    poses: np.ndarray,
    *_: object,
    groups: Sequence[Sequence[int]],
    channels: Sequence[Channel],
    **__: object,
) -> list[Solution]:
    """Send a message a robot, and leave poses as they are."""
    for group, channel in zip(groups, channels, strict=True):
        for robot in group:
            channel.send(robot, Message(robot, "poses", 0, np.zeros((1, 3, 1))))
    return [Solution(poses[list(group)], None) for group in groups]


def test_a_back_end_is_one_row(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = {**BACKENDS, "stay": Backend(solve=stay, sends=True, bearings=False, meaning="nobody moves")}
    for module in (wifipgo.graph.config, wifipgo.loop.exchange):
        monkeypatch.setattr(module, "BACKENDS", MappingProxyType(rows))
    with pytest.raises(BadInputError, match="without bearings with the stay backend"):
        GraphConfig(backend="stay", outliers="bearing")
    scenario = scenario_named("paper-hw-2", n_steps=2, backend="stay", message_loss=0.2)
    _, tick = start(scenario, Streams.for_episode(3, 0))
    believed, channel = tick.belief, Channel(loss=0.2, rng=np.random.default_rng(0))
    meetings = wifipgo.loop.exchange._meet(
        believed.paths, believed.log, believed.team, [[0, 1]], cfg=scenario.graph, channels=[channel]
    )
    assert meetings.served == (True,)
    assert (meetings.bytes_sent >= 2 * 24).all()
    np.testing.assert_array_equal(meetings.paths.estimate, believed.paths.estimate)


def test_a_gate_is_one_row() -> None:
    """It may judge by direction, as measurements come, or by agreement, when robots meet."""
    world = simulate_encounter(EncounterConfig(n_outliers=2), rng=np.random.default_rng(0))
    nothing = Gate(name="nothing", by_agreement=lambda edges, *, n_robots: ~edges.between_robots)
    half = Gate(name="half", by_direction=lambda z, *_, sigma_rad, gate_rad: np.full(len(z), 0.5))
    for gate, weight in ((nothing, 0.0), (half, 0.5)):
        method = OutlierMethod(gate=gate)
        _, report = solve_robust(world.start, world.edges, world.bearings, robots=[0, 1], outliers=method)
        (down,) = report.downweighted
        assert down.method == gate.name
        assert method.at_rendezvous().gate.by_direction is None
        np.testing.assert_array_equal(down.rows, np.flatnonzero(world.edges.between_robots))
        np.testing.assert_array_equal(down.weight, weight)


def test_every_loss_has_a_search() -> None:
    assert set(_searches._SEARCHES) == set(LOSSES)


def test_every_row_says_what_it_is() -> None:
    for table in (aoa.ESTIMATORS, BACKENDS, LOSSES):
        assert all(row.meaning for row in table.values())
    assert len({gate.name for gate in GATES}) == len(GATES)
