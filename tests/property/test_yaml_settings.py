"""Settings in YAML: what a reader could take for something else, or would lose, is refused with its line."""

import string
import tracemalloc
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("yaml")

from train._config_files import read_yaml
from train._yaml import read_settings, written
from wifipgo.errors import BadInputError


def _file(folder: Path, text: str | bytes) -> Path:
    path = folder / "run.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


LOST = {
    "ppo: {gamma: 0.9}\nseed: 1\nppo: {n_epochs: 1}\n": "3: ppo must be given once, got it in line 1 too",
    "ppo:\n  gamma: 0.9\n  n_epochs: 1\n  gamma: 0.8\n": "4: ppo.gamma must be given once, got it in line 2",
    "ppo: {gamma: 0.9,\n  'gamma': 0.9}\n": "2: ppo.gamma must be given once",
    "envs: {overrides: [{a: {b: 1,\n b: 1}}]}\n": r"2: envs.overrides\[0\].a.b must be given once",
    "seed: 1\n---\nseed: 2\n": r"2: must be one document, got a second one",
    "seed: 1\n...\n---\nppo: {gamma: 0.9}\n": "3: must be one document",
    "a: &a [1]\nb: *a\n": "2: must be written out, got an alias",
    "ppo:\n  <<: {gamma: 0.9}\n": "2: a key must be a word",
    "seed: !!int '0123'\n": "1: must be without tags",
    "seed: !!python/object/apply:os.system [true]\n": "1: must be without tags",
    "true: 1\n": "1: a key must be a word, got True",
    "? [a]\n: 1\n": r"1: a key must be a word, got \['a'\]",
}


@pytest.mark.parametrize("text", LOST)
def test_what_would_be_lost_is_refused(tmp_path: Path, text: str) -> None:
    """A key or a document that another reader would drop, and what only a program can mean."""
    with pytest.raises(BadInputError, match=rf"run\.yaml:{LOST[text]}"):
        read_settings(_file(tmp_path, text))


TWO_WAYS = """
    0123 00 -07 08 +0_7 0x1f 0o17 0b11 1:30 1:30:00.5 -1:30 yes No ON off y N 2026-01-01 = <<
    2026-01-01T10:00:00Z 1_0 10_00 1_000.5_5 1,5 1,000 .inf -.Inf .nan
"""


@pytest.mark.parametrize("word", TWO_WAYS.split())
def test_a_word_of_two_readings_is_refused_unless_in_quotes(tmp_path: Path, word: str) -> None:
    """With its key and its line; in quotes it is a word."""
    with pytest.raises(BadInputError, match=r"run\.yaml:3: ppo\.gamma must be "):
        read_settings(_file(tmp_path, f"seed: 1\nppo:\n  gamma: {word}\n"))
    assert read_settings(_file(tmp_path, f"a: '{word}'\nb: [\"{word}\"]")).values == {"a": word, "b": [word]}


NUMBERS = {
    "1e-3": 1e-3,
    "1E3": 1e3,
    "1.5e3": 1.5e3,
    "+2.": 2.0,
    ".5": 0.5,
    "-0.25": -0.25,
    "500_000": 500_000,
    "-12": -12,
    "0": 0,
}


@pytest.mark.parametrize("word", NUMBERS)
def test_numbers_are_what_everybody_reads(tmp_path: Path, word: str) -> None:
    """YAML 1.1 has 1e-3 as a string, and so has PyYAML."""
    found = read_settings(_file(tmp_path, f"a: {word}")).values["a"]
    assert found == NUMBERS[word]
    assert type(found) is type(NUMBERS[word])


CHARACTERS = string.printable + "é\x85\u2028\ufeff~€😀"
TEXTS = st.text(st.sampled_from(CHARACTERS), max_size=12)
NUMBERLIKE = st.from_regex("[-+0-9_.:eEx]{1,6}", fullmatch=True)


@settings(max_examples=60)
@given(TEXTS | NUMBERLIKE)
def test_any_text_comes_back(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    """What is written down for a run that is continued says the same when it is read."""
    values = {"word": text, "list": [text, 1e-5, 3, True, None], "table": {"of": [[text]]}}
    assert read_settings(_file(tmp_path_factory.mktemp("yaml"), written(values))).values == values


@settings(max_examples=40)
@given(st.floats(allow_nan=False, allow_infinity=False) | st.integers())
def test_any_number_comes_back(tmp_path_factory: pytest.TempPathFactory, number: float) -> None:
    """To the bit."""
    found = read_settings(_file(tmp_path_factory.mktemp("yaml"), written({"a": number}))).values["a"]
    assert (found, type(found)) == (number, type(number))


def test_any_editor_will_do(tmp_path: Path) -> None:
    """Byte order mark, CR LF and form feeds."""
    path = _file(tmp_path, b"\xef\xbb\xbfseed: 3\r\n\x0cppo:\r\n  gamma: 0.5\r\n")
    assert read_settings(path).values == {"seed": 3, "ppo": {"gamma": 0.5}}


def test_an_alias_bomb_and_deep_nesting_cost_nothing(tmp_path: Path) -> None:
    """300 bytes that spell out to gigabytes, and a hundred thousand brackets, refused in a short sentence."""
    bomb = "a0: &a0 [x]\n" + "".join(f"a{k}: &a{k} [{','.join([f'*a{k - 1}'] * 9)}]\n" for k in range(1, 9))
    tracemalloc.start()
    for text in (bomb, "seed: " + "[" * 10_000, "seed: " + "{a: " * 10_000, "- " * 10_000):
        with pytest.raises(BadInputError, match=r"run\.yaml:[12]: ") as refusal:
            read_settings(_file(tmp_path, text))
        assert len(str(refusal.value)) < 300
    assert tracemalloc.get_traced_memory()[1] < 30_000_000
    tracemalloc.stop()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("seed: 1\nppo:\n  gama: 2\n", "unknown key in {path}: 'ppo.gama'; known:"),
        ("seed: 1\nppo:\n  gamma: 2\n", "{path}:3: ppo.gamma must be in"),
        ("seed: 1\nppo: [1]\n", "{path}:2: ppo must be a table"),
        ("seed: \x07\n", "{path}:1: is not YAML: character 0x0007"),
        ("seed: 1\n\tppo: 2\n", "{path}:2: is not YAML: "),
        ("just words\n", "{path}:1: must be keys and values, got 'just words'"),
    ],
)
def test_a_refusal_names_the_line(tmp_path: Path, text: str, told: str) -> None:
    """Of the key that it is about, in one line."""
    path = _file(tmp_path, text)
    with pytest.raises(BadInputError) as refusal:
        read_yaml(path)
    assert str(refusal.value).startswith(told.replace("{path}", str(path)))
    assert "\n" not in str(refusal.value)
