"""What a picture shows of a `Tick`, as arrays in metres. Reads the truth, so it is for eyes only."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from envs.directions import N_BINS, bin_azimuths
from wifipgo.radio.channel.bands import band_of
from wifipgo.rendezvous import NOBODY
from wifipgo.scenarios import Scenario
from wifipgo.state import Belief, Tick
from wifipgo.world.map_accuracy import first_map_accuracy

# Semi-axes of the region that holds a Gaussian in the plane with 95 %, in standard deviations.
SIGMAS_95 = float(np.sqrt(-2.0 * np.log(0.05)))
_TURN_RAD = np.linspace(0.0, 2.0 * np.pi, 36, endpoint=False)
_CIRCLE = SIGMAS_95 * np.stack([np.cos(_TURN_RAD), np.sin(_TURN_RAD)])
_MICROMETRE_M = 1e-6


class Camera(NamedTuple):
    """Where the square room lies on a surface: y points up in the room and down on the surface."""

    px_per_m: float
    left_px: float
    bottom_px: float

    @classmethod
    def on_square(cls, side_px: int, room_m: float, *, margin_px: float) -> "Camera":
        """Camera that shows a room on a square, with a margin on all sides."""
        return cls((side_px - 2.0 * margin_px) / room_m, margin_px, side_px - margin_px)

    def px(self, p_m: Float[np.ndarray, "*batch 2"]) -> Float[np.ndarray, "*batch 2"]:
        """Pixels of points."""
        flipped = p_m * np.array([self.px_per_m, -self.px_per_m])
        return flipped + np.array([self.left_px, self.bottom_px])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scene:
    """A moment of an episode.

    Attributes:
        t: Iterations done.
        true: Poses up to now.
        estimate: The same as the robots now believe them.
        seen: Cells that somebody has seen.
        seen_share: Share of the free cells that these are.
        mapped_share: The score: share of the free cells that are mapped where they are.
        pairs: Robots of which one listens to the other.
        rate_share: Rate of each such link, of the band's top rate.
        calls: (caller, callee) of each call that is up.
        lobes: For each call, the callee's AOA profile of its caller in the bins of an observation, as
            an outline around the callee with a maximum of 1; zeros where it does not hear its caller.
        met: Groups that meet now.
        last_met_m: Where each robot that ever met last did.
        rings_m: Outline around each newest estimate: where the robot is with 95 %, as far as it can know.
        err_share: Err_i of each robot over the threshold.
        under_way: Whether the newest poses are between two iterations (`envs.render.in_between`).
    """

    t: int
    true: Float[np.ndarray, "robots times 3"]
    estimate: Float[np.ndarray, "robots times 3"]
    seen: Bool[np.ndarray, "cells cells"]
    seen_share: float
    mapped_share: float
    pairs: Int[np.ndarray, "links 2"]
    rate_share: Float[np.ndarray, " links"]
    calls: Int[np.ndarray, "calls 2"]
    lobes: Float[np.ndarray, "calls bins 2"]
    met: tuple[tuple[int, ...], ...]
    last_met_m: Float[np.ndarray, "places 2"]
    rings_m: Float[np.ndarray, "robots steps 2"]
    err_share: Float[np.ndarray, " robots"]
    under_way: bool = False

    @property
    def error_m(self) -> Float[np.ndarray, " robots"]:
        """Distance of the newest estimates from the truth."""
        return np.asarray(np.hypot(*(self.estimate[:, -1, :2] - self.true[:, -1, :2]).T))

    @property
    def rms_error_m(self) -> float:
        """Root mean square of `error_m`."""
        return float(np.sqrt((self.error_m**2).mean()))


def scene_of(tick: Tick, scenario: Scenario) -> Scene:
    """Gather what a picture shows."""
    truth, belief = tick.truth, tick.belief
    mapped = first_map_accuracy(truth.cells, truth.poses, belief.paths.estimate)
    pairs = _listening(belief)
    top_mbit_s = band_of(scenario.radio.bandwidth_hz).top_rate_mbit_s
    caller = np.flatnonzero(belief.team.calls.callee != NOBODY)
    calls = np.stack([caller, belief.team.calls.callee[caller]], axis=1)
    met = np.flatnonzero(belief.team.last_met > 0)
    return Scene(
        t=belief.t,
        true=truth.poses,
        estimate=belief.paths.estimate,
        seen=truth.cells.seen[0],
        seen_share=float(truth.cells.share[0]),
        mapped_share=float(mapped.share[0]),
        pairs=pairs,
        rate_share=belief.radio.rate_mbit_s[pairs[:, 0], pairs[:, 1]] / top_mbit_s,
        calls=calls,
        lobes=_lobes_of_calls(belief, calls, truth.poses[:, -1, 2]),
        met=belief.team.met,
        last_met_m=truth.poses[met, belief.team.last_met[met], :2],
        rings_m=rings(belief.paths.estimate[:, -1, :2], belief.paths.covariance[:, :2, :2]),
        err_share=belief.err / scenario.rendezvous.err_threshold,
    )


def _listening(belief: Belief) -> Int[np.ndarray, "links 2"]:
    """Links that robots use: those to the neighbours in their slots, each once."""
    robot, slot = np.nonzero(belief.radio.slots != NOBODY)
    linked = np.zeros(belief.radio.rate_mbit_s.shape, dtype=bool)
    linked[robot, belief.radio.slots[robot, slot]] = True
    return np.argwhere(np.triu(linked | linked.T, 1))


def lobes(
    profile: Float[np.ndarray, "links grid"], yaw_rad: Float[np.ndarray, " links"]
) -> Float[np.ndarray, "links bins 2"]:
    """AOA profiles as outlines in the world, in the bins of an observation, with a maximum of 1."""
    binned = profile.reshape(len(profile), N_BINS, profile.shape[1] // N_BINS).max(axis=2)
    radius = binned / np.maximum(binned.max(axis=1, keepdims=True), np.finfo(np.float32).tiny)
    azimuth_rad = yaw_rad[:, None] + bin_azimuths()
    return radius[..., None] * np.stack([np.cos(azimuth_rad), np.sin(azimuth_rad)], axis=-1)


def _lobes_of_calls(
    belief: Belief, calls: Int[np.ndarray, "calls 2"], yaw_rad: Float[np.ndarray, " robots"]
) -> Float[np.ndarray, "calls bins 2"]:
    """Profiles of callers at their callees."""
    if len(calls) == 0:
        return np.zeros((0, N_BINS, 2))
    caller, callee = calls.T
    heard = belief.radio.slots[callee] == caller[:, None]
    profile = np.where(heard.any(axis=1)[:, None], belief.radio.profile[callee, heard.argmax(axis=1)], 0.0)
    return lobes(profile, yaw_rad[callee])


def rings(
    middle_m: Float[np.ndarray, "robots 2"], covariance_m2: Float[np.ndarray, "robots 2 2"]
) -> Float[np.ndarray, "robots steps 2"]:
    """Outlines of the regions that hold 95 % of each Gaussian."""
    # A circle through any square root of a covariance is its ellipse: here Cholesky's, but numpy's refuses
    # the zero that a robot starts with.
    xx_m2, xy_m2, yy_m2 = covariance_m2[:, [0, 0, 1], [0, 1, 1]].T[..., None]
    x_m = np.sqrt(np.maximum(xx_m2, _MICROMETRE_M**2))
    y_of_x_m = xy_m2 / x_m
    y_m = np.sqrt(np.maximum(yy_m2 - y_of_x_m**2, 0.0))
    across, up = _CIRCLE
    return middle_m[:, None] + np.stack([x_m * across, y_of_x_m * across + y_m * up], axis=-1)
