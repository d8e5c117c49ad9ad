"""AOA measurements of an iteration: whom each robot listens to, and what that says about its measurements."""

import functools
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.graph.anchor_bearings import NO_PINGS, Pings
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.outliers.methods import OUTLIER_METHODS, direction_weights
from wifipgo.radio.aoa.estimators import AoaConfig
from wifipgo.radio.aoa.peaks import Peaks, find_peaks
from wifipgo.radio.channel.csi import RadioConfig
from wifipgo.radio.channel.impairments import EpisodeImpairments, link_chance
from wifipgo.radio.links import Links
from wifipgo.radio.turn_profiles import listen
from wifipgo.rendezvous import NOBODY, Calls, choose_slots
from wifipgo.rows import Chance, Rows
from wifipgo.scenarios.scenario import Scenario
from wifipgo.state import Paths
from wifipgo.world.sensing import RelativePoses, indices

_LEAST_M2 = 1e-4  # variance of a place that its robot takes for certain: 1 cm


_NO_PEAKS = Peaks(np.zeros((0, 1)), np.zeros((0, 1)))


class Heard(NamedTuple):
    """Profiles by slot and by link, and their peaks, found once.

    Attributes:
        slots: Peers that each robot listens to, `NOBODY` where empty.
        by_slot: Profile of each slot, zeros where empty.
        row: Link of a receiver and a peer that it hears, `NOBODY` where there is none.
        profile: Of each link.
        peaks: Of each link, if anything makes use of directions; else of none.
    """

    slots: Int[np.ndarray, "rows slots"]
    by_slot: Float[np.ndarray, "rows slots grid"]
    row: Int[np.ndarray, "rows peers"]
    profile: Float[np.ndarray, "links grid"]
    peaks: Peaks


def listen_to_team(
    links: Links,
    calls: Calls,
    seen: Bool[np.ndarray, "rows peers"],
    yaw_rad: Float[np.ndarray, " rows"],
    standing: EpisodeImpairments,
    *,
    scenario: Scenario,
    rng: Chance,
) -> Heard:
    """Profiles of every slot, and of every robot in view where they guard against outliers."""
    cfg, rows = scenario.graph, Rows.of(*seen.shape)
    slots = choose_slots(calls, links.rate_mbit_s, links.esnr_db, scenario.n_slots)
    wanted = seen & OUTLIER_METHODS[cfg.outliers].listens
    robot, slot = np.nonzero(slots != NOBODY)
    wanted[robot, slots[robot, slot]] = True
    receiver, peer = np.nonzero(wanted)
    row = np.full(seen.shape, NOBODY)
    row[receiver, peer] = np.arange(len(receiver))
    sender = receiver - rows.peer(receiver) + peer
    profile = _profiles(links, receiver, sender, yaw_rad, standing, scenario=scenario, rng=rng)
    by_slot = np.zeros((*slots.shape, scenario.turn.n_azimuths), dtype=np.float32)
    by_slot[robot, slot] = profile[row[robot, slots[robot, slot]]]
    made_use_of = cfg.aoa_factors or OUTLIER_METHODS[cfg.outliers].listens
    peaks = find_peaks(profile, n_peaks=scenario.turn.n_peaks) if made_use_of else _NO_PEAKS
    return Heard(slots, by_slot, row, profile, peaks)


def _profiles(
    links: Links,
    receiver: Int[np.ndarray, " links"],
    sender: Int[np.ndarray, " links"],
    yaw_rad: Float[np.ndarray, " rows"],
    standing: EpisodeImpairments,
    *,
    scenario: Scenario,
    rng: Chance,
) -> Float[np.ndarray, "links grid"]:
    """One profile for each link, in one product for each kind of antennas that a receiver carries."""
    rows = Rows.of(*links.rate_mbit_s.shape)
    chance = link_chance(rng, receiver, sender, rows=rows)
    hear = functools.partial(listen, links, yaw_rad=yaw_rad, standing=standing)
    if not scenario.turn.antenna_scale:
        return hear(receiver, sender, radio=scenario.radio, turn=scenario.turn, rng=chance)
    scale = np.array(scenario.turn.antenna_scale)[rows.peer(receiver)]
    profile = np.zeros((len(receiver), scenario.turn.n_azimuths), dtype=np.float32)
    for one in np.unique(scale).tolist():
        alike = np.flatnonzero(scale == one)
        radio, turn = _scaled(scenario.radio, scenario.turn, one)
        own = chance.some(alike)
        profile[alike] = hear(receiver[alike], sender[alike], radio=radio, turn=turn, rng=own)
    return profile


