"""The paper's letters as other names of the fields that they stand for."""

import unicodedata
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any

from wifipgo.errors import BadInputError, UnknownNameError

# As the paper writes them, spelled out; alpha and kappa are the fields' own names.
LETTERS: Mapping[str, str] = MappingProxyType(
    {
        "delta": "err_threshold",
        "Delta": "aoa_gate_rad",
        "q": "q_mbit_s",
        "sigma": "aoa_sigma_rad",
    }
)
# Letters of its algorithms that are no choice of ours, and why.
_NO_FIELDS: Mapping[str, str] = MappingProxyType(
    {
        "gamma": "a step of Algorithm 1 has at most one step length (step_m), which gamma always reaches",
        "rho": "the rate of a link follows from its channel",
        "w": "the service discrepancy follows from q, alpha and the rate of a link (Eq. 1)",
    }
)


def field_of(name: str) -> str:
    """Field that a name or a letter stands for, spelled out or as a sign; any other name is what it is."""
    spelled = _spelled_out(name)
    return LETTERS.get(spelled, spelled)


def _spelled_out(name: str) -> str:
    """A Greek sign in Latin letters."""
    words = unicodedata.name(name, "").split() if len(name) == 1 else []
    if len(words) != 4 or words[0] != "GREEK":
        return name
    return words[-1].title() if words[1] == "CAPITAL" else words[-1].lower()


def letter_of(field: str) -> str:
    """Letter of the paper for a field; empty if it has none, or is called by it."""
    return next((letter for letter, named in LETTERS.items() if named == field), "")


def by_field(given: Mapping[str, Any]) -> dict[str, Any]:
    """Values by the names of their fields.

    Raises:
        BadInputError: A field is given by its letter and by its name; names both.
    """
    found: dict[str, Any] = {}
    spelled: dict[str, str] = {}
    for name, value in given.items():
        field = field_of(name)
        require_once(field, spelled.setdefault(field, name), name)
        found[field] = value
    return found


def require_once(field: str, first: str, second: str) -> None:
    """Refuse two names of one field.

    Raises:
        BadInputError: Names both.
    """
    if first != second:
        raise BadInputError(f"{field} must be given once, got {first} and {second}")


def check_field(name: str, known: Iterable[str], kind: str = "scenario field") -> None:
    """Refuse a name that no field has, letters included.

    Raises:
        UnknownNameError: Lists the fields and letters.
        BadInputError: A letter of the paper that is no choice; says why.
    """
    known = set(known)
    if field_of(name) in known:
        return
    reason = _NO_FIELDS.get(_spelled_out(name))
    if reason:
        raise BadInputError(f"{name} of the paper is no {kind.rstrip(':')}: {reason}")
    raise UnknownNameError(kind, name, {*known, *(k for k, field in LETTERS.items() if field in known)})
