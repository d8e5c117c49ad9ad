"""Claims under changed assumptions, beside those under the scenarios' own: one table, a column each."""

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from baselines.evaluation.jobs import raise_if_failed
from baselines.evaluation.plan import versions
from baselines.reproduce import _folder
from baselines.reproduce._assumptions import Assumption, assumptions, refuse_impossible, touched
from baselines.reproduce._claim_sections import shown_finding
from baselines.reproduce._claims import BESIDE, HEADLINE
from baselines.reproduce._config import ReproduceConfig
from baselines.reproduce._figures import FIGURES, NOT_REDONE
from baselines.reproduce._play import played
from baselines.reproduce._rules import NOT_RUN
from baselines.reproduce._runs import Setting
from baselines.reproduce._tables import table
from wifipgo.command.terminal import say
from wifipgo.files.atomic_files import write_json

DEFAULT = "default"
RECORD, PAGE = "changed_claims.json", "changed_claims.md"
_INTRODUCTION = (
    f"Rules, intervals and worlds are the same in every column; `{DEFAULT}` is the scenarios as they are. "
    "A figure that a change does not touch has a dash there."
)
Column = Mapping[str, Any]  # claims by figure


def checked(config: ReproduceConfig, names: Sequence[str], cache: Path) -> list[Assumption]:
    """What is to be changed; nothing if that was not asked for.

    Raises:
        BadInputError: What no scenario of the figures takes.
    """
    if not (config.overrides or config.sweep):
        return []
    found = assumptions(config.overrides, config.sweep)
    refuse_impossible(names, found, _setting(config, cache))
    return found


def compare(
    config: ReproduceConfig, names: Sequence[str], found: Sequence[Assumption], out: Path, console: Console
) -> dict[str, Any]:
    """Judge the claims of figures that the changes touch under each assumption; play only what that needs.

    Args:
        config: Worlds, and where to play them.
        names: Figures.
        found: Assumptions.
        out: Folder of the reproduction, whose episodes are made use of.
        console: Where to print.

    Returns:
        Content of ``changed_claims.json``.

    Raises:
        EpisodesFailedError: Some episodes raised; nothing is judged.
    """
    default = _setting(config, out / _folder.EPISODES)
    settings = {DEFAULT: default} | {a.label: replace(default, changes=a.changes) for a in found}
    touches = {a.label: [name for name in names if touched(name, a, default)] for a in found}
    touches[DEFAULT] = [name for name in names if any(name in of for of in touches.values())]
    columns = {
        label: _column(label, touches[label], setting, config=config, console=console)
        for label, setting in settings.items()
    }
    record = {
        "command": config.command,
        "versions": versions(),
        "not_touched": [name for name in names if name not in touches[DEFAULT]],
        "columns": columns,
    }
    _write(record, out, config.docs)
    _report(record, out, console)
    return record


def _setting(config: ReproduceConfig, cache: Path) -> Setting:
    """The default, without the sensitivity to other numbers."""
    return replace(config.setting(cache), sensitivity=False)


def _column(
    label: str, names: Sequence[str], setting: Setting, *, config: ReproduceConfig, console: Console
) -> Column:
    """Claims of some figures under one assumption."""
    out = setting.cache.parent
    tasks = {task.path: task for name in names for task in FIGURES[name].tasks(setting)}
    failures = played(label, list(tasks.values()), out=out, executor=config.where, console=console)
    raise_if_failed(failures, out)
    return {name: [asdict(claim) for claim in FIGURES[name].claims(setting)] for name in names}


def _write(record: Mapping[str, Any], out: Path, docs: Path | None) -> None:
    """Data and page; in the documentation beside the page of claims, never in its place."""
    _folder.note(out, [out / RECORD, out / PAGE])
    write_json(out / RECORD, record)
    (out / PAGE).write_text(page(record), encoding="utf-8")
    if docs is not None:
        docs.mkdir(parents=True, exist_ok=True)
        for name in (RECORD, PAGE):
            shutil.copyfile(out / name, docs / name)


def page(record: Mapping[str, Any]) -> str:
    """The table to read."""
    columns = record["columns"]
    untouched = ", ".join(record["not_touched"])
    parts = [
        f"# The paper's claims under changed assumptions\n\n    {record['command']}",
        _INTRODUCTION,
        table(["", "", *columns], rows(columns, (HEADLINE, BESIDE))),
        f"Not touched by any of it: {untouched}." if untouched else "",
        NOT_REDONE,
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def rows(columns: Mapping[str, Column], roles: Sequence[str]) -> list[list[str]]:
    """A line for each claim with its verdicts, and one for each of its figures."""
    found = []
    for name, claims in columns[DEFAULT].items():
        for k, claim in enumerate(claims):
            others = [of[name][k] if name in of else None for of in columns.values()]
            verdicts = [other["verdict"] if other else "-" for other in others]
            found.append([claim["name"], "verdict", *verdicts])
            conditions = [f["conditions"] for f in claim["findings"] if f["role"] in roles]
            found += [["", where, *(_cell(other, where) for other in others)] for where in conditions]
    return found


def _cell(claim: Mapping[str, Any] | None, conditions: str) -> str:
    """A figure of a claim under the same conditions."""
    if claim is None:
        return "-"
    same = [finding for finding in claim["findings"] if finding["conditions"] == conditions]
    if not same or same[0]["value"] is None:
        return same[0]["verdict"] if same else NOT_RUN
    return shown_finding(same[0]) + claim["unit"]


def _report(record: Mapping[str, Any], out: Path, console: Console) -> None:
    """Print headlines, and what is not there."""
    columns = record["columns"]
    shown = Table(title="claims under changed assumptions", title_justify="left")
    for header in ("claim", "", *columns):
        shown.add_column(Text(header))
    for line in rows(columns, (HEADLINE,)):
        shown.add_row(*map(Text, line))
    console.print(shown)
    if record["not_touched"]:
        say(console, f"not touched: {', '.join(record['not_touched'])}")
    say(console, NOT_REDONE)
    say(console, f"results: {out / PAGE}, {out / RECORD}")
