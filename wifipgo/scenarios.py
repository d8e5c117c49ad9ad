"""The paper's experiments as values, and how to change them."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from wifipgo.errors import UnknownNameError, pick, require
from wifipgo.radio.aoa import AoaConfig
from wifipgo.radio.bands import band_of
from wifipgo.radio.csi import RadioConfig
from wifipgo.radio.impairments import ImpairmentConfig
from wifipgo.radio.link import LinkConfig
from wifipgo.rendezvous import RendezvousConfig
from wifipgo.world.layout import ArenaConfig
from wifipgo.world.sensing import SensingConfig


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """One experiment: robots, room, sensors, radio, rules of rendezvous.

    Attributes:
        name: Key in `SCENARIOS`.
        source: Which numbers are the paper's and which are ours.
        n_steps: Iterations of an episode.
        n_slots: Neighbours that a robot listens to and observes, at most ``n_robots - 1``.
        max_measurements: End the episode once this many relative poses between robots are taken; 0: never.
        visual_range_m: How far a camera recognises another robot; 0 in the dark. Only vision-based
            policies use it.
    """

    name: str
    source: str
    n_robots: int = 2
    n_steps: int = 50
    n_slots: int = 1
    max_measurements: int = 0
    visual_range_m: float = 6.0
    arena: ArenaConfig = field(default_factory=ArenaConfig)
    sensing: SensingConfig = field(default_factory=SensingConfig)
    radio: RadioConfig = field(default_factory=RadioConfig)
    impairments: ImpairmentConfig = field(default_factory=ImpairmentConfig)
    turn: AoaConfig = field(default_factory=AoaConfig)
    link: LinkConfig = field(default_factory=LinkConfig)
    rendezvous: RendezvousConfig = field(default_factory=RendezvousConfig)

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything together."""
        require(self.n_robots >= 2, "Scenario.n_robots", ">= 2", self.n_robots)
        require(self.n_steps >= 1, "Scenario.n_steps", ">= 1", self.n_steps)
        require(
            1 <= self.n_slots < self.n_robots,
            "Scenario.n_slots",
            f"in 1..{self.n_robots - 1} (n_robots - 1)",
            self.n_slots,
        )
        require(self.max_measurements >= 0, "Scenario.max_measurements", ">= 0", self.max_measurements)
        require(self.visual_range_m >= 0.0, "Scenario.visual_range_m", ">= 0", self.visual_range_m)
        self._check_radio()
        self.sensing.sigmas(self.n_robots)  # refuses a noise_scale of another length

    def _check_radio(self) -> None:
        """Reject a demand that no link meets, and a turn that compares no antennas."""
        top, q = band_of(self.radio.bandwidth_hz).top_rate_mbit_s, self.link.q_mbit_s
        require(q <= top, "LinkConfig.q_mbit_s", f"<= {top:g}, the top rate of the bandwidth", q)
        antennas_m = self.radio.antennas_m
        require(len(antennas_m) != 1, "RadioConfig.antennas_m", "2 or 3 positions for a turn", antennas_m)

    def with_overrides(self, **overrides: Any) -> "Scenario":
        """Copy with other values; a name is any field of the scenario or of its parts.

        Raises:
            ValueError: A name that no part has (the message lists all), or a value that is refused.
        """
        owners = field_owners()
        nested: dict[str, dict[str, Any]] = {}
        for name, value in overrides.items():
            part = pick(owners, name, "scenario field")
            nested.setdefault(part, {})[name] = _fitting(getattr(self, part) if part else self, name, value)
        parts = {part: replace(getattr(self, part), **new) for part, new in nested.items() if part}
        return replace(self, **parts, **nested.get("", {}))


_PARTS: Mapping[str, type] = MappingProxyType(
    {f.name: f.default_factory for f in fields(Scenario) if is_dataclass(f.default_factory)}  # type: ignore[misc]
)


def field_owners() -> dict[str, str]:
    """Every field that can be overridden, and the scenario's part that holds it ('' for itself)."""
    own = {f.name: "" for f in fields(Scenario) if f.name not in _PARTS}
    return own | {f.name: part for part, cls in _PARTS.items() for f in fields(cls)}


