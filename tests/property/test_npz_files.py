"""Archives of arrays: what numpy wrote is read; a file that was changed is refused in one sentence."""

import tracemalloc
import zipfile
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

from wifipgo.errors import BadInputError
from wifipgo.files.atomic_files import write_sealed
from wifipgo.files.npz_files import read_npz, read_sealed_npz

ARRAYS = {
    "mean": np.linspace(0.0, 1.0, 7),
    "words": np.array("free text"),
    "nets/0/weight": np.asfortranarray(np.arange(6, dtype=np.float32).reshape(2, 3)),
    "none": np.zeros((0, 3)),
}


def _header(shape: str, descr: str = "'<f8'") -> bytes:
    text = f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}".encode()
    text += b" " * ((64 - (len(text) + 11) % 64) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text


def _archive(path: Path, members: dict[str, bytes], packing: int = zipfile.ZIP_DEFLATED) -> Path:
    with zipfile.ZipFile(path, "w", packing) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return path


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_what_numpy_saves_is_read_to_the_bit(tmp_path: Path, save: object) -> None:
    """Every kind of array that the project writes."""
    save(tmp_path / "a.npz", **ARRAYS)  # type: ignore[operator]
    read = read_npz(tmp_path / "a.npz")
    assert list(read) == list(ARRAYS)
    for name, array in ARRAYS.items():
        assert read[name].dtype == array.dtype
        np.testing.assert_array_equal(read[name], array)


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_no_damaged_byte_escapes(tmp_path: Path, save: object) -> None:
    """Bytes of a file flipped in turn: the same arrays, or a refusal that names the file."""
    path = tmp_path / "a.npz"
    save(path, **{name: ARRAYS[name] for name in ("mean", "words")})  # type: ignore[operator]
    whole = path.read_bytes()
    for place in range(0, len(whole), 5):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0xFF]) + whole[place + 1 :])
        try:
            read = read_npz(path)
        except BadInputError as problem:
            assert str(path) in str(problem)  # noqa: PT017
            continue
        for name in set(read) & set(ARRAYS):
            np.testing.assert_array_equal(read[name], ARRAYS[name])


def test_a_cut_file_is_refused(tmp_path: Path) -> None:
    """At every length but the whole one."""
    path = tmp_path / "a.npz"
    np.savez_compressed(path, **ARRAYS)  # type: ignore[arg-type]
    whole = path.read_bytes()
    for length in range(0, len(whole), 7):
        path.write_bytes(whole[:length])
        with pytest.raises(BadInputError, match=r"a\.npz"):
            read_npz(path)


REFUSED = {
    "more than is there": (
        {"x.npy": _header("(1000000000000,)")},
        "'x': size in bytes must be 80{11}",
    ),
    "less than is there": ({"x.npy": _header("(1,)") + bytes(80)}, "'x': size in bytes must be 8"),
    "negative": ({"x.npy": _header("(-1,)") + bytes(8)}, "'x'"),
    "objects": ({"x.npy": _header("(1,)", "'|O'") + bytes(8)}, "not of Python objects"),
    "objects in a field": ({"x.npy": _header("(1,)", "[('a', '|O')]") + bytes(8)}, "not of Python objects"),
    "items without size": ({"x.npy": _header("(1000000000000,)", "'<U0'")}, "items that have a size"),
    "nesting": ({"x.npy": _header("(" * 3000)}, "'x' cannot be read"),
    "a long header": ({"x.npy": _header("(1,)" + " " * 9000) + bytes(8)}, "'x' cannot be read"),
    "no array": ({"x.txt": b"words"}, r"an array \(.npy\)"),
    "a pickle": ({"x.npy": b"\x80\x04cos\nsystem\n(S'true'\ntR."}, "'x' cannot be read"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_an_array_that_is_not_what_it_claims_is_refused(tmp_path: Path, case: str) -> None:
    """The message names the file, the array and what is wrong with it."""
    members, words = REFUSED[case]
    with pytest.raises(BadInputError, match=words):
        read_npz(_archive(tmp_path / "x.npz", members))


def test_other_packing_and_too_many_arrays_are_refused(tmp_path: Path) -> None:
    """bzip2 unpacks without bound in steps; ten thousand arrays are nobody's."""
    array = {"x.npy": _header("(1,)") + bytes(8)}
    with pytest.raises(BadInputError, match=r"packing of 'x\.npy'"):
        read_npz(_archive(tmp_path / "x.npz", array, zipfile.ZIP_BZIP2))
    with pytest.raises(BadInputError, match=r"number of arrays must be <= 1, got 2"):
        read_npz(_archive(tmp_path / "y.npz", {"x.npy": b"", "y.npy": b""}), max_members=1)


def test_the_same_name_twice_is_refused(tmp_path: Path) -> None:
    """`numpy.load` would give the last one and say nothing."""
    path = tmp_path / "x.npz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("x.npy", _header("(1,)") + bytes(8))
        with pytest.warns(UserWarning, match="Duplicate name"):
            archive.writestr("x.npy", _header("(1,)") + bytes(8))
    with pytest.raises(BadInputError, match=r"names of arrays must be different, got \['x\.npy'\]"):
        read_npz(path)


def test_a_bomb_is_refused_while_it_is_packed(tmp_path: Path) -> None:
    """64 kB that unpack to 64 MiB: the memory does not grow by a fraction of that."""
    path = tmp_path / "bomb.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("x.npy", "w") as member:
        member.write(_header(f"({1 << 23},)"))
        for _ in range(1 << 2):
            member.write(bytes(1 << 24))
    tracemalloc.start()
    with pytest.raises(BadInputError, match="size of its arrays in bytes must be <= 33554432, got 67108992"):
        read_npz(path, max_bytes=1 << 25)
    assert tracemalloc.get_traced_memory()[1] < 1_000_000
    tracemalloc.stop()


def test_a_sealed_archive_is_read_like_any(tmp_path: Path) -> None:
    np.savez(buffer := BytesIO(), allow_pickle=False, **ARRAYS)
    write_sealed(tmp_path / "a.npz", buffer.getvalue())
    found = read_sealed_npz(tmp_path / "a.npz")
    assert found.keys() == ARRAYS.keys()
    assert all(np.array_equal(found[name], array) for name, array in ARRAYS.items())
    with pytest.raises(BadInputError, match="size of its arrays in bytes"):
        read_sealed_npz(tmp_path / "a.npz", max_bytes=10)
