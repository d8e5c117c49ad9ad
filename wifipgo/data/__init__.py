"""Data to start from, of our own making: recordings of Wi-Fi channels, and a team's pose graph.

Simulated and written by `benchmarks.example_data`, so they may be used for anything. What they hold, and
where the public sets are: ``docs/howto/data.md``.
"""

import os
from pathlib import Path

from wifipgo.errors import nearest, require

EXAMPLE = "example"  # the word that stands for these data on the command line
CSI, GRAPH = "csi", "graph"  # their folders
PACK, RUN = "links.npz", "run"  # of the recordings: a pack of links, and the folder of a raw run


def example_data() -> Path:
    """Folder of the data that ship with the package; they are read, not written.

    Returns:
        A folder with ``csi/links.npz``, ``csi/run`` and ``graph``.
    """
    return Path(__file__).parent / EXAMPLE


def public_data() -> Path:
    """Folder of the public sets: ``$WIFIPGO_DATA``, else ``shared/data`` beside the checkout."""
    beside = Path(__file__).resolve().parents[3] / "shared" / "data"
    return Path(os.environ.get("WIFIPGO_DATA", beside))


def example_or_path(path: Path, folder: str) -> Path:
    """What a path of a command stands for: ``example`` is a folder of ours, if nothing there is called so.

    Raises:
        BadInputError: Nothing is there, and the name is nearly ``example``.
    """
    if path.exists():
        return path
    if path == Path(EXAMPLE):
        return example_data() / folder
    near = nearest(str(path), [EXAMPLE])
    require(not near, "path", f"a file or folder that exists; did you mean {EXAMPLE!r}?", str(path))
    return path
