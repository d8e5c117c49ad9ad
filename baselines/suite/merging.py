"""Join runs of a suite: other policies, scenarios or worlds of the same version."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from baselines.suite.report import KIND, publish, report
from baselines.suite.results import FILE, Results, joined, read_results
from baselines.suite.standings import reference_of
from wifipgo.errors import require
from wifipgo.files import results_folder
from wifipgo.files.folder_lock import held


def are_suites(parts: Sequence[Path]) -> bool:
    """Whether folders hold runs of a suite."""
    return len(parts) > 0 and all((part / FILE).is_file() for part in parts)


def merge_suites(out: Path, parts: Sequence[Path], *, console: Console) -> Results:
    """Write the results of all parts as those of one run.

    Raises:
        BadInputError: Parts that do not fit together, or a folder that is not empty.
        OSError: A folder that cannot be written.
    """
    results = joined([read_results(part / FILE) for part in parts])
    reference = reference_of(list(results.entries))
    with held(out):
        require(not out.exists() or not any(out.iterdir()), "out", "new or empty", str(out))
        partial = results_folder.partial_of(out.resolve())
        results_folder.begin(partial, KIND)
        results_folder.note(partial, ["results/"])
        standings = publish(results, reference, partial, out.resolve())
    report(standings, results, reference, out, console)
    return results
