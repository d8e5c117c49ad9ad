"""Whether a trained policy plays what it was trained on, and what differs if it does not."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any

from baselines.policies.learned.network import Network, plain
from wifipgo.coerce import settings
from wifipgo.scenarios import Scenario, scenario_from, scenario_named

_NOT_PLAYED = ("name", "source")
_SHOWN = 3  # fields that are named


def scenario_varied(text: str, /, **changes: Any) -> Scenario:
    """Scenario of ``NAME KEY=VALUE ...``: one of a name, with some fields changed.

    Args:
        text: Name, then changes, apart by blanks.
        changes: More of them; those in the text win.

    Raises:
        ValueError: A name or a field that does not exist, or a value that is refused.
    """
    name, *pairs = text.split() or [""]
    return scenario_named(name, **changes | settings(pairs))


def trained_elsewhere(network: Network, scenario: Scenario) -> str:
    """What sets a scenario apart from the nearest that a network was trained on; empty if nothing does."""
    trained, now = list(_trained_on(network)), _flat(plain(scenario))
    rows = min((_differing(there, now) for there in trained), key=len)
    if not rows:
        return ""
    named = ", ".join(dict.fromkeys(repr(str(there.get("name"))) for there in trained))
    more = f"; and {len(rows) - _SHOWN} more" if len(rows) > _SHOWN else ""
    return f"was trained on {named} and plays {scenario.name!r}: {'; '.join(rows[:_SHOWN])}{more}"


def _trained_on(network: Network) -> Iterator[Mapping[str, Any]]:
    """Scenarios of the training, the one that it was judged by first; fields without their tables."""
    default = scenario_from({}, "defaults")  # of fields that were not there then
    yield _flat(plain(default)) | _flat(network.scenario)
    noted: Any = network.origin.get("settings")
    envs = noted.get("envs") if isinstance(noted, Mapping) else None
    if isinstance(envs, Mapping):
        with suppress(ValueError, TypeError, KeyError):
            changes = settings(envs.get("overrides", ()))
            yield from (_flat(plain(scenario_varied(text, **changes))) for text in envs.get("others", ()))


def _flat(values: Mapping[str, Any]) -> dict[str, Any]:
    """Fields by name, which no two tables share."""
    out: dict[str, Any] = {}
    for name, value in values.items():
        out |= _flat(value) if isinstance(value, Mapping) else {name: value}
    return out


def _differing(there: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """Fields that both have, with another value, and both values."""
    names = sorted(there.keys() & now.keys() - set(_NOT_PLAYED))
    return [f"{name} {there[name]!r} there, {now[name]!r} now" for name in names if there[name] != now[name]]
