"""Which files this process has made, so that a command that is stopped can say what of it is there."""

from pathlib import Path

_made: list[tuple[Path, Path]] = []  # where it is, and what it was called


def note_made(path: Path) -> None:
    """A file has appeared, whole."""
    _made.append((path.absolute(), path))


def mark() -> int:
    """A moment, for `made_since`."""
    return len(_made)


def made_since(moment: int) -> list[Path]:
    """Files made since then that are still there, as they were called, each once, in order."""
    return list({where: path for where, path in _made[moment:] if where.is_file()}.values())
