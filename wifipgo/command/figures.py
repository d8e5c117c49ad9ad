"""Pictures under the project's own settings, which never decide over results.

Import this module before matplotlib, where ruff sorts it, and draw in its block::

    from wifipgo.command.figures import Figure, drawing

    with drawing(out / "err.png"):
        figure = Figure()
        ...

A user's ``matplotlibrc``, ``MPLBACKEND`` or TeX change nothing in it, and one that cannot be
drawn is a warning on standard error. No window is opened: `matplotlib.figure.Figure` writes files.
"""

import importlib
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from wifipgo.command.command_line import say

__all__ = ["Axes", "Figure", "drawing", "own_settings"]


def _load() -> None:
    """Load matplotlib, if need be without the user's settings: a back-end that is not there is refused."""
    try:
        importlib.import_module("matplotlib")
    except Exception:
        for name in [name for name in sys.modules if name.split(".")[0] == "matplotlib"]:
            del sys.modules[name]
        _load_bare()


def _load_bare() -> None:
    """Load matplotlib with nothing but its own defaults."""
    own = {"MPLBACKEND": "agg", "MATPLOTLIBRC": os.devnull}
    before = {name: os.environ.get(name) for name in own}
    os.environ.update(own)
    try:
        importlib.import_module("matplotlib")
    finally:
        for name, value in before.items():
            os.environ.pop(name)
            os.environ.update({} if value is None else {name: value})


_load()

from matplotlib.axes import Axes  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402


@contextmanager
def own_settings() -> Iterator[None]:
    """Draw with matplotlib's defaults, whatever the user has set; that is as before afterwards."""
    import matplotlib as mpl  # noqa: PLC0415 (what this module has loaded)

    with mpl.rc_context():
        mpl.rcdefaults()
        yield


@contextmanager
def drawing(path: Path, *, asked_for: bool = False) -> Iterator[None]:
    """Draw a picture in this block, under `own_settings`; what fails in it is a warning that names the file.

    Args:
        path: File of the picture.
        asked_for: Whether the user named the file, so that one that cannot be written is an error.
    """
    try:
        with own_settings():
            yield
    except Exception as problem:
        if asked_for and isinstance(problem, OSError):
            raise
        why = (str(problem).splitlines() or [""])[0]
        say(f"warning: {path} was not drawn: {type(problem).__name__}: {why}", error=True)
