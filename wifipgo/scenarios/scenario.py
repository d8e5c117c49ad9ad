"""The paper's experiments as values, how to change them, and scenarios of one's own from files."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, is_dataclass, replace
from os import PathLike, fspath
from pathlib import Path
from types import MappingProxyType
from typing import Any, get_type_hints

import numpy as np

from wifipgo.coerce import fitted
from wifipgo.errors import BadInputError, UnknownNameError, pick, require, require_within
from wifipgo.radio.aoa import AoaConfig
from wifipgo.radio.channel.bands import band_of
from wifipgo.radio.channel.csi import RadioConfig
from wifipgo.radio.channel.impairments import ImpairmentConfig
from wifipgo.radio.channel.rates import LinkConfig
from wifipgo.radio.propagation.materials import MATERIALS
from wifipgo.rendezvous import RendezvousConfig
from wifipgo.scenarios.toml_files import BASE, SUFFIX, flattened, read_toml, toml_text
from wifipgo.world.layout import ArenaConfig
from wifipgo.world.sensing import SensingConfig

_MOST_ROBOTS = 1000
_MOST_NUMBERS = 3e8
# Variables of the solvers are numbered by a robot's million poses.
_MOST_STEPS = 999_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """One experiment: robots, room, sensors, radio, rules of rendezvous.

    Attributes:
        name: Key in `SCENARIOS`, or the name of the file that it was read from.
        source: Which numbers are the paper's and which are ours.
        n_robots: Robots, at least 2.
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
        self._check_names()
        most = f"in 2..{_MOST_ROBOTS}, as each has a link to each"
        require(2 <= self.n_robots <= _MOST_ROBOTS, "Scenario.n_robots", most, self.n_robots)
        limits = {"n_steps": (1, _MOST_STEPS), "max_measurements": (0, 1e9), "visual_range_m": (0.0, 1e6)}
        require_within(self, limits)
        require(
            1 <= self.n_slots < self.n_robots,
            "Scenario.n_slots",
            f"in 1..{self.n_robots - 1} (n_robots - 1)",
            self.n_slots,
        )
        numbers = self.n_robots * self.n_slots * self.turn.n_azimuths
        rule = f"such that profiles of all slots have at most {_MOST_NUMBERS:g} numbers"
        require(numbers <= _MOST_NUMBERS, "Scenario.n_slots", rule, self.n_slots)
        self._check_radio()
        self.sensing.sigmas(self.n_robots)  # refuses a noise_scale of another length
        self.arena.steps_m(self.n_robots)
        each = {"ArenaConfig.starts": self.arena.starts, "AoaConfig.antenna_scale": self.turn.antenna_scale}
        for name, given in each.items():
            require(len(given) in {0, self.n_robots}, name, f"empty or {self.n_robots} long", given)

    def _check_names(self) -> None:
        """Reject names that a terminal would take for commands."""
        for field_name, most in (("name", 200), ("source", 10_000)):
            text = getattr(self, field_name)
            rule = f"printable, in one line of at most {most} characters"
            require(text.isprintable() and len(text) <= most, f"Scenario.{field_name}", rule, text)

    def _check_radio(self) -> None:
        """Reject a demand that no link meets, and a turn that compares no antennas."""
        top, q = band_of(self.radio.bandwidth_hz).top_rate_mbit_s, self.link.q_mbit_s
        require(q <= top, "LinkConfig.q_mbit_s", f"<= {top:g}, the top rate of the bandwidth", q)
        antennas_m = self.radio.antennas_m
        require(len(antennas_m) != 1, "RadioConfig.antennas_m", "2 or 3 positions for a turn", antennas_m)
        for scale in self.turn.antenna_scale:
            self.radio.scaled(scale)  # refuses antennas that are then too far or too close
        for name in ("wall_material", "obstacle_material"):
            pick(MATERIALS, getattr(self.arena, name), f"ArenaConfig.{name}")

    def with_overrides(self, **overrides: Any) -> "Scenario":
        """Copy with other values; a name is any field of the scenario or of its parts.

        Raises:
            ValueError: A name that no part has (the message lists all), or a value that is refused.
        """
        if not overrides:
            return self
        owners = field_owners()
        nested: dict[str, dict[str, Any]] = {}
        for name, value in overrides.items():
            part = pick(owners, name, "scenario field")
            nested.setdefault(part, {})[name] = fitted(value, _KINDS[name], name)
        parts = {part: replace(getattr(self, part), **new) for part, new in nested.items() if part}
        return replace(self, **parts, **nested.get("", {}))


