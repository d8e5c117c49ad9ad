"""A file is there whole or not at all, and what was there before stays until it is."""

import json
import re
from pathlib import Path

import pytest

from wifipgo.files.atomic_files import appearing, write_json, write_text


def cut_short(path: Path, *, by_suffix: bool) -> None:
    with appearing(path, by_suffix=by_suffix) as unfinished:
        unfinished.write_text("half", encoding="utf-8")
        assert (unfinished.suffix == path.suffix) is by_suffix
        raise OSError("the disk is full")


@pytest.mark.parametrize("by_suffix", [False, True])
def test_a_failure_leaves_what_was_there_and_nothing_else(tmp_path: Path, by_suffix: bool) -> None:
    path = tmp_path / "table.csv"
    path.write_text("old", encoding="utf-8")
    with pytest.raises(OSError, match="full"):
        cut_short(path, by_suffix=by_suffix)
    assert [p.name for p in tmp_path.iterdir()] == ["table.csv"]
    assert path.read_text(encoding="utf-8") == "old"


def test_json_that_cannot_be_written_leaves_the_old(tmp_path: Path) -> None:
    path = tmp_path / "new" / "summary.json"
    write_json(path, {"mean": 1.5})
    with pytest.raises(ValueError, match="not JSON compliant"):
        write_json(path, {"mean": float("nan")})
    assert json.loads(path.read_text(encoding="utf-8")) == {"mean": 1.5}
    assert [p.name for p in path.parent.iterdir()] == ["summary.json"]


@pytest.mark.parametrize("by_suffix", [False, True])
def test_nothing_is_written_through_a_link(tmp_path: Path, by_suffix: bool) -> None:
    """Somebody who knows the unfinished name put a link there."""
    path, other = tmp_path / "table.csv", tmp_path / "others"
    other.write_text("theirs", encoding="utf-8")
    (tmp_path / (".table.partial.csv" if by_suffix else "table.csv.tmp")).symlink_to(other)
    with appearing(path, by_suffix=by_suffix) as unfinished:
        unfinished.write_text("ours", encoding="utf-8")
    assert other.read_text(encoding="utf-8") == "theirs"
    assert path.read_text(encoding="utf-8") == "ours"
    assert not path.is_symlink()


def test_a_failure_names_the_file_that_was_asked_for(tmp_path: Path) -> None:
    folder = tmp_path / "picture.png"
    folder.mkdir()
    for path in (folder, tmp_path / "nowhere" / "picture.png"):
        with pytest.raises(OSError, match=re.escape(f"'{path}'")) as failure:
            write_text(path, "whole")
        assert failure.value.filename == str(path)
