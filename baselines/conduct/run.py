"""Play a policy beside a rule, or go on playing, and publish what is found."""

import shutil
from pathlib import Path

from rich.console import Console

from baselines.conduct.config import SUITE, WhyConfig
from baselines.conduct.findings import Findings, curves_of
from baselines.conduct.page import PAGE, documented, section, title
from baselines.conduct.pieces import Watched, conduct_in, watched
from baselines.evaluation.jobs import FAILURES
from baselines.evaluation.plan import versions
from baselines.suite.chunks import check_policies, play_missing
from wifipgo.command.terminal import say
from wifipgo.files import results_folder
from wifipgo.files.atomic_files import appearing, write_json, write_text
from wifipgo.files.folder_lock import held
from wifipgo.files.text_files import read_text

KIND = "why"
TABLES, PICTURE, NUMBERS, CURVES = "why.md", "why.png", "why.json", "curves.parquet"
PLAYED = "played"
Cells = dict[tuple[str, str], list[Watched]]


def explain(config: WhyConfig, *, console: Console | None = None) -> Findings:
    """Play what is not there yet, and leave tables, numbers and a picture in ``config.out``.

    With more than one job, call it under ``if __name__ == "__main__":``, as
    every program that starts processes.

    Raises:
        ValueError: A setting that is refused, or a policy that cannot play; nothing was written.
        OSError: A folder that cannot be written.
        EpisodesFailedError: Some episodes raised; the others are kept for ``resume``.
    """
    console = console or Console(quiet=True)
    config.check()
    check_policies(config.suite, list(config.suite.parts), config.players)
    config.where.check_script(2)
    if config.without and not config.ablations:
        say(console, f"note: nothing is taken from {config.subject.label}, which is no whole trained policy")
    out = config.out.resolve()
    with held(out):
        _claim(config, out)
        findings = _play(config, out, console)
        _publish(findings, config, out)
    say(console, f"results: {config.out}; read {config.out / TABLES}")
    return findings


def _claim(config: WhyConfig, out: Path) -> None:
    """Make the folder, or take up the one that is there."""
    rule = "new or empty (--resume goes on, --overwrite starts over)"
    results_folder.check_free(out, KIND, overwrite=config.overwrite or config.resume, rule=rule)
    if config.overwrite:
        results_folder.remove(out, KIND)
    results_folder.begin(out, KIND)
    results_folder.note(out, [f"{PLAYED}/", TABLES, PICTURE, NUMBERS, CURVES, FAILURES])
    (out / PLAYED).mkdir(exist_ok=True)


def _play(config: WhyConfig, out: Path, console: Console) -> Findings:
    """Play what is missing; what was found.

    Raises:
        EpisodesFailedError: Some episodes raised.
    """
    cells = _cells(config, out / PLAYED)
    pieces = [piece for each in cells.values() for piece in each]
    play_missing(pieces, title=SUITE, where=config.where, out=out, console=console)
    return Findings(
        suite=config.suite,
        policy=config.subject.label,
        rule=config.rule,
        ablations=tuple(spec.label for spec in config.ablations),
        texts=(config.as_typed[config.rule], config.as_typed[config.subject.label]),
        conduct={
            name: {spec.label: conduct_in(cells[spec.label, name]) for spec in config.players}
            for name in config.suite.parts
        },
    )


def _cells(config: WhyConfig, folder: Path) -> Cells:
    """What every policy plays in every scenario, the largest teams first."""
    parts = config.suite.parts
    return {
        (spec.label, name): watched(name, parts[name], spec, config.worlds, folder)
        for name in sorted(parts, key=lambda name: -parts[name].scenario.n_robots)
        for spec in config.players
    }


def _publish(findings: Findings, config: WhyConfig, out: Path) -> None:
    """Write numbers and tables, then draw; and the same into the documentation, if asked for."""
    text = section(findings, command=config.command, picture=PICTURE, worst=config.worst)
    about = {"command": config.command, "policy": findings.policy, "rule": findings.rule}
    write_json(out / NUMBERS, {**about, "versions": versions(), "scenarios": findings.record()})
    with appearing(out / CURVES) as unfinished:
        curves_of(findings).to_parquet(unfinished, index=False)
    write_text(out / TABLES, f"{text}\n")
    _draw(out / PICTURE, findings)
    if config.docs is not None:
        _document(findings, config, out, config.docs)


def _document(findings: Findings, config: WhyConfig, out: Path, docs: Path) -> None:
    """Fill the section, and put the picture beside the others."""
    picture = f"pictures/{PICTURE}"
    text = section(findings, command=config.command, picture=picture, worst=config.worst)
    write_text(docs / PAGE, documented(read_text(docs / PAGE), text))
    if (out / PICTURE).is_file():
        shutil.copyfile(out / PICTURE, docs / picture)


def _draw(path: Path, findings: Findings) -> None:
    """Draw the picture; what fails is a warning."""
    from wifipgo.command.figures import drawing  # noqa: PLC0415 (matplotlib loads slowly, and only here)

    from baselines.conduct.picture import draw_findings  # noqa: PLC0415

    with drawing(path):
        draw_findings(path, findings, title=f"{title(findings)}; curves: {findings.scenarios[0]}")
