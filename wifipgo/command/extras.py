"""Packages that only extras bring: loaded when they are asked for, and one sentence where they cannot be."""

import importlib
import importlib.util

from wifipgo.command.checkout import install_line
from wifipgo.errors import MissingExtraError


def load_extra(what: str, extra: str, *modules: str) -> None:
    """Load modules of an extra, if all are there.

    Args:
        what: What needs them, e.g. ``wifipgo train``.
        extra: Its name in pyproject.toml.
        modules: Names of the modules.

    Raises:
        MissingExtraError: One is not installed, or fails while it is loaded; says how to install it.
    """
    find_extra(what, extra, *modules)
    for module in modules:
        try:
            importlib.import_module(module)
        except Exception as problem:  # where a library lacks a file: OSError, and others
            raise MissingExtraError(_needs(what, extra, module, problem)) from problem


def find_extra(what: str, extra: str, *modules: str) -> None:
    """The same without loading them, which takes long for some.

    Raises:
        MissingExtraError: One is not installed.
    """
    for module in modules:
        if not _is_there(module):
            raise MissingExtraError(_needs(what, extra, module, ModuleNotFoundError(name=module)))


def _is_there(module: str) -> bool:
    """Whether a module can be found; a part of a package needs the package."""
    try:
        return importlib.util.find_spec(module) is not None
    except ImportError:
        return False
    except ValueError:  # somebody put it into sys.modules by hand
        return True


def _needs(what: str, extra: str, module: str, problem: Exception) -> str:
    """One sentence: what is missing or broken, and how to install it."""
    absent = isinstance(problem, ModuleNotFoundError) and problem.name in {module, module.partition(".")[0]}
    reason = (str(problem).splitlines() or [""])[0]
    state = "is not installed" if absent else f"cannot be loaded ({type(problem).__name__}: {reason})"
    return f"{what} needs {module}, which {state}: install the extra '{extra}' with {install_line(extra)}"
