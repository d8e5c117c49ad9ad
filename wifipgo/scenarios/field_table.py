"""Every field of a scenario as a row: table, unit, default, meaning, and what the paper says about its value.

Meanings are those of the classes' own docstrings, so there is one place to keep true.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from wifipgo.coerce import type_name
from wifipgo.command.docstrings import docstring_of
from wifipgo.errors import BadInputError
from wifipgo.scenarios import Scenario, field_kinds, field_owners, part_types
from wifipgo.scenarios.letters import letter_of

# Ends of names and what they mean; the first that fits counts.
_UNITS = (
    ("_mbit_s", "Mb/s"),
    ("_dbm", "dBm"),
    ("_db", "dB"),
    ("_hz", "Hz"),
    ("_rad", "rad"),
    ("_sigma", "sigma"),
    ("_m", "m"),
    ("_s", "s"),
)
_UNLIKE_THEIR_NAMES = {"starts": "m, m, rad", "n_steps": "iterations", "revisit_gap": "iterations"}
_DEG = math.pi / 180.0
# What the paper gives for a field, and where; any other value is ours.
PAPER_VALUES: Mapping[str, Mapping[Any, str]] = MappingProxyType(
    {
        "n_robots": {2: "Sec. 7.2.1", 50: "Sec. 7.1.2"},
        "n_steps": {50: "Secs. 7.1.2, 7.2.2"},
        "max_measurements": {9: "Sec. 7.3"},
        "visual_range_m": {0.0: "Fig. 9"},
        "n_obstacles": {0: "Sec. 7.2.2", 4: "Sec. 7.2.2"},
        "step_m": {2.0: "Sec. 7.1.2"},
        "sigma_t_m": {0.1: "Sec. 7.1.2", 0.2: "Sec. 7.2.1"},
        "sigma_r_rad": {3.0 * _DEG: "Sec. 7.1.2", 5.0 * _DEG: "Sec. 7.2.1"},
        "sensor_range_m": {2.2: "Sec. 7.1.2"},
        "outlier_min_sigma": {2.0: "Sec. 7.3"},
        "outlier_max_sigma": {3.0: "Sec. 7.3"},
        "carrier_hz": {5e9: "Sec. 7.2.1"},
        "antenna_gap_m": {0.22: "Sec. 7.2.1"},
        "turn_rad": {90.0 * _DEG: "Sec. 4"},
        "aoa_estimator": {"ratio": "Eq. 5"},
        "err_threshold": {10.0: "Sec. 7.1.2"},
        "outliers": {"paper": "Eq. 11"},
        "aoa_gate_rad": {7.2 * _DEG: "Sec. 7.3"},
    }
)


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldRow:
    """One field of a scenario.

    Attributes:
        table: Part that holds it, and its table in a file; '' for the scenario itself.
        name: Name, in files, in code and on the command line.
        letter: The paper's letter for it, which is taken for the name; empty if there is none.
        kind: Type in words.
        unit: Unit, or '-'.
        value: Its value.
        origin: Where the paper gives this value, or "ours".
        meaning: In words.
    """

    table: str
    name: str
    letter: str
    kind: str
    unit: str
    value: Any
    origin: str
    meaning: str


def field_rows(scenario: Scenario) -> tuple[FieldRow, ...]:
    """Every field of a scenario with its value, in the order of its parts; not its name and source."""
    meanings = {"": meanings_of(Scenario)}
    meanings |= {part: meanings_of(kind) for part, kind in part_types().items()}
    return tuple(
        FieldRow(
            table=part,
            name=name,
            letter=letter_of(name),
            kind=type_name(field_kinds()[name]),
            unit=unit_of(name),
            value=(value := getattr(getattr(scenario, part) if part else scenario, name)),
            origin=origin_of(name, value),
            meaning=meanings[part].get(name, ""),
        )
        for name, part in field_owners().items()
        if name not in {"name", "source"}
    )


def unit_of(name: str) -> str:
    """Unit that a field's name ends in, '-' if none."""
    ends = (unit for end, unit in _UNITS if name.endswith(end))
    return _UNLIKE_THEIR_NAMES.get(name) or next(ends, "-")


def limits_of(name: str) -> str:
    """Least and largest value of a number, in the words of its own refusal; '-' for anything else."""
    far = {int: 10**15, float: 1e300}.get(field_kinds()[name])
    if far is None:
        return "-"
    try:
        Scenario(name="", source="").with_overrides(**{name: far})
    except BadInputError as refusal:
        rule = re.search(r" must be (?:in )?(.*?)(?:, as .*)?, got ", str(refusal))
        return re.sub(r"\S+ \((.*)\)$", r"\1", rule[1].replace("..", " to ")) if rule else "-"
    return "-"


def origin_of(name: str, value: Any) -> str:
    """Where the paper gives a value for a field, or "ours"."""
    for known, place in PAPER_VALUES.get(name, {}).items():
        if known == value or (isinstance(known, float) and math.isclose(known, value, rel_tol=1e-9)):
            return f"paper {place}"
    return "ours"


def meanings_of(kind: type) -> dict[str, str]:
    """What a class's docstring says about each attribute; one entry may serve several, by commas."""
    _, _, section = docstring_of(kind).partition("Attributes:\n")
    entries = re.split(r"\n {8}(?=\w)", "\n" + section.split("\n\n")[0])[1:]
    split = (entry.partition(": ") for entry in entries)
    return {name: " ".join(text.split()) for names, _, text in split for name in names.split(", ")}
