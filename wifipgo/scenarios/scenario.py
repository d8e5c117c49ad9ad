"""A scenario: one experiment as a value, checked, and how to change it."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from types import MappingProxyType
from typing import Any, get_type_hints

from wifipgo.coerce import fitted
from wifipgo.errors import pick, quoted, require, require_within
from wifipgo.graph.config import GraphConfig
from wifipgo.radio.aoa.estimators import AoaConfig
from wifipgo.radio.channel.bands import band_of
from wifipgo.radio.channel.csi import RadioConfig
from wifipgo.radio.channel.impairments import ImpairmentConfig
from wifipgo.radio.channel.rates import LinkConfig
from wifipgo.radio.propagation.materials import MATERIALS
from wifipgo.rendezvous import RendezvousConfig
from wifipgo.scenarios.letters import by_field, check_field
from wifipgo.world.layout import ArenaConfig
from wifipgo.world.sensing import SensingConfig

_MOST_ROBOTS = 1000
_MOST_NUMBERS = 3e8
# Variables of the solvers are numbered by a robot's million poses.
_MOST_STEPS = 999_000


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
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
    graph: GraphConfig = field(default_factory=GraphConfig)

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

    def __repr__(self) -> str:
        """Name, and what is not as in the scenario of that name."""
        from wifipgo.scenarios.lookup import changed_fields  # noqa: PLC0415 (imports this module)

        changed = (f"{name}={quoted(value)}" for name, value in changed_fields(self).items())
        return f"Scenario({', '.join([repr(self.name), *changed])})"

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
        for k, material in enumerate(self.arena.obstacle_materials):
            pick(MATERIALS, material, f"ArenaConfig.obstacle_materials[{k}]")

    def with_overrides(self, **overrides: Any) -> "Scenario":
        """Copy with other values; a name is any field of the scenario or of its parts, or its letter.

        Raises:
            ValueError: A name that no part has (the message lists all), a field by two names, or a value that
                is refused.
        """
        if not overrides:
            return self
        owners = field_owners()
        nested: dict[str, dict[str, Any]] = {}
        for name in overrides:
            check_field(name, owners)
        for name, value in by_field(overrides).items():
            nested.setdefault(owners[name], {})[name] = fitted(value, _KINDS[name], name)
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