def _fitting(part: Any, name: str, value: Any) -> Any:
    """Take an int where a float stands and a list where a tuple does; refuse other types."""
    now = getattr(part, name)
    if isinstance(now, float) and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if isinstance(now, tuple) and isinstance(value, list):
        return tuple(value)
    require(isinstance(value, type(now)), name, f"of type {type(now).__name__}", value)
    return value


PAPER_HW_2 = Scenario(
    name="paper-hw-2",
    source=(
        "Paper Sec. 7.2: 2 robots, 50 iterations, 0.2 m and 5 deg, antennas 22 cm apart. Sec. 7.1.2 for the "
        "threshold of 10, step of 2 and sensor range of 2.2. Ours: room of 20 x 20, transmit power, q, kappa."
    ),
    sensing=SensingConfig(sigma_t_m=0.2, sigma_r_rad=float(np.deg2rad(5.0))),
    radio=RadioConfig(tx_power_dbm=-12.0),
)
PAPER_HW_2_OBSTACLES = replace(
    PAPER_HW_2,
    name="paper-hw-2-obstacles",
    source=PAPER_HW_2.source + " Four obstacles as in Sec. 7.2.2; their size, place and material are ours.",
    arena=ArenaConfig(n_obstacles=4),
)
_DARK = " Low light as in Fig. 9: cameras see nothing."
PAPER_HW_2_DARK = replace(
    PAPER_HW_2, name="paper-hw-2-dark", source=PAPER_HW_2.source + _DARK, visual_range_m=0.0
)
PAPER_HW_2_OBSTACLES_DARK = replace(
    PAPER_HW_2_OBSTACLES,
    name="paper-hw-2-obstacles-dark",
    source=PAPER_HW_2_OBSTACLES.source + _DARK,
    visual_range_m=0.0,
)
PAPER_HW_2_HETERO = replace(
    PAPER_HW_2,
    name="paper-hw-2-hetero",
    source=PAPER_HW_2.source + " Heterogeneous noise as in the caption of Fig. 7; the factors are ours.",
    sensing=replace(PAPER_HW_2.sensing, noise_scale=(1.0 / 3.0, 3.0)),
)
PAPER_SIM_2 = replace(
    PAPER_HW_2,
    name="paper-sim-2",
    source="The noise of Sec. 7.1.2 (0.1 m, 3 deg) with two robots. Ours: as in paper-hw-2.",
    sensing=SensingConfig(),
)
PAPER_SIM_50 = Scenario(
    name="paper-sim-50",
    source=(
        "Paper Sec. 7.1.2: 50 robots, 50 iterations, 0.1 m and 3 deg, threshold 10, step 2, sensor range "
        "2.2. Ours: room of 60 x 60, transmit power, q, kappa, 3 slots, 32 packets a turn."
    ),
    n_robots=50,
    n_slots=3,
    arena=ArenaConfig(size_m=60.0),
    radio=RadioConfig(tx_power_dbm=-4.0),
    turn=AoaConfig(n_positions=32),
)
PAPER_OUTLIERS = replace(
    PAPER_HW_2,
    name="paper-outliers",
    source=(
        "Paper Sec. 7.3: outliers of 2 to 3 sigma, until 9 relative poses, AOA gate of 7.2 deg. Ours: one in "
        "three is an outlier; the rest as in paper-hw-2."
    ),
    max_measurements=9,
    sensing=replace(PAPER_HW_2.sensing, outlier_share=1.0 / 3.0),
    rendezvous=RendezvousConfig(outliers="paper"),
)

SCENARIOS: Mapping[str, Scenario] = MappingProxyType(
    {
        scenario.name: scenario
        for scenario in (
            PAPER_HW_2,
            PAPER_HW_2_OBSTACLES,
            PAPER_HW_2_DARK,
            PAPER_HW_2_OBSTACLES_DARK,
            PAPER_HW_2_HETERO,
            PAPER_SIM_2,
            PAPER_SIM_50,
            PAPER_OUTLIERS,
        )
    }
)


def scenario_named(name: str, **overrides: Any) -> Scenario:
    """Look a scenario up and change what is asked for.

    Raises:
        ValueError: Unknown scenario or field; the message lists what exists.
    """
    return pick(SCENARIOS, name, "scenario").with_overrides(**overrides)


__all__ = ["SCENARIOS", "Scenario", "UnknownNameError", "field_owners", "scenario_named"]
