"""Archives of arrays (.npz) from outside: no pickle, and measured before anything is unpacked."""

import struct
import tokenize
import zlib
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from io import BufferedReader, BytesIO
from math import prod
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZIP_STORED, BadZipFile, ZipFile, ZipInfo

import numpy as np

from wifipgo.errors import BadInputError, quoted, require
from wifipgo.files.atomic_files import read_sealed

MAX_BYTES = 1 << 28
MAX_MEMBERS = 10_000
_SUFFIX = ".npy"
_MAX_HEADER_BYTES = 4_096
_HEADERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}
_BROKEN = (
    BadZipFile,
    zlib.error,
    struct.error,
    tokenize.TokenError,
    ArithmeticError,
    EOFError,
    KeyError,
    MemoryError,
    OSError,  # places beyond the end
    RuntimeError,
    SyntaxError,
    TypeError,
    ValueError,
)


def read_npz(
    path: Path, *, max_bytes: int = MAX_BYTES, max_members: int = MAX_MEMBERS
) -> dict[str, np.ndarray]:
    """Read every array of an archive that `numpy.savez` or `numpy.savez_compressed` wrote.

    Sizes are taken from the archive's directory and from the header of each array, which must agree, so
    an archive that would fill the memory is refused while it is still packed.

    Args:
        path: File.
        max_bytes: Largest size of all arrays together, unpacked.
        max_members: Largest number of arrays.

    Raises:
        BadInputError: Not such an archive, cut, damaged, too large, or with objects in it; names the file
            and the array.
        OSError: It cannot be opened.
    """
    with path.open("rb") as file:
        return _read(file, path, max_bytes=max_bytes, max_members=max_members)


def read_sealed_npz(path: Path, *, max_bytes: int = MAX_BYTES) -> dict[str, np.ndarray]:
    """The same of an archive in a file of `wifipgo.files.atomic_files.write_sealed`.

    Raises:
        BadInputError: See `read_npz`; or the digest is of other content.
        OSError: It cannot be opened.
    """
    return _read(BytesIO(read_sealed(path)), path, max_bytes=max_bytes, max_members=MAX_MEMBERS)


def _read(
    file: BufferedReader | BytesIO, path: Path, *, max_bytes: int, max_members: int
) -> dict[str, np.ndarray]:
    with _blamed(str(path)), ZipFile(file) as archive:
        members = archive.infolist()
        _check_directory(members, str(path), max_bytes=max_bytes, max_members=max_members)
        for member in members:
            _check_header(archive, member, path)
        return {member.filename.removesuffix(_SUFFIX): _array(archive, member, path) for member in members}


def _place(path: Path, member: ZipInfo) -> str:
    """What a message calls a member of an archive."""
    return f"{path}: array {quoted(member.filename.removesuffix(_SUFFIX))}"


@contextmanager
def _blamed(place: str) -> Iterator[None]:
    """Refuse in one sentence what the readers of the archive, its streams and its headers trip over."""
    try:
        yield
    except BadInputError:
        raise
    except _BROKEN as problem:
        kind = type(problem).__name__
        why = str(problem).partition("\n")[0] or kind
        raise BadInputError(f"{place} cannot be read, it is no .npz, damaged or cut: {why}") from problem


def _check_directory(members: list[ZipInfo], place: str, *, max_bytes: int, max_members: int) -> None:
    """Raise unless what the directory announces can be unpacked."""
    require(len(members) <= max_members, f"{place}: number of arrays", f"<= {max_members}", len(members))
    counts = Counter(member.filename for member in members)
    twice = [name for name, count in counts.items() if count > 1]
    require(not twice, f"{place}: names of arrays", "different", twice)
    for member in members:
        packing, what = member.compress_type, quoted(member.filename)
        require(
            packing in {ZIP_STORED, ZIP_DEFLATED}, f"{place}: packing of {what}", "none or deflate", packing
        )
        require(member.filename.endswith(_SUFFIX), f"{place}: a member", "an array (.npy)", member.filename)
    total = sum(member.file_size for member in members)
    require(total <= max_bytes, f"{place}: size of its arrays in bytes", f"<= {max_bytes}", total)


def _check_header(archive: ZipFile, member: ZipInfo, path: Path) -> None:
    """Raise unless an array is of plain numbers or text, and as large as its member of the archive."""
    place = _place(path, member)
    with _blamed(place), archive.open(member) as packed:
        version = np.lib.format.read_magic(packed)
        require(version in _HEADERS, f"{place}: version of .npy", "1.0 or 2.0", version)
        shape, _, dtype = _HEADERS[version](packed, max_header_size=_MAX_HEADER_BYTES)
        there = member.file_size - packed.tell()
    require(not dtype.hasobject, place, "of numbers or text, not of Python objects", dtype)
    require(dtype.itemsize > 0 and min(shape, default=0) >= 0, place, "of items that have a size", dtype)
    claimed = dtype.itemsize * prod(shape)
    require(claimed == there, f"{place}: size in bytes", f"{claimed}, as its shape {shape} says", there)


def _array(archive: ZipFile, member: ZipInfo, path: Path) -> np.ndarray:
    """Unpack one array, to its end: only there its checksum is looked at."""
    with _blamed(_place(path, member)), archive.open(member) as packed:
        array = np.lib.format.read_array(packed, allow_pickle=False, max_header_size=_MAX_HEADER_BYTES)
        require(not packed.read(1), _place(path, member), "at its end after its last item", "more bytes")
        return np.asarray(array)