_PARTS: Mapping[str, type] = MappingProxyType(
    {f.name: f.default_factory for f in fields(Scenario) if is_dataclass(f.default_factory)}  # type: ignore[misc]
)


def part_types() -> Mapping[str, type]:
    """The scenario's parts by name."""
    return _PARTS


def field_kinds() -> Mapping[str, Any]:
    """Declared type of every field that can be overridden."""
    return _KINDS


def field_owners() -> dict[str, str]:
    """Every field that can be overridden, and the scenario's part that holds it ('' for itself)."""
    own = {f.name: "" for f in fields(Scenario) if f.name not in _PARTS}
    return own | {f.name: part for part, cls in _PARTS.items() for f in fields(cls)}


_KINDS: Mapping[str, Any] = MappingProxyType(
    {
        f.name: get_type_hints(owner)[f.name]
        for owner in (Scenario, *_PARTS.values())
        for f in fields(owner)
        if f.name not in _PARTS
    }
)


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


def scenario_named(name: str | PathLike[str], /, **overrides: Any) -> Scenario:
    """Look a scenario up, or read it if ``name`` ends in ``.toml``, and change what is asked for.

    Raises:
        ValueError: Unknown scenario or field, or a value that is refused; the message lists what exists
            and names the file.
        OSError: A file that cannot be read.
    """
    rule = f"a name, a file that ends in {SUFFIX}, or a Scenario"
    require(isinstance(name, str | PathLike), "scenario", rule, name)
    return _found(fspath(name), Path(), ()).with_overrides(**overrides)


def _found(name: str, folder: Path, above: tuple[Path, ...]) -> Scenario:
    """Scenario of a name, or of a file in ``folder`` that the files ``above`` it led to."""
    if not name.endswith(SUFFIX):
        return pick({f"your own FILE{SUFFIX}": _PLAIN, **SCENARIOS}, name, "scenario")
    path = folder / name
    require(path.resolve() not in above, f"{BASE} in {above[-1] if above else path}", "no circle", name)
    return scenario_from(read_toml(path), str(path), above=above)


def scenario_from(values: Mapping[str, Any], where: str, *, above: tuple[Path, ...] = ()) -> Scenario:
    """Build a scenario from keys and tables, as a file holds them.

    ``base`` names the scenario that the others change, by name or as a file beside this one; without it
    they change the fields' own defaults. Unless given, the name is that of the file, and the
    source says what was changed.

    Args:
        values: Keys, flat or in the tables of their parts.
        where: File, for messages and the name.
        above: Files whose base this one is.

    Raises:
        ValueError: A key that does not exist, or a value that is refused; the message names the file.
    """
    flat, path = flattened(values, field_owners(), where), Path(where)
    try:
        base = _PLAIN
        if BASE in values:
            base = _found(fitted(values[BASE], str, BASE), path.parent, (*above, path.resolve()))
        source = f"{base.source} Ours, from {path.name}: {', '.join(flat) or 'nothing else'}."
        return base.with_overrides(**{"name": path.stem, "source": source} | flat)
    except ValueError as problem:
        raise BadInputError(f"{where}: {problem}") from problem


def scenario_toml(scenario: Scenario) -> str:
    """Every value of a scenario as TOML: reading it gives an equal one, whatever the defaults are by then."""
    return toml_text(asdict(scenario))


_PLAIN = Scenario(name="plain", source="Ours unless the table of fields says otherwise: the defaults.")

__all__ = [
    "SCENARIOS",
    "Scenario",
    "UnknownNameError",
    "field_kinds",
    "field_owners",
    "part_types",
    "scenario_from",
    "scenario_named",
    "scenario_toml",
]
