"""Whom each robot listens to in an iteration, and what that says about its measurements."""

import functools
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.graph import GUARDS, NO_PINGS, Bearings, Pings, direction_weights
from wifipgo.radio.aoa import AoaConfig, find_peaks
from wifipgo.radio.channel.csi import RadioConfig
from wifipgo.radio.channel.impairments import Standing
from wifipgo.radio.turn_profiles import Links, listen
from wifipgo.rendezvous import NOBODY, Calls, choose_slots
from wifipgo.scenarios import Scenario
from wifipgo.state import Belief
from wifipgo.world.sensing import RelativePoses, indices

_LEAST_M2 = 1e-4  # variance of a place that its robot takes for certain: 1 cm


class Listening(NamedTuple):
    """Profiles by slot and by link; ``row`` finds the link of a receiver and a sender."""

    slots: Int[np.ndarray, "robots slots"]
    by_slot: Float[np.ndarray, "robots slots grid"]
    row: Int[np.ndarray, "robots robots"]
    profile: Float[np.ndarray, "links grid"]


def listened(
    links: Links,
    calls: Calls,
    seen: Bool[np.ndarray, "robots robots"],
    yaw_rad: Float[np.ndarray, " robots"],
    standing: Standing,
    *,
    scenario: Scenario,
    rng: np.random.Generator,
) -> Listening:
    """Profiles of every slot, and of every robot in view where they guard against outliers."""
    n = len(yaw_rad)
    slots = choose_slots(calls, links.rate_mbit_s, links.esnr_db, scenario.n_slots)
    wanted = seen & GUARDS[scenario.rendezvous.outliers].listens
    robot, slot = np.nonzero(slots != NOBODY)
    wanted[robot, slots[robot, slot]] = True
    receiver, sender = np.nonzero(wanted)
    row = np.full((n, n), NOBODY)
    row[receiver, sender] = np.arange(len(receiver))
    profile = _profiles(links, receiver, sender, yaw_rad, standing, scenario=scenario, rng=rng)
    by_slot = np.zeros((*slots.shape, scenario.turn.n_azimuths), dtype=np.float32)
    by_slot[robot, slot] = profile[row[robot, slots[robot, slot]]]
    return Listening(slots, by_slot, row, profile)


def _profiles(
    links: Links,
    receiver: Int[np.ndarray, " links"],
    sender: Int[np.ndarray, " links"],
    yaw_rad: Float[np.ndarray, " robots"],
    standing: Standing,
    *,
    scenario: Scenario,
    rng: np.random.Generator,
) -> Float[np.ndarray, "links grid"]:
    """One profile for each link, in one product for each kind of antennas that a receiver carries."""
    hear = functools.partial(listen, links, yaw_rad=yaw_rad, rng=rng, standing=standing)
    if not scenario.turn.antenna_scale:
        return hear(receiver, sender, radio=scenario.radio, turn=scenario.turn)
    scale = np.array(scenario.turn.antenna_scale)[receiver]
    profile = np.zeros((len(receiver), scenario.turn.n_azimuths), dtype=np.float32)
    for one in np.unique(scale).tolist():
        rows = np.flatnonzero(scale == one)
        radio, turn = _scaled(scenario.radio, scenario.turn, one)
        profile[rows] = hear(receiver[rows], sender[rows], radio=radio, turn=turn)
    return profile


@functools.lru_cache(maxsize=64)
def _scaled(radio: RadioConfig, turn: AoaConfig, scale: float) -> tuple[RadioConfig, AoaConfig]:
    """Antennas further apart, or closer, by a factor."""
    if scale == 1.0:
        return radio, turn
    gap_m = scale * turn.antenna_gap_m
    return radio.scaled(scale), replace(turn, antenna_gap_m=gap_m, antenna_scale=())


def weights_of(others: RelativePoses, heard: Listening, scenario: Scenario) -> Float[np.ndarray, " edges"]:
    """Weights by a gate on direction, as Eq. 11's, from the peak closest to each report (Eq. 10).

    Where nothing was heard, nothing contradicts the measurement: its weight is 1.
    """
    cfg = scenario.rendezvous
    guard = GUARDS[cfg.outliers]
    if not guard.by_direction or not len(others.z):
        return np.ones(len(others.z))
    rows = heard.row[others.tail[:, 0], others.head[:, 0]]
    peaks = find_peaks(heard.profile[rows], n_peaks=scenario.turn.n_peaks)
    weight = direction_weights(
        others.z,
        others.sigma,
        peaks.azimuth_rad,
        gate=guard.gate,
        sigma_rad=cfg.aoa_sigma_rad,
        gate_rad=cfg.aoa_gate_rad,
    )
    return np.where(peaks.height[:, 0] > 0.0, weight, 1.0)


def bearings_of(others: RelativePoses, heard: Listening, scenario: Scenario) -> Bearings:
    """Directions in which the robots that measured each other heard each other, if they are made use of."""
    cfg, n_peaks = scenario.rendezvous, scenario.turn.n_peaks
    if not GUARDS[cfg.outliers].bearings or not len(others.z):
        return Bearings.empty(n_peaks)
    rows = heard.row[others.tail[:, 0], others.head[:, 0]]
    peaks = find_peaks(heard.profile[rows], n_peaks=n_peaks)
    loud = peaks.height[:, 0] > 0.0
    return Bearings.measured(
        observer=others.tail[loud],
        target=others.head[loud],
        azimuth_rad=peaks.azimuth_rad[loud],
        sigma_rad=cfg.aoa_sigma_rad,
    )


def pings_of(heard: Listening, belief: Belief, scenario: Scenario) -> Pings:
    """Directions of the robots in the slots, which say in each packet where they think they are."""
    if not scenario.rendezvous.aoa_factors:
        return NO_PINGS
    robot, slot = np.nonzero(heard.slots != NOBODY)
    peaks = find_peaks(heard.by_slot[robot, slot], n_peaks=1)
    loud = peaks.height[:, 0] > 0.0
    robot, other = robot[loud], heard.slots[robot, slot][loud]
    return Pings(
        observer=indices(robot, belief.t),
        azimuth_rad=peaks.azimuth_rad[loud, 0],
        sigma_rad=np.full(len(robot), scenario.rendezvous.aoa_sigma_rad),
        point_m=belief.estimate[other, -1, :2],
        covariance_m2=belief.covariance[other, :2, :2] + _LEAST_M2 * np.eye(2),
    )