@functools.lru_cache(maxsize=64)
def _scaled(radio: RadioConfig, turn: AoaConfig, scale: float) -> tuple[RadioConfig, AoaConfig]:
    """Antennas further apart, or closer, by a factor."""
    if scale == 1.0:
        return radio, turn
    gap_m = scale * turn.antenna_gap_m
    return radio.scaled(scale), replace(turn, antenna_gap_m=gap_m, antenna_scale=())


def weights_of(others: RelativePoses, heard: Heard, scenario: Scenario) -> Float[np.ndarray, " edges"]:
    """Weights by a gate on direction, as Eq. 11's, from the peak closest to each report (Eq. 10).

    Where nothing was heard, nothing contradicts the measurement: its weight is 1.
    """
    cfg = scenario.graph
    guard = OUTLIER_METHODS[cfg.outliers]
    if not guard.by_direction or not len(others.z):
        return np.ones(len(others.z))
    peaks = _peaks_along(others, heard)
    weight = direction_weights(
        others.z,
        others.sigma,
        peaks.azimuth_rad,
        gate=guard.gate,
        sigma_rad=cfg.aoa_sigma_rad,
        gate_rad=cfg.aoa_gate_rad,
    )
    return np.where(peaks.height[:, 0] > 0.0, weight, 1.0)


def bearings_of(others: RelativePoses, heard: Heard, scenario: Scenario) -> Bearings:
    """Directions in which the robots that measured each other heard each other, if they are made use of."""
    cfg = scenario.graph
    if not OUTLIER_METHODS[cfg.outliers].bearings or not len(others.z):
        return Bearings.empty(scenario.turn.n_peaks)
    peaks = _peaks_along(others, heard)
    loud = peaks.height[:, 0] > 0.0
    return Bearings.measured(
        observer=others.tail[loud],
        target=others.head[loud],
        azimuth_rad=peaks.azimuth_rad[loud],
        sigma_rad=cfg.aoa_sigma_rad,
    )


def _peaks_along(others: RelativePoses, heard: Heard) -> Peaks:
    """Peaks of the link along each measurement."""
    peer = others.head[:, 0] % heard.row.shape[1]
    link = heard.row[others.tail[:, 0], peer]
    return Peaks(*(column[link] for column in heard.peaks))


def pings_of(heard: Heard, before: Pings, others: RelativePoses, paths: Paths, scenario: Scenario) -> Pings:
    """Directions of the robots in the slots, which say in each packet where they think they are.

    What one sender says at different times is nearly the same, and partly what it was told: the k-th ping of
    a sender counts a k-th, as places go, so that many are hardly surer than one. Where the outlier method
    takes the direction of a robot in view for a measurement, it is not taken twice.

    Args:
        heard: Profiles and their peaks.
        before: Pings so far.
        others: Robots in view, as measured.
        paths: What robots think where they are, and how well they know.
        scenario: Says whether pings are made use of.
    """
    if not scenario.graph.aoa_factors:
        return NO_PINGS
    n, (robot, slot) = heard.row.shape[1], np.nonzero(heard.slots != NOBODY)
    peer = heard.slots[robot, slot]
    peaks = Peaks(*(column[heard.row[robot, peer]] for column in heard.peaks))
    taken = np.zeros(heard.row.shape, dtype=bool)
    if OUTLIER_METHODS[scenario.graph.outliers].bearings:
        taken[others.tail[:, 0], others.head[:, 0] % n] = True
    new = (peaks.height[:, 0] > 0.0) & ~taken[robot, peer]
    robot, peer = robot[new], peer[new]
    other = robot - robot % n + peer
    n_heard = 1 + np.bincount(before.observer[:, 0] * n + before.sender % n, minlength=heard.row.size)
    own_m2 = paths.covariance[other, :2, :2] + _LEAST_M2 * np.eye(2)
    return Pings(
        observer=indices(robot, paths.t),
        sender=other,
        azimuth_rad=peaks.azimuth_rad[new, 0],
        sigma_rad=np.full(len(robot), scenario.graph.aoa_sigma_rad),
        point_m=paths.estimate[other, -1, :2],
        covariance_m2=n_heard[robot * n + peer, None, None] * own_m2,
    )
