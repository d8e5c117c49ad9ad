"""Tables of methods: a row more is a method more, everywhere that methods are named."""

from types import MappingProxyType

import numpy as np
import pytest

import wifipgo.radio.aoa.estimators as aoa_estimators
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


def test_every_estimator_says_what_it_is() -> None:
    assert all(row.meaning for row in aoa.ESTIMATORS.values())
