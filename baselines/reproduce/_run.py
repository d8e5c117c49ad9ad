"""Run what figures need, make them one after the other, and put all claims together."""

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from baselines.evaluation.jobs import Failure, raise_if_failed
from baselines.evaluation.plan import versions
from baselines.reproduce import _changed, _folder, _studies
from baselines.reproduce._claims import not_run
from baselines.reproduce._config import ReproduceConfig
from baselines.reproduce._figures import FIGURES, NOT_REDONE, STUDIES, chosen
from baselines.reproduce._folder import done
from baselines.reproduce._page import page, with_summary
from baselines.reproduce._play import played
from baselines.reproduce._rules import FEW, FEWEST
from baselines.reproduce._runs import Setting
from wifipgo.command.terminal import say
from wifipgo.files.atomic_files import write_json
from wifipgo.files.folder_lock import held
from wifipgo.files.text_files import read_json


def reproduce(config: ReproduceConfig, *, console: Console | None = None) -> dict[str, Any]:
    """Make figures, or go on making them, and judge the claims.

    With more than one job, call it under ``if __name__ == "__main__":``, as
    every program that starts processes.

    Args:
        config: What to make and where it goes.
        console: Where to print; nowhere if None.

    Returns:
        Content of ``claims.json``; with changed assumptions, of ``changed_claims.json``.

    Raises:
        ValueError: A setting that is refused; nothing was written.
        OSError: A folder that cannot be written.
        EpisodesFailedError: Some episodes raised; their figures are missing, all else is there.
    """
    console = console or Console(quiet=True)
    config.check()
    names, out = chosen(config.figures), config.out.resolve()
    config.where.check_script(2)
    changes = _changed.checked(config, names, out / _folder.EPISODES)
    record = {"trials": config.trials, "seed": config.seed, "versions": versions()}
    with held(out):
        _folder.claim(out, record, resume=config.resume, overwrite=config.overwrite)
        if changes:
            return _changed.compare(config, names, changes, out, console)
        return _work(config, names, out, console)


def _work(config: ReproduceConfig, names: Sequence[str], out: Path, console: Console) -> dict[str, Any]:
    """Make the figures that are not there yet, and judge all.

    Raises:
        EpisodesFailedError: Some episodes raised.
    """
    executor = config.where
    setting = config.setting(out / _folder.EPISODES)
    say(console, f"figures: {', '.join(names)}; {config.pool}; {executor.name}")
    failures = []
    for name in names:
        if done(out, name, setting.numbers):
            say(console, f"{name}: done before")
        else:
            failures += _make(name, setting, out, config, console)
    figures = any(name in FIGURES for name in names)
    whole = _together(config if figures else replace(config, docs=None), out)
    if figures:
        _report(whole, config, console)
    _studies.publish(names, out, config.docs, console)
    raise_if_failed(failures, out)
    return whole


def _make(name: str, setting: Setting, out: Path, config: ReproduceConfig, console: Console) -> list[Failure]:
    """Run what one figure still needs and make it; what failed if it cannot be made."""
    figure = {**FIGURES, **STUDIES}[name]
    tasks = figure.tasks(setting)
    failures = played(name, tasks, out=out, executor=config.where, console=console)
    if failures:
        return failures
    folder = _folder.staging(out, name)
    claims = [asdict(claim) for claim in figure.make(setting, folder)]
    content = {"title": figure.TITLE, "run": _about(name, config), "claims": claims}
    write_json(folder / _folder.CLAIMS, content)
    _folder.publish(folder)
    return []


def _about(name: str, config: ReproduceConfig) -> dict[str, Any]:
    """Where a figure's numbers come from: enough to get them again."""
    return {
        "command": replace(config, figures=(name,)).command,
        "date": datetime.now(UTC).date().isoformat(),
        "roots": list(range(config.seed, config.seed + config.roots)),
        "trials": config.trials or {**FIGURES, **STUDIES}[name].TRIALS,
        "versions": versions(),
    }


def _together(config: ReproduceConfig, out: Path) -> dict[str, Any]:
    """All figures that are there, as ``claims.json`` and ``claims.md``."""
    whole = {"figures": {name: _found(out, name) for name in FIGURES}}
    write_json(out / _folder.CLAIMS, whole)
    (out / _folder.PAGE).write_text(page(whole, lambda name: f"{name}/{name}.png"), encoding="utf-8")
    if config.docs is not None:
        _document(whole, out, config.docs)
    return whole


def _found(out: Path, name: str) -> dict[str, Any]:
    """A figure's claims; those of one that is not there were not run."""
    if done(out, name):
        return _read(out / name / _folder.CLAIMS)
    figure = FIGURES[name]
    claims = [asdict(not_run(sentence)) for sentence in figure.SENTENCES]
    return {"title": figure.TITLE, "run": None, "claims": claims}


def _document(whole: Mapping[str, Any], out: Path, docs: Path) -> None:
    """The page, what it is made from, and its pictures; figures of other runs stay as they are there."""
    (docs / "pictures").mkdir(parents=True, exist_ok=True)
    ran = {name: of for name, of in whole["figures"].items() if of["run"]}
    for name in ran:
        if (out / name / f"{name}.png").is_file():
            shutil.copyfile(out / name / f"{name}.png", docs / documented_picture(name))
    before = _read(docs / _folder.CLAIMS)["figures"] if (docs / _folder.CLAIMS).is_file() else {}
    figures = {**whole["figures"], **before, **ran}
    merged = {"figures": {name: figures[name] for name in FIGURES if name in figures}}
    write_json(docs / _folder.CLAIMS, merged)
    (docs / _folder.PAGE).write_text(page(merged, documented_picture), encoding="utf-8")
    readme = docs.resolve().parent / "README.md"
    if readme.is_file():
        readme.write_text(
            with_summary(readme.read_text(encoding="utf-8"), merged["figures"]), encoding="utf-8"
        )


def _read(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = read_json(path)
    return found


def documented_picture(name: str) -> str:
    """Where the documentation keeps a figure's picture."""
    return f"pictures/{name}.png"


def _report(whole: Mapping[str, Any], config: ReproduceConfig, console: Console) -> None:
    """Print a verdict for each claim, and where everything is."""
    table = Table(title="claims", title_justify="left")
    for header in ("claim", "verdict", ""):
        table.add_column(header)
    for of in whole["figures"].values():
        for claim in of["claims"]:
            table.add_row(Text(claim["name"]), Text(claim["verdict"]), Text(claim["claim"]))
    console.print(table)
    verdicts = {claim["verdict"] for of in whole["figures"].values() for claim in of["claims"]}
    if FEW in verdicts:
        say(console, f"a verdict needs {FEWEST} worlds: --trials and --roots say how many there are")
    say(console, NOT_REDONE)
    say(console, f"results: {config.out}; read {config.out / _folder.PAGE}")
