"""Play a suite, or go on playing it, and publish what came out."""

from pathlib import Path

from rich.console import Console

from baselines.evaluation.jobs import FAILURES
from baselines.evaluation.plan import differences, refuse_differing, versions
from baselines.policies.registry import source_digest
from baselines.suite.chunks import Chunk, check_policies, chunks_of, play_missing
from baselines.suite.config import SuiteConfig
from baselines.suite.definition import anchors_of, digest_of
from baselines.suite.report import KIND, publish, report
from baselines.suite.results import FILE, Entry, Results, read_results
from baselines.suite.standings import LEAST_WORLDS, reference_of
from wifipgo.errors import require
from wifipgo.files import results_folder
from wifipgo.files.atomic_files import write_json
from wifipgo.files.folder_lock import held
from wifipgo.files.text_files import read_json

_RECORD = "config.json"
Cells = dict[tuple[str, str], list[Chunk]]


def play_suite(config: SuiteConfig, *, console: Console | None = None) -> Results:
    """Play all policies in all scenarios, and leave scores, table and picture in ``config.out``.

    With more than one job, call it under ``if __name__ == "__main__":``, as
    every program that starts processes.

    Raises:
        ValueError: A setting that is refused, or a policy that cannot play; nothing was written.
        OSError: A folder that cannot be written.
        EpisodesFailedError: Some episodes raised; the others are kept for ``resume``.
    """
    console = console or Console(quiet=True)
    reference = _checked(config)
    out = config.out.resolve()
    with held(out):
        before = _before(config, out) if config.resume else None
        partial = _claim(config, out, replace=config.overwrite or before is not None)
        cells = _cells(config, partial, before)
        chunks = [chunk for each in cells.values() for chunk in each]
        results_folder.note(partial, [chunk.path.name for chunk in chunks])
        play_missing(chunks, title=config.suite, where=config.where, out=partial, console=console)
        results = _results(config, cells, before)
        standings = publish(results, reference, partial, out)
    report(standings, results, reference, config.out, console)
    return results


def _checked(config: SuiteConfig) -> str:
    """Refuse, before anything runs, what could not run; the policy that the others are compared with."""
    numbers, both = config.numbers, config.resume and config.overwrite
    require(not both, "--resume and --overwrite", "one of them at most", "both")
    require(len(numbers) >= LEAST_WORLDS, "worlds", f">= {LEAST_WORLDS}: a table needs them", len(numbers))
    reference = reference_of([spec.label for spec in config.specs], config.reference)
    anchors_of(config.suite)
    check_policies(config.version, config.names, config.specs)
    config.where.check_script(2)
    return reference


def _before(config: SuiteConfig, out: Path) -> Results | None:
    """Finished results that are added to.

    Raises:
        BadInputError: They are of other code, or hold what was not asked for now.
    """
    if not (out / FILE).is_file():
        return None
    there, specs = read_results(out / FILE), {spec.label: spec for spec in config.specs}
    require(there.suite == config.suite, "suite", f"{there.suite}, as in {out / FILE}", config.suite)
    require(
        there.first == config.numbers.start, "worlds-from", f"{there.first}, as there", config.worlds_from
    )
    rule = f">= {there.worlds}, as there are"
    require(there.worlds <= len(config.numbers), "worlds", rule, len(config.numbers))
    for label, entry in there.entries.items():
        require(label in specs, "policies", f"with {label!r}, which is there", sorted(specs))
        now = {"policy": str(specs[label]), "source": source_digest(specs[label]), "versions": versions()}
        was = {name: getattr(entry, name) for name in now}
        refuse_differing(differences(was, now), f"to go on, settings must stay: {label} in {out / FILE}")
        rule = f"with {', '.join(entry.scores)}, which are there"
        require(set(entry.scores) <= set(config.names), "scenarios", rule, config.names)
    return there


def _claim(config: SuiteConfig, out: Path, *, replace: bool) -> Path:
    """Make the working folder, or take up that of an interrupted run of the same code."""
    partial = results_folder.partial_of(out)
    results_folder.check_free(out, KIND, overwrite=replace)
    if partial.exists() and not config.resume:
        rule = "absent: --resume continues the interrupted run that it holds, --overwrite starts over"
        require(config.overwrite, str(partial), rule, "it there")
        results_folder.remove(partial, KIND)
    record = {"suite": config.suite, "digest": digest_of(config.suite), "versions": versions()}
    if (partial / _RECORD).is_file():
        there = {name: value for name, value in dict(read_json(partial / _RECORD)).items() if name in record}
        refuse_differing(differences(there, record), f"to go on, settings must stay: {partial / _RECORD}")
    results_folder.begin(partial, KIND)
    results_folder.note(partial, [_RECORD, FAILURES, "results/"])
    write_json(partial / _RECORD, record | {"command": config.command})
    return partial


def _cells(config: SuiteConfig, partial: Path, before: Results | None) -> Cells:
    """What is to be played of each policy in each scenario, the largest teams first."""
    parts = config.version.parts
    order = sorted(config.names, key=lambda name: -parts[name].scenario.n_robots)
    return {
        (spec.label, name): chunks_of(
            name, parts[name], spec, config.numbers[len(_kept(before, spec.label, name)) :], partial
        )
        for name in order
        for spec in config.specs
    }


def _kept(before: Results | None, label: str, name: str) -> tuple[float, ...]:
    """Scores that are there already."""
    if before is None or label not in before.entries:
        return ()
    return before.entries[label].scores.get(name, ())


def _results(config: SuiteConfig, cells: Cells, before: Results | None) -> Results:
    """Scores that were there, then those that were played."""
    entries = {}
    for spec in config.specs:
        scores = {
            name: sum((chunk.scores() for chunk in cells[spec.label, name]), _kept(before, spec.label, name))
            for name in config.names
        }
        entries[spec.label] = Entry(
            policy=str(spec), source=source_digest(spec), versions=versions(), scores=scores
        )
    numbers = config.numbers
    return Results(suite=config.suite, first=numbers.start, worlds=len(numbers), entries=entries)
