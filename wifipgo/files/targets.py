"""Files that a command was asked to write, checked before any work."""

import tempfile
from collections.abc import Mapping
from pathlib import Path

from wifipgo.errors import pick, require


def check_target(
    field: str, path: Path, kinds: Mapping[str, object], *, overwrite: bool, folder_comes: bool = False
) -> None:
    """Refuse, before anything runs, a file that could not be written.

    Args:
        field: What asked for it, for messages.
        path: The file.
        kinds: By suffix, in lower case.
        overwrite: Whether a file that is there may be replaced.
        folder_comes: Its folder is one that the run itself makes.

    Raises:
        ValueError: An unknown kind of file (the message lists those that exist), a folder that does not
            exist, or a file that is there and may not be replaced.
    """
    pick(kinds, path.suffix.lower(), f"kind of file for {field}")
    require(not path.is_dir(), field, "a file", str(path))
    require(overwrite or not path.exists(), field, "new (--overwrite replaces what is there)", str(path))
    if folder_comes:
        return
    require(path.parent.is_dir(), field, "in a folder that exists", str(path))
    try:
        tempfile.TemporaryFile(dir=path.parent).close()
    except OSError as failure:
        require(False, field, f"in a folder that takes files ({failure.strerror})", str(path))
