"""One run at a time in a results folder: a lock that ends with the process that holds it.

::

    with held(out):
        ...

The lock is the operating system's, on an open file ``OUT.lock`` beside the folder: a file
that a dead process left, on this computer or another, locks nothing.
"""

import errno
import os
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from wifipgo.errors import BadInputError

_TAKEN = (errno.EACCES, errno.EAGAIN, errno.EDEADLK)
_BYTE = 1 << 30  # Windows keeps others from reading what is locked: a byte behind the text


@contextmanager
def held(out: Path) -> Iterator[None]:
    """Hold the lock of a folder, which need not exist yet.

    Raises:
        BadInputError: Another run works in the folder; names its process and computer.
        OSError: The file of the lock cannot be written.
    """
    out = out.resolve()
    path = out.with_name(f"{out.name}.lock")
    path.parent.mkdir(parents=True, exist_ok=True)
    file = _taken(path, out)
    try:
        os.ftruncate(file, 0)
        os.write(file, f"process {os.getpid()} on {socket.gethostname()}\n".encode())
        yield
    finally:
        if sys.platform == "win32":
            os.close(file)
            file = -1
        with suppress(OSError):  # on Windows somebody may have opened it again
            path.unlink()
        if file >= 0:
            os.close(file)


def _taken(path: Path, out: Path) -> int:
    """Descriptor of the locked file; once more where its last holder removed it meanwhile."""
    while True:
        file = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o644)
        try:
            _lock(file)
            if _is_at(file, path):
                return file
        except OSError as failure:
            holder = os.pread(file, 200, 0).decode(errors="replace").strip() if hasattr(os, "pread") else ""
            os.close(file)
            if failure.errno not in _TAKEN:
                raise
            where = f"out must be a folder that no other run works in, got {str(out)!r}"
            raise BadInputError(f"{where}: {holder or 'another process'} does (lock: {path})") from failure
        os.close(file)


def _is_at(file: int, path: Path) -> bool:
    """Whether an open file is still the one that the path names."""
    with suppress(FileNotFoundError):
        return os.path.samestat(os.fstat(file), path.stat())
    return False


def _lock(file: int) -> None:
    """Lock an open file or raise; file systems that know no locks are used without."""
    try:
        if sys.platform == "win32":
            import msvcrt  # noqa: PLC0415

            os.lseek(file, _BYTE, os.SEEK_SET)
            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
            os.lseek(file, 0, os.SEEK_SET)
        else:
            import fcntl  # noqa: PLC0415

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as failure:
        if failure.errno not in (errno.ENOLCK, errno.ENOSYS, errno.ENOTSUP):
            raise
