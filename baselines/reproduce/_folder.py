"""The folder of a reproduction: whose it is, what is finished in it, and how a figure gets there whole.

``config.json`` says which run it belongs to, ``episodes/`` keeps finished episodes, and ``figN/`` appears
when figure N is done.
"""

import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from baselines._plan import differences
from baselines._results import is_done
from wifipgo.errors import BadInputError, require
from wifipgo.text_files import read_json
from wifipgo.whole_files import write_json

CONFIG, CLAIMS, PAGE, EPISODES, FAILURES = (
    "config.json",
    "claims.json",
    "claims.md",
    "episodes",
    "failures.txt",
)
_KIND = "reproduce"


def claim(out: Path, record: Mapping[str, Any], *, resume: bool, overwrite: bool) -> None:
    """Make the folder, or take up the run that is there.

    Raises:
        ValueError: There is another run, or something that is no run, or no leave to go on.
        OSError: It cannot be made.
    """
    require(out.is_dir() or not out.exists(), "out", "a folder", str(out))
    if out.exists() and any(out.iterdir()):
        there = _record(out)
        if overwrite:
            _remove(out)
        else:
            require(resume, "out", "new or empty (--resume goes on, --overwrite starts over)", str(out))
            _refuse_other(there, record, out)
    out.mkdir(parents=True, exist_ok=True)
    write_json(out / CONFIG, {"kind": _KIND, **record})
    (out / EPISODES).mkdir(exist_ok=True)


def _record(out: Path) -> dict[str, Any]:
    """What a folder says that it is.

    Raises:
        ValueError: It is no reproduction.
    """
    try:
        found = read_json(out / CONFIG)
    except (OSError, ValueError):
        found = None
    ours = isinstance(found, dict) and found.get("kind") == _KIND
    require(ours, "out", "new, empty, or the folder of a reproduction", str(out))
    return dict(found or {})


def _refuse_other(there: Mapping[str, Any], record: Mapping[str, Any], out: Path) -> None:
    """Refuse to mix two runs; names what differs."""
    differing = list(differences(dict(there), {"kind": _KIND, **record}))
    if differing:
        fields = "; ".join(f"{name} ({old!r} there, {new!r} now)" for name, old, new in differing[:3])
        raise BadInputError(f"to go on, a run must stay the same: {out / CONFIG} differs in {fields}")


def _remove(out: Path) -> None:
    """Remove a reproduction, and nothing else."""
    known = {CONFIG, CLAIMS, PAGE, EPISODES, FAILURES}
    found = {path.name for path in out.iterdir()}
    others = sorted(name for name in found - known if not name.startswith("fig"))
    require(not others, "out", f"a reproduction to be replaced, but it also holds {others[:3]}", str(out))
    shutil.rmtree(out)


def done(out: Path, figure: str) -> bool:
    """Whether a figure is there."""
    return (out / figure / CLAIMS).is_file()


def missing(items: list[Any]) -> list[Any]:
    """Items whose results are not there yet."""
    return [item for item in items if not is_done(item.path)]


def staging(out: Path, figure: str) -> Path:
    """Empty folder for a figure that is not complete."""
    folder = out / f"{figure}.partial"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    return folder


def publish(folder: Path) -> None:
    """Give a complete figure its name."""
    os.replace(folder, folder.with_suffix(""))
