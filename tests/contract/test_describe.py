"""The description of a scenario says what the environment has, and refuses what does not exist."""

import sys
from pathlib import Path

import pytest
from support.small_teams import SMALL_TEAMS

from envs._describe_tables import ACTIONS, fields_markdown
from envs.describe import main
from envs.rendezvous_v0 import parallel_env
from wifipgo.scenarios import SCENARIOS, field_owners, scenario_named
from wifipgo.scenarios.field_table import PAPER_VALUES, field_rows, limits_of, meanings_of, origin_of, unit_of

DOCS = Path(__file__).parents[2] / "docs" / "scenarios.md"
MARK = "<!-- wifipgo describe --fields -->\n"
SMALL = ("--set", "n_steps=3", "obstacles_m=(((1,1),(3,1),(3,2)),)")


def words(text: str) -> list[str]:
    """Cells of printed tables, without lines."""
    return text.translate(dict.fromkeys(map(ord, "│┃━┏┓┗┛┡┩╇┳┻└┘┴┬─├┤┼"), " ")).split()


def test_it_says_what_the_environment_has(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture = tmp_path / "deep" / "room.png"
    assert main(["paper-hw-2-hetero", *SMALL, "--out", str(picture), "--seed", "2"]) == 0
    printed = capsys.readouterr().out
    env = parallel_env("paper-hw-2-hetero", n_steps=3)
    env.reset(seed=2)
    found = words(printed)
    assert set(env.possible_agents) <= set(found)
    for block in env.layout:
        k = found.index(block.name)
        first, _, last = found[k - 1].partition("..")
        assert (int(first), int(last or first) + 1) == (block.where.start, block.where.stop)
        assert [float(x) for x in found[k + 1 : k + 3]] == [block.low, block.high]
    for name in field_owners().keys() - {"name", "source"}:
        assert name in found
    assert picture.read_bytes().startswith(b"\x89PNG\r\n\x1a\n")
    assert str(picture) in printed.replace("\n", "")
    assert {path.name for path in picture.parent.iterdir()} == {"room.png"}


@pytest.mark.parametrize("name", SMALL_TEAMS)
def test_every_scenario_can_be_described(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([name, "--out", str(tmp_path / "room.png")]) == 0
    assert capsys.readouterr().out.startswith(name)


def test_every_action_component_has_a_row() -> None:
    env = parallel_env()
    assert env.action_space("robot_0").shape == (len(ACTIONS),)


def test_what_it_writes_as_toml_is_that_scenario(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["paper-outliers", "--toml", "--set", "size_m=7"]) == 0
    (tmp_path / "again.toml").write_text(capsys.readouterr().out, encoding="utf-8")
    assert scenario_named(str(tmp_path / "again.toml")) == scenario_named("paper-outliers", size_m=7)


def test_list_and_help_teach(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--list"]) == 0
    assert set(SCENARIOS) <= set(words(capsys.readouterr().out))
    with pytest.raises(SystemExit) as end:
        main(["--help"])
    assert end.value.code == 0
    printed = capsys.readouterr().out
    assert "wifipgo describe room.toml" in printed
    assert all(f"--{option}" in printed for option in ("set", "seed", "out", "list", "toml", "fields"))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["paper-hw-3"], "unknown scenario 'paper-hw-3'; known: link-binds,"),
        (["none.toml"], "none.toml: No such file"),
        (["--set", "n_obstacle=4"], "unknown scenario field 'n_obstacle'; known: "),
        (["--set", "size_m"], "must be KEY=VALUE"),
        (["--set", "size_m=1e400"], "size_m must be finite, got inf"),
        (["--out", "room.jpg"], "unknown kind of file for out '.jpg'; known: .png"),
        (["--seed", "-1"], "seed must be >= 0"),
        (["--set", "obstacles_m=(((0,0),(20,0),(20,20),(0,20)),)"], "obstacles_m[0] must be small enough"),
    ],
)
def test_what_does_not_exist_is_refused_in_a_line(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    printed = capsys.readouterr()
    assert message in printed.err
    assert printed.err.count("\n") == 1
    assert not printed.out


def test_it_needs_no_standard_output(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As under ``>&-``, or where a service starts it."""
    monkeypatch.setattr(sys, "stdout", None)
    picture = tmp_path / "room.png"
    assert main(["paper-hw-2", *SMALL, "--out", str(picture)]) == 0
    assert picture.stat().st_size


def test_every_field_has_a_meaning_and_the_page_has_the_same() -> None:
    assert not [row.name for row in field_rows(SCENARIOS["paper-hw-2"]) if not row.meaning]
    _, mark, table = DOCS.read_text(encoding="utf-8").partition(MARK)
    assert mark
    assert table == fields_markdown(), f"put what wifipgo describe --fields prints below {MARK!r}"


def test_limits_are_those_of_refusals() -> None:
    base = SCENARIOS["paper-sim-2"]
    assert limits_of("n_slots") == "1 to n_robots - 1"
    assert limits_of("aoa_estimator") == limits_of("noise_scale") == "-"
    for name, most in {"kappa": 1_000_000, "n_azimuths": 7200, "tx_power_dbm": 30.0}.items():
        assert f"{float(limits_of(name).split(' to ')[1]):g}" == f"{most:g}"
        assert base.with_overrides(**{name: most})
        with pytest.raises(ValueError, match=name):
            base.with_overrides(**{name: most * 2})


def test_what_the_paper_gives_is_a_value_of_that_field() -> None:
    """Each value that is called the paper's is one that a scenario may have."""
    base = SCENARIOS["paper-hw-2"]
    for name, known in PAPER_VALUES.items():
        for value, place in known.items():
            assert origin_of(name, base.with_overrides(**{name: value}) and value) == f"paper {place}"
    assert origin_of("size_m", 20.0) == "ours"
    assert origin_of("sigma_t_m", 0.3) == "ours"


def test_units_are_read_off_the_names() -> None:
    names = ("q_mbit_s", "tx_power_dbm", "noise_figure_db", "carrier_hz", "turn_rad", "size_m", "kappa")
    assert [unit_of(name) for name in names] == ["Mb/s", "dBm", "dB", "Hz", "rad", "m", "-"]


class Sample:
    """A sample.

    Attributes:
        one, two: They share: a text
            over two lines.
        three: Its own.

    Afterwards something else: not an attribute.
    """


def test_meanings_come_from_the_docstring() -> None:
    shared = "They share: a text over two lines."
    assert meanings_of(Sample) == {"one": shared, "two": shared, "three": "Its own."}
