"""Departures of a radio from the ideal, each with its own switch, and what of them an episode keeps.

Errors of the heading decide where the antennas really are, the diffuse cluster adds paths, and
the rest happens in the receiver (`wifipgo.radio.channel.receiver`). What is drawn once for an episode is
`EpisodeImpairments`; multipath is never drawn per packet.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from wifipgo.counters import Counters
from wifipgo.errors import pick, require_within
from wifipgo.radio.propagation.diffuse_scattering import DIFFUSE_POWERS, Diffuse, draw_diffuse
from wifipgo.radio.propagation.passing_bodies import Bodies, draw_bodies
from wifipgo.rows import Chance, Rows, draw_keys


@dataclass(frozen=True, slots=True, kw_only=True)
class ImpairmentConfig:
    """Departures of a receiver from the ideal. All values are ours.

    Attributes:
        noise_floor: Thermal noise at the level of the radio's bandwidth and noise figure.
        common_phase: Uniform phase of each packet, from oscillators that are not locked.
        timing_jitter_s: Standard deviation of the symbol timing of each packet, white: 12 to 26 ns
            on recordings of the Intel 5300.
        packet_loss: Probability that a packet does not arrive; one loss takes all antennas.
        agc: Every packet is scaled on its own, so that its largest I or Q is full scale.
        int8: I and Q are rounded to -127..127; without ``agc`` one scale serves a link's whole turn.
        chain_phase_rad: Standard deviation of the phase of each receive chain relative to the
            first, constant per robot and episode.
        heading_noise_rad: Standard deviation of the true heading at each packet about the one that
            the receiver believes, white.
        heading_bias_rad: True heading minus believed one, constant.
        diffuse_ratio: Power of the diffuse cluster over that of ``diffuse_power_of``; 0 for none.
        diffuse_power_of: "paths", those traced, or "obstructed", what obstacles take from the straight line.
        diffuse_spread_rad: Standard deviation of its taper over angle, see
            `wifipgo.radio.propagation.diffuse_scattering`.
        esnr_sigma_db: Standard deviation of the effective SNR that a robot reads off a link; rates are not
            read but tried, and stay as they are.
        n_bodies: People who walk through the room and stand in the way of paths, as screens of 3GPP TR
            38.901, Sec. 7.6.4.2; nobody bumps into them.
        body_step_m: How far each of them walks in an iteration.
    """

    noise_floor: bool = True
    common_phase: bool = True
    timing_jitter_s: float = 20e-9
    packet_loss: float = 0.0
    agc: bool = False
    int8: bool = False
    chain_phase_rad: float = 0.0
    heading_noise_rad: float = 0.0
    heading_bias_rad: float = 0.0
    diffuse_ratio: float = 0.0
    diffuse_power_of: str = "paths"
    diffuse_spread_rad: float = float(np.deg2rad(30.0))
    esnr_sigma_db: float = 0.0
    n_bodies: int = 0
    body_step_m: float = 2.0

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        require_within(self, _LIMITS)
        pick(DIFFUSE_POWERS, self.diffuse_power_of, "diffuse_power_of")


_LIMITS: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        "timing_jitter_s": (0.0, 1e-6),  # a symbol's guard interval is 0.8 us
        "packet_loss": (0.0, 1.0),
        "chain_phase_rad": (0.0, 2.0 * np.pi),  # from half of that on it is as good as uniform
        "heading_noise_rad": (0.0, np.pi),
        "heading_bias_rad": (-np.pi, np.pi),
        "diffuse_ratio": (0.0, 1e6),
        "diffuse_spread_rad": (1e-3, np.pi),
        "esnr_sigma_db": (0.0, 60.0),
        "n_bodies": (0, 1000),
        "body_step_m": (0.0, 1000.0),
    }
)


class EpisodeImpairments(NamedTuple):
    """Impairments of an episode: the configuration, and what was drawn once.

    Attributes:
        cfg: The configuration.
        chain_rad: Phase offset of each robot's receive chains, robots of all worlds one after the other.
        diffuse: Scatterers of the diffuse cluster, or None.
        bodies: People in the room, or None.
    """

    cfg: ImpairmentConfig
    chain_rad: Float[np.ndarray, "rows antennas"]
    diffuse: Diffuse | None
    bodies: Bodies | None = None


def draw_episode_impairments(
    cfg: ImpairmentConfig, *, n_robots: int, n_antennas: int, size_m: float, rng: Chance, n_worlds: int = 1
) -> EpisodeImpairments:
    """Draw what holds for a whole episode of each world in rooms of ``size_m`` x ``size_m``."""
    # For as many chains as a receiver may have, so that scatterers do not depend on how many it has.
    phase = rng.standard_normal((n_worlds * n_robots, _MOST_CHAINS))
    chain_rad = cfg.chain_phase_rad * phase[:, :n_antennas]
    chain_rad[:, 0] = 0.0
    diffuse = None
    if cfg.diffuse_ratio > 0.0:
        diffuse = draw_diffuse(
            ratio=cfg.diffuse_ratio,
            spread_rad=cfg.diffuse_spread_rad,
            size_m=size_m,
            rng=rng,
            n_worlds=n_worlds,
            power_of=cfg.diffuse_power_of,
        )
    bodies = None
    if cfg.n_bodies > 0:
        bodies = draw_bodies(
            count=cfg.n_bodies, step_m=cfg.body_step_m, size_m=size_m, rng=rng, n_worlds=n_worlds
        )
    return EpisodeImpairments(cfg, chain_rad, diffuse, bodies)


_MOST_CHAINS = 3
# Causes of chance at a reception: a stream each. A new one goes last.
_CAUSES = ("heading", "noise", "oscillator", "arrival")
LinkChance = Chance | Counters


def link_chance(
    rng: LinkChance, receiver: Int[np.ndarray, " links"], sender: Int[np.ndarray, " links"], *, rows: Rows
) -> Counters:
    """Chance of links in one iteration, a function of receiver and sender whatever other links there are.

    Args:
        rng: The channel's stream, from which each world draws a key; or what was made of it before.
        receiver: Row of each link's receiver.
        sender: Row of its sender.
        rows: Which robots are of which world.
    """
    if isinstance(rng, Counters):
        return rng
    world = Counters(draw_keys(rng, rows.n_worlds)[rows.world(receiver)])
    pair = (rows.peer(receiver) << 32) + rows.peer(sender)
    return world.split(pair.astype(np.uint64))


def chance_of(cause: str, rng: LinkChance) -> LinkChance:
    """Chance of one cause: a stream of its own, unless a single generator draws for all of them."""
    return rng.stream(_CAUSES.index(cause)) if isinstance(rng, Counters) else rng


def true_headings(
    heading_rad: Float[np.ndarray, "links positions"], cfg: ImpairmentConfig, *, rng: LinkChance
) -> Float[np.ndarray, "links positions"]:
    """Where the receiver really looks when it believes ``heading_rad``."""
    true_rad = heading_rad + cfg.heading_bias_rad
    if cfg.heading_noise_rad > 0.0:
        true_rad += cfg.heading_noise_rad * chance_of("heading", rng).standard_normal(true_rad.shape)
    return true_rad
