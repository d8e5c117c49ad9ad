"""Whatever editor saved a text, it reads the same; what is no text is refused by name and line."""

import codecs
import json
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from wifipgo.errors import BadInputError, TextFileError
from wifipgo.files.text_files import number, read_json, read_lines, read_text, whole_number
from wifipgo.scenarios.toml_files import read_toml

PLAIN = st.text(st.characters(exclude_categories=["Cc", "Cs"], exclude_characters="\ufeff"))


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(lines=st.lists(PLAIN, min_size=1), end=st.sampled_from(["\n", "\r\n", "\r"]), mark=st.booleans())
def test_lines_come_back_whatever_ends_them(tmp_path: Path, lines: list[str], end: str, mark: bool) -> None:
    text = "".join(line + end for line in lines)
    path = tmp_path / "any.txt"
    path.write_bytes(codecs.BOM_UTF8 * mark + text.encode())
    assert read_lines(path) == lines


def test_form_feeds_are_blanks(tmp_path: Path) -> None:
    path = tmp_path / "paged.txt"
    path.write_bytes(b"1 2\f\n\f3\v4\n\f")
    assert [line.split() for line in read_lines(path)] == [["1", "2"], ["3", "4"], []]


@pytest.mark.parametrize("coding", ["utf-16", "utf-16-le", "utf-16-be", "utf-32"])
def test_other_unicode_is_named(tmp_path: Path, coding: str) -> None:
    path = tmp_path / "wide.txt"
    path.write_bytes("seed = 1\n".encode(coding))
    for reader in (read_text, read_lines):
        with pytest.raises(TextFileError, match=r"wide.txt.* expected text in UTF-8, got .*UTF-(16|32)"):
            reader(path)


def test_an_undecodable_byte_is_named_by_its_line(tmp_path: Path) -> None:
    path = tmp_path / "latin.txt"
    path.write_bytes("a\nb\ncaf\u00e9\n".encode("latin-1"))
    with pytest.raises(BadInputError, match=r"latin.txt:3: expected text in UTF-8, got byte 0xe9"):
        read_text(path)
    with pytest.raises(TextFileError, match=r"latin.txt:3: expected text in UTF-8, got byte 0xe9"):
        read_lines(path)


def test_what_is_far_too_long_is_not_read_whole(tmp_path: Path) -> None:
    path = tmp_path / "long.txt"
    path.write_bytes(b"x" * 101)
    with pytest.raises(BadInputError, match=r"long.txt: expected text of at most 100 bytes"):
        read_text(path, most_bytes=100)
    path.write_bytes(b"x\n" + b"1" * 10**7)
    with pytest.raises(TextFileError, match=r"long.txt:2: expected lines of at most"):
        read_lines(path)


@pytest.mark.parametrize("text", ["1.5", "-2", "1e-3", "nan", "+7"])
def test_numbers_are_what_python_makes_of_them(text: str) -> None:
    assert repr(number(text, "here", 1)) == repr(float(text))


@pytest.mark.parametrize("text", ["1,5", "1_0", "x", "", "0x1", "\u0663", "9" * 10**6])
def test_what_no_file_calls_a_number(text: str) -> None:
    for reader in (number, whole_number):
        with pytest.raises(BadInputError, match=r"^here:3: expected a") as caught:
            reader(text, "here", 3)
        assert len(str(caught.value)) < 500


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_scenario_of_another_editor(tmp_path: Path, end: str) -> None:
    path = tmp_path / "room.toml"
    lines = ['base = "paper-hw-2"', "\fn_steps = 4\t", "kappa = 1.5", ""]
    path.write_bytes(codecs.BOM_UTF8 + end.join(lines).encode())
    assert read_toml(path) == {"base": "paper-hw-2", "n_steps": 4, "kappa": 1.5}


def test_a_decimal_comma_in_a_scenario_is_named(tmp_path: Path) -> None:
    path = tmp_path / "room.toml"
    path.write_text("n_steps = 4\nkappa = 1,5\n")
    with pytest.raises(BadInputError, match=r"room.toml is not TOML: .*decimal point, got 'kappa = 1,5'"):
        read_toml(path)


@pytest.mark.parametrize(
    "text",
    [
        "a = " + "[" * 100_000,
        "a = " + "{b = " * 100_000,
        "a" + ".a" * 100_000 + " = 1",  # an hour for tomllib
        "[[" + "'a' . " * 100_000 + "a]]",
        "a = {" + '"b".' * 100_000 + "b = 1}",
    ],
    ids=["arrays", "tables", "key", "header", "inline"],
)
def test_toml_nested_too_deep(tmp_path: Path, text: str) -> None:
    path = tmp_path / "deep.toml"
    path.write_text(text)
    with pytest.raises(BadInputError, match=r"deep.toml is not TOML: nested too deep"):
        read_toml(path)


def test_json_of_another_editor_and_json_that_is_none(tmp_path: Path) -> None:
    path = tmp_path / "record.json"
    path.write_bytes(
        codecs.BOM_UTF8 + json.dumps({"a": [1, "\u00b2"]}, indent=1).replace("\n", "\r\n").encode()
    )
    assert read_json(path) == {"a": [1, "\u00b2"]}
    bad = {
        "": "record.json:1: not JSON",
        "{\n\n": "record.json:3: ",
        "[" * 100_000: "too deep",
        "9" * 9000: "digits",
    }
    for text, message in bad.items():
        path.write_text(text)
        with pytest.raises(BadInputError, match=message):
            read_json(path)
