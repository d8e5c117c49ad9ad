"""Folders of results: which files in them a run of ours wrote, so that ``--overwrite`` removes nothing else.

Each folder has a manifest, ``manifest.jsonl``: the kind of run, then one name a line. Names are
noted before the files are written, so a run that is killed at any point leaves no file of its
own unlisted. A run that works in its folder::

    check_free(out, "train", overwrite=overwrite)  # before anything runs
    remove(out, "train")
    begin(out, "train")
    note(out, ["config.yaml", "checkpoints/step-1/policy.npz"])   # a name that ends in / is a folder of ours

A run whose results appear at the end works in a folder beside, which then gets the name::

    check_free(out, "optimise", overwrite=overwrite)  # also looks at OUT.replaced, of an interrupted run
    partial = partial_of(out)
    begin(partial, "optimise"); note(partial, ["results/"])
    ...
    publish(partial / "results", out, "optimise")
    remove(partial, "optimise")

Hold the folder's lock (`wifipgo.files.folder_lock`) meanwhile.
"""

import json
import os
import re
import shutil
from collections.abc import Iterable, Iterator
from pathlib import Path

from wifipgo.errors import BadInputError, require

MANIFEST = "manifest.jsonl"


def begin(folder: Path, kind: str) -> None:
    """Make a folder, or take up one of a run of this kind; without a manifest it has to be empty.

    Raises:
        BadInputError: There is something that no run of this kind wrote.
    """
    if not (folder / MANIFEST).exists():
        check_replaceable(folder, kind)
        folder.mkdir(parents=True, exist_ok=True)
        note(folder, [f"kind: {kind}", MANIFEST])


def note(folder: Path, names: Iterable[str]) -> None:
    """List files that are about to be written: paths in the folder, or folders that end in a slash."""
    with (folder / MANIFEST).open("a", encoding="utf-8") as file:
        file.write("".join(f"\n{json.dumps(name)}" for name in names) + "\n")  # after a line cut short


def is_of(folder: Path, kind: str) -> bool:
    """Whether a run of this kind wrote the folder."""
    return next(_listed(folder), None) == f"kind: {kind}"


def check_replaceable(out: Path, kind: str) -> None:
    """Refuse to replace a folder, or to remove an ``OUT.replaced``, unless all in it is a run's of this kind.

    Raises:
        BadInputError: Names what else is there.
    """
    for folder in (out, replaced_of(out)):
        if folder.is_symlink() or not folder.exists():
            require(not folder.is_symlink(), "out", "a folder, not a link", str(folder))
            continue
        require(folder.is_dir(), "out", "a folder", str(folder))
        others = foreign(folder, kind)
        if others:
            rule = f"to be replaced, a folder may hold nothing but results of {kind}"
            more = f" and {len(others) - 3} more" if len(others) > 3 else ""
            raise BadInputError(f"{rule}: {folder} also holds {', '.join(map(repr, others[:3]))}{more}")


def check_free(
    out: Path, kind: str, *, overwrite: bool, rule: str = "new or empty (--overwrite replaces what is there)"
) -> None:
    """Refuse, before any work, a folder that holds results without leave to replace them, or anything else.

    Args:
        out: Folder that results are to get.
        kind: Of the run.
        overwrite: Whether results of its kind may go.
        rule: What the folder has to be without that leave.

    Raises:
        BadInputError: Says what is there.
    """
    require(out.is_dir() or not out.exists(), "out", "a folder", str(out))
    if out.exists() and any(out.iterdir()):
        require(overwrite, "out", rule, str(out))
    check_replaceable(out, kind)


def foreign(folder: Path, kind: str) -> list[str]:
    """Files in a folder that no run of this kind wrote: all of them if it has no manifest."""
    listed = set(_listed(folder)) if is_of(folder, kind) else set()
    return sorted(name for name in _files(folder) if not _is_listed(name, listed))


def remove(folder: Path, kind: str) -> None:
    """Remove what a run of this kind wrote, the manifest last; whoever is killed here can do it again."""
    if not folder.exists():
        return
    check_replaceable(folder, kind)
    for name in _files(folder):
        if name != MANIFEST:
            (folder / name).unlink()
    for inner, _, _ in os.walk(folder, topdown=False):
        if Path(inner) != folder:
            Path(inner).rmdir()
    (folder / MANIFEST).unlink(missing_ok=True)
    folder.rmdir()


def partial_of(out: Path) -> Path:
    """Folder beside ``out`` in which a run works whose results appear at the end."""
    return out.with_name(f"{out.name}.partial")


def emptied(folder: Path) -> Path:
    """Make a folder for results that are not complete yet; what an earlier attempt left there goes."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    return folder


def replaced_of(out: Path) -> Path:
    """Where results are while others take their name."""
    return out.with_name(f"{out.name}.replaced")


def publish(staging: Path, out: Path, kind: str, later: Iterable[str] = ()) -> None:
    """Give complete results their name; what had it before goes only then.

    Args:
        staging: Folder of the results, on the same file system.
        out: Its name to be.
        kind: Of the run.
        later: Files that are written afterwards, e.g. pictures.

    Raises:
        BadInputError: There is something that no run of this kind wrote.
    """
    (staging / MANIFEST).unlink(missing_ok=True)
    names = list(_files(staging))
    note(staging, [f"kind: {kind}", MANIFEST, *names, *later])
    replaced = replaced_of(out)
    if out.exists():
        remove(replaced, kind)
        check_replaceable(out, kind)
        os.replace(out, replaced)
    os.replace(staging, out)
    if is_of(replaced, kind) or (replaced.exists() and not any(replaced.iterdir())):
        remove(replaced, kind)


def _listed(folder: Path) -> Iterator[str]:
    """Lines of the manifest; one that a kill cut short is none."""
    path = folder / MANIFEST
    if path.is_file():
        for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
            try:
                yield str(json.loads(line))
            except ValueError:
                continue


def _files(folder: Path) -> Iterator[str]:
    """All that is no folder, by the path within; links are not followed."""
    for inner, folders, files in os.walk(folder):
        here = Path(inner)
        links = [name for name in folders if (here / name).is_symlink()]
        for name in files + links:
            yield (here / name).relative_to(folder).as_posix()


def _is_listed(name: str, listed: set[str]) -> bool:
    """Whether a file is listed, in a listed folder, or the beginning of a listed file (`appearing`)."""
    path = Path(name)
    folders = {f"{parent.as_posix()}/" for parent in path.parents}
    finished = re.sub(r"^\.(.+)\.partial(\.\w+)$", r"\1\2", path.name.removesuffix(".tmp"))
    names = {MANIFEST, f"{MANIFEST}.tmp", *listed}
    return name in names or path.with_name(finished).as_posix() in names or not folders.isdisjoint(listed)
