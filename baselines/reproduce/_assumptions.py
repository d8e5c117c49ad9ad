"""Assumptions to change: ``--set FIELD=VALUE`` in all, ``--sweep FIELD=A,B`` one after the other."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from baselines.reproduce._figures import FIGURES
from baselines.reproduce._runs import Setting
from wifipgo.coerce import key_value, settings
from wifipgo.errors import BadInputError, require
from wifipgo.scenarios import Scenario


class Assumption(NamedTuple):
    """Other values for fields of every scenario.

    Attributes:
        label: What to call it.
        changes: Value by field.
    """

    label: str
    changes: Mapping[str, object]


def assumptions(changes: Sequence[str], sweeps: Sequence[str]) -> list[Assumption]:
    """One for each value that is swept, or one of all changes.

    Args:
        changes: ``FIELD=VALUE``, which hold in all.
        sweeps: ``FIELD=A,B,...``, each value in its turn.

    Raises:
        BadInputError: A text that is no setting, a field that is given twice, or one value for a sweep.
    """
    base = settings(changes)
    swept = [(field, value) for text in sweeps for field, values in [_swept(text)] for value in values]
    for field, _ in swept:
        require(field not in base, f"--sweep {field}", "a field that --set leaves alone", field)
    found = [base | {field: value} for field, value in swept] or [base]
    return [Assumption(", ".join(f"{name}={value}" for name, value in of.items()), of) for of in found]


def _swept(text: str) -> tuple[str, list[Any]]:
    """Field and values of a sweep."""
    field, _, values = text.partition("=")
    found = [key_value(f"{field}={value}") for value in _at_commas(values)]
    require(len(found) > 1, f"--sweep {field}", "FIELD=A,B,...: two values or more", text)
    twice = [value for k, (_, value) in enumerate(found) if value in [earlier for _, earlier in found[:k]]]
    require(not twice, f"--sweep {field}", "values that differ", text)
    return found[0][0], [value for _, value in found]


def _at_commas(text: str) -> list[str]:
    """Parts between commas that stand outside of brackets."""
    parts, depth = [""], 0
    for sign in text:
        depth += (sign in "([") - (sign in ")]")
        if sign == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += sign
    return parts


def refuse_impossible(names: Iterable[str], found: Sequence[Assumption], setting: Setting) -> None:
    """Raise, before anything is played, for what no scenario of the figures takes.

    Raises:
        BadInputError: A field that does not exist, or a value that all scenarios refuse.
    """
    studies = [name for name in names if name not in FIGURES]
    require(
        not studies, "--set and --sweep", f"for the paper's figures: {', '.join(FIGURES)}", ", ".join(studies)
    )
    scenarios = [scenario for name in names for scenario in scenarios_of(name, setting)]
    rule = f"for a figure that plays episodes: {', '.join(n for n in FIGURES if scenarios_of(n, setting))}"
    require(bool(scenarios), "--set and --sweep", rule, ", ".join(names))
    for assumption in found:
        problems = [_refused(scenario, assumption.changes) for scenario in scenarios]
        if all(problems):
            raise next(problem for problem in problems if problem)


def scenarios_of(name: str, setting: Setting) -> list[Scenario]:
    """Scenarios that a figure's headlines are played in."""
    tasks = FIGURES[name].tasks(replace(setting, trials=1, roots=1))
    return list({task.scenario: None for task in tasks if hasattr(task, "scenario")})


def touched(name: str, assumption: Assumption, setting: Setting) -> bool:
    """Whether a figure is another one under an assumption."""
    return any(
        _refused(scenario, assumption.changes) or scenario.with_overrides(**assumption.changes) != scenario
        for scenario in scenarios_of(name, setting)
    )


def _refused(scenario: Scenario, changes: Mapping[str, object]) -> BadInputError | None:
    """Why a scenario does not take some changes, if it does not."""
    try:
        scenario.with_overrides(**changes)
    except BadInputError as problem:
        return problem
    return None
