"""Scenarios by name, from files and from tables of values."""

from collections.abc import Mapping
from dataclasses import asdict
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from wifipgo.coerce import fitted
from wifipgo.errors import BadInputError, pick, require
from wifipgo.scenarios.named import SCENARIOS
from wifipgo.scenarios.scenario import Scenario, field_owners
from wifipgo.scenarios.toml_files import BASE, SUFFIX, flattened, read_toml, toml_text

_PLAIN = Scenario(name="plain", source="Ours unless the table of fields says otherwise: the defaults.")


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


def changed_fields(scenario: Scenario) -> dict[str, Any]:
    """Values that are not those of the scenario of that name; of the defaults where none has that name."""
    base = SCENARIOS.get(scenario.name, _PLAIN)
    pairs = (
        (name, *(getattr(getattr(each, part) if part else each, name) for each in (scenario, base)))
        for name, part in field_owners().items()
        if name not in {"name", "source"}
    )
    return {name: value for name, value, before in pairs if value != before}


def scenario_toml(scenario: Scenario) -> str:
    """Every value of a scenario as TOML: reading it gives an equal one, whatever the defaults are by then."""
    return toml_text(asdict(scenario))
