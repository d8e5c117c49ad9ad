"""Folder of a training: taken up, replaced, or new."""

from pathlib import Path

from wifipgo.errors import require
from wifipgo.files.results_folder import check_free, is_of, remove


def check_claim(out: Path, kind: str, *, resume: bool, overwrite: bool) -> None:
    """See that a run in the folder may be continued or replaced; changes nothing.

    Raises:
        BadInputError: There is a run and no leave to replace or continue it, or something that is no run.
    """
    if resume:
        require(is_of(out, kind), "out", f"a folder of {kind}, with its manifest.jsonl", str(out))
    else:
        rule = "new or empty (--resume continues a run, --overwrite replaces it)"
        check_free(out, kind, overwrite=overwrite, rule=rule)


def claim(out: Path, kind: str, *, resume: bool, overwrite: bool) -> None:
    """The same, and remove a run that is to be replaced.

    Raises:
        BadInputError: See `check_claim`.
        OSError: The folder cannot be written.
    """
    check_claim(out, kind, resume=resume, overwrite=overwrite)
    if not resume and is_of(out, kind):
        remove(out, kind)
