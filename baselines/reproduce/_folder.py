"""The folder of a reproduction: whose it is, what is finished in it, and how a figure gets there whole.

``config.json`` says which run it belongs to, ``episodes/`` keeps finished episodes, and ``figN/`` appears
when figure N is done.
"""

import os
import shutil
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from baselines.evaluation.jobs import FAILURES
from baselines.evaluation.plan import differences, refuse_differing
from wifipgo.command.command_line import say
from wifipgo.errors import BadInputError, require
from wifipgo.files import results_folder
from wifipgo.files.atomic_files import write_json
from wifipgo.files.text_files import read_json

CONFIG, CLAIMS, PAGE, EPISODES = "config.json", "claims.json", "claims.md", "episodes"
_KIND = "reproduce"


def claim(out: Path, record: Mapping[str, Any], *, resume: bool, overwrite: bool) -> None:
    """Make the folder, or take up the run that is there.

    Raises:
        BadInputError: There is another run, or something that is no run, or no leave to go on.
        OSError: It cannot be made.
    """
    require(out.is_dir() or not out.exists(), "out", "a folder", str(out))
    if out.exists() and any(out.iterdir()):
        if overwrite:
            results_folder.remove(out, _KIND)
        else:
            there = _record(out)
            require(resume, "out", "new or empty (--resume goes on, --overwrite starts over)", str(out))
            differing = differences(there, {"kind": _KIND, **record})
            refuse_differing(differing, f"to go on, a run must stay the same: {out / CONFIG}")
    results_folder.begin(out, _KIND)
    results_folder.note(out, [CONFIG, CLAIMS, PAGE, FAILURES])
    write_json(out / CONFIG, {"kind": _KIND, **record})
    (out / EPISODES).mkdir(exist_ok=True)


def note(out: Path, paths: Iterable[Path]) -> None:
    """List files that are about to be written."""
    results_folder.note(out, [path.relative_to(out).as_posix() for path in paths])


def _record(out: Path) -> dict[str, Any]:
    """What a folder says that it is.

    Raises:
        BadInputError: It is no reproduction, or its record is damaged.
    """
    require(results_folder.is_of(out, _KIND), "out", "new, empty, or the folder of a reproduction", str(out))
    found = read_json(out / CONFIG) if (out / CONFIG).exists() else {"kind": _KIND}
    ours = isinstance(found, dict) and found.get("kind") == _KIND
    require(ours, str(out / CONFIG), "the record of a reproduction", found)
    return dict(found)


def done(out: Path, figure: str, roots: Sequence[int] | None = None) -> bool:
    """Whether a figure is there, of these roots if given; one whose claims cannot be read is made again."""
    try:
        found = read_json(out / figure / CLAIMS)
        return isinstance(found, dict) and (roots is None or found["run"]["roots"] == list(roots))
    except FileNotFoundError:
        return False
    except BadInputError as problem:
        say(f"warning: {problem}; {figure} is made again", error=True)
        return False


def staging(out: Path, figure: str) -> Path:
    """Empty folder for a figure that is not complete."""
    folder = out / f"{figure}.partial"
    results_folder.note(out, [f"{folder.name}/"])
    return results_folder.emptied(folder)


def publish(folder: Path) -> None:
    """Give a complete figure its name."""
    final = folder.with_suffix("")
    note(folder.parent, [final / path.relative_to(folder) for path in folder.rglob("*")])
    shutil.rmtree(final, ignore_errors=True)  # one whose claims could not be read
    os.replace(folder, final)
