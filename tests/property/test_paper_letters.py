"""Letters of the paper are names of fields: whatever says the letter says the field, and never both."""

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from envs.describe import main
from envs.rendezvous_v0 import parallel_env
from wifipgo.errors import BadInputError, UnknownNameError
from wifipgo.scenarios import field_owners, scenario_named
from wifipgo.scenarios.letters import LETTERS, by_field, field_of, letter_of

BASE = scenario_named("paper-hw-2")
# What each letter, as the paper prints it or spells it out, is in the paper's text, with a value to tell.
MEANT = {
    ("delta", "\N{GREEK SMALL LETTER DELTA}"): ("err_threshold", 4.5),
    ("Delta", "\N{GREEK CAPITAL LETTER DELTA}"): ("aoa_gate_rad", 0.2),
    ("sigma", "\N{GREEK SMALL LETTER SIGMA}"): ("aoa_sigma_rad", 0.1),
    ("alpha", "\N{GREEK SMALL LETTER ALPHA}"): ("alpha", 2.5),
    ("kappa", "\N{GREEK SMALL LETTER KAPPA}"): ("kappa", 5),
    ("q",): ("q_mbit_s", 13.0),
}
CASES = [(name, field, value) for names, (field, value) in MEANT.items() for name in names]

cases = pytest.mark.parametrize(("name", "field", "value"), CASES)


@cases
def test_a_letter_is_its_field_wherever_it_is_said(name: str, field: str, value: Any, tmp_path: Path) -> None:
    meant = BASE.with_overrides(**{field: value})
    assert BASE.with_overrides(**{name: value}) == meant != BASE
    assert parallel_env(**dict[str, Any]({name: value})).scenario == meant
    env = parallel_env(n_steps=2)
    env.reset(seed=0, options={name: value})
    assert env.scenario == meant.with_overrides(n_steps=2)
    part, file = field_owners()[field], tmp_path / "paper-hw-2.toml"
    for table in ("", f"[{part}]\n"):
        key = name if name.isascii() else f'"{name}"'
        file.write_text(f'base = "paper-hw-2"\n{table}{key} = {value}\n', encoding="utf-8")
        assert scenario_named(file).with_overrides(source=meant.source) == meant


@cases
def test_both_names_of_a_field_are_refused_with_both(
    name: str, field: str, value: Any, tmp_path: Path
) -> None:
    if name == field:
        return
    both: dict[str, Any] = {name: value, field: value}
    for refused in (lambda: BASE.with_overrides(**both), lambda: parallel_env(**both)):
        with pytest.raises(BadInputError, match=f"{field} must be given once, got {name} and {field}"):
            refused()
    key = name if name.isascii() else f'"{name}"'
    (tmp_path / "both.toml").write_text(f"{field} = {value}\n{key} = {value}\n", encoding="utf-8")
    with pytest.raises(BadInputError, match=rf"{field} in .*both.toml must be given once, .*{name}"):
        scenario_named(tmp_path / "both.toml")


@pytest.mark.parametrize("letter", ["gamma", "rho", "w", "\N{GREEK SMALL LETTER GAMMA}"])
def test_letters_that_are_no_choice_say_why(letter: str, tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=f"^{letter} of the paper is no scenario field: "):
        BASE.with_overrides(**{letter: 1.0})
    (tmp_path / "x.toml").write_text(f'"{letter}" = 1.0\n', encoding="utf-8")
    with pytest.raises(BadInputError, match=f"{letter} of the paper is no key in .*x.toml: "):
        scenario_named(tmp_path / "x.toml")


@given(st.text("abq\u03b4\u0394\u03c3", max_size=3))
def test_other_names_are_what_they_are(name: str) -> None:
    assert name in LETTERS or field_of(name) == name or (len(name) == 1 and not name.isascii())


@given(st.dictionaries(st.sampled_from(sorted(field_owners())), st.integers()))
def test_names_of_fields_are_left_alone(values: dict[str, int]) -> None:
    assert by_field(values) == values


def test_letters_are_of_fields_and_shown(capsys: pytest.CaptureFixture[str]) -> None:
    assert set(LETTERS.values()) <= field_owners().keys()
    assert not LETTERS.keys() & field_owners().keys()
    assert {letter: letter_of(field) for letter, field in LETTERS.items()} == {name: name for name in LETTERS}
    assert main(["--fields"]) == 0
    page = capsys.readouterr().out
    assert all(f"| `{field}`, `{letter}` |" in page for letter, field in LETTERS.items())


@pytest.mark.parametrize(("wrong", "meant"), [("detla", "delta"), ("Err_threshold", "err_threshold")])
def test_a_misspelt_name_is_told_the_nearest(wrong: str, meant: str) -> None:
    wild: dict[str, Any] = {wrong: 1.0}
    for refused in (lambda: BASE.with_overrides(**wild), lambda: parallel_env(**wild)):
        with pytest.raises(UnknownNameError, match=f"did you mean '{meant}'"):
            refused()
