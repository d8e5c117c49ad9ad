"""The four packages of the project, whatever a folder of the user's holds under the same names.

``envs``, ``train`` and ``baselines`` are names that others use too. The command ``wifipgo`` finds its own
packages first (`find_own_first`) and leaves the current folder out (`leave_out_current_folder`). Where
Python takes another one, in ``python -m baselines.evaluate`` or a program, `check_floors` says which, and so
does an import of what only the project's package has (`explain_shadows`).
"""

import os
import sys
from collections.abc import Iterable
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

FLOORS = ("wifipgo", "envs", "baselines", "train")
# What holds the packages: a checkout, or where the package was installed.
ROOT = Path(__file__).resolve().parents[2]


class OwnPackages(MetaPathFinder):
    """Finds the project's packages beside `wifipgo`, before anybody looks for them in a path."""

    def find_spec(
        self, fullname: str, path: Iterable[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Claim the four names, and nothing else."""
        return PathFinder.find_spec(fullname, [str(ROOT)]) if fullname in FLOORS else None


class Shadowed(MetaPathFinder):
    """Comes last: says what is wrong where a module is asked for that only the project's package has."""

    def find_spec(
        self, fullname: str, path: Iterable[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Find nothing.

        Raises:
            ImportError: The module is the project's, and the package that was asked is another.
        """
        package, dot, _ = fullname.partition(".")
        if dot and package in FLOORS and _is_own(fullname):
            check_floors(package)
        return None


def _is_own(module: str) -> bool:
    """Whether the project has a module of that name."""
    place = ROOT.joinpath(*module.split("."))
    return place.is_dir() or place.with_suffix(".py").is_file()


def explain_shadows() -> None:
    """Let imports in this process that a package of others' makes fail say so."""
    if not any(isinstance(finder, Shadowed) for finder in sys.meta_path):
        sys.meta_path.append(Shadowed())


def find_own_first() -> None:
    """Let the four names mean the project's packages in this process from now on."""
    if not any(isinstance(finder, OwnPackages) for finder in sys.meta_path):
        sys.meta_path.insert(0, OwnPackages())


def leave_out_current_folder() -> None:
    """Take away the current folder that ``python -m`` looks in first, unless the project is there."""
    here = Path.cwd()
    if sys.path and Path(sys.path[0] or here).resolve() == here != ROOT:
        del sys.path[0]


def check_floors(*names: str) -> None:
    """Refuse packages of others under names that the project's own have.

    Raises:
        ImportError: Another package is found; says where it is and what to do.
        SystemExit: The same where ``python -m`` is about to start one of the commands.
    """
    for name in names:
        found = _found(name)
        if found is not None and found != ROOT / name:
            _refuse(name, found)


def _found(name: str) -> Path | None:
    """Folder of a package, or file of a module, that a name means in this process."""
    try:
        spec = find_spec(name)
    except ValueError:  # somebody put it into sys.modules by hand
        return None
    if spec is None:
        return None
    if spec.submodule_search_locations is not None:
        return Path(next(iter(spec.submodule_search_locations))).resolve()
    return Path(spec.origin).resolve() if spec.origin else None


def _refuse(name: str, found: Path) -> None:
    """Say it in a line; a command ends there."""
    advice = (
        f"rename it, work in another folder, or use the command wifipgo, which {found.name} does not touch"
    )
    message = f"{found} shadows the package {name!r} of wifipgo, which is in {ROOT}: {advice}"
    if sys.argv[:1] == ["-m"]:
        os.write(2, f"error: {message}\n".encode(errors="replace"))
        raise SystemExit(2)
    raise ImportError(message)
