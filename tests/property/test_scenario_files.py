"""A scenario written as TOML reads back equal, and what a file may not say is refused by name."""

import pickle
import tomllib
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from envs.rendezvous_v0 import parallel_env
from wifipgo.coerce import key_value
from wifipgo.scenarios import SCENARIOS, Scenario, field_owners, scenario_named, scenario_toml
from wifipgo.scenarios.toml_files import toml_text

TEXT = st.text(st.characters(exclude_categories=["Cs"]))


def value_of(scenario: Scenario, name: str) -> Any:
    part = field_owners()[name]
    return getattr(getattr(scenario, part) if part else scenario, name)


@st.composite
def changed(draw: st.DrawFn) -> tuple[Scenario, dict[str, Any]]:
    """A named scenario, any texts as name and source, and some numbers changed a little."""
    base = SCENARIOS[draw(st.sampled_from(sorted(SCENARIOS)))]
    changes: dict[str, Any] = {"name": draw(TEXT), "source": draw(TEXT)}
    for name in draw(st.lists(st.sampled_from(sorted(field_owners())), max_size=6, unique=True)):
        now = value_of(base, name)
        if isinstance(now, float):
            changes[name] = now * draw(st.floats(0.9, 1.1))
        elif isinstance(now, int) and not isinstance(now, bool):
            changes[name] = now + draw(st.integers(0, 3))
    if draw(st.booleans()):
        factor = st.floats(0.0, 4.0)
        changes["noise_scale"] = tuple(draw(factor) for _ in range(changes.get("n_robots", base.n_robots)))
        changes["antennas_m"] = ((draw(factor), 0.1), (0.0, -draw(factor)))
    return base, changes


@given(case=changed())
def test_what_is_written_reads_back_equal(
    case: tuple[Scenario, dict[str, Any]], tmp_path_factory: pytest.TempPathFactory
) -> None:
    base, changes = case
    try:
        scenario = base.with_overrides(**changes)
    except ValueError:  # two changes that do not fit together
        assume(False)
        raise
    path = tmp_path_factory.getbasetemp() / "any.toml"
    path.write_bytes(scenario_toml(scenario).encode())
    assert scenario_named(str(path)) == scenario


@given(text=TEXT, number=st.floats(allow_nan=False, allow_infinity=False), whole=st.integers())
def test_values_survive_as_toml(text: str, number: float, whole: int) -> None:
    values = {"text": text, "row": [number, [whole], True], "table": {"number": number}}
    assert tomllib.loads(toml_text(values)) == values


def write(folder: Path, text: str, name: str = "room.toml") -> str:
    (folder / name).write_text(text, encoding="utf-8")
    return str(folder / name)


def test_a_table_and_a_flat_key_say_the_same(tmp_path: Path) -> None:
    flat = scenario_named(write(tmp_path, 'base = "paper-sim-2"\nn_steps = 9\nsize_m = 12\n'))
    table = scenario_named(write(tmp_path, 'base = "paper-sim-2"\nn_steps = 9\n[arena]\nsize_m = 12.0\n'))
    assert flat == table
    expected = scenario_named("paper-sim-2", n_steps=9, size_m=12, name="room", source=flat.source)
    assert flat == expected
    assert flat.source.endswith("Ours, from room.toml: n_steps, size_m.")


def test_keys_of_the_graph_are_read_where_they_were(tmp_path: Path) -> None:
    former, now = tmp_path / "former.toml", tmp_path / "now.toml"
    now.write_text('base = "paper-sim-2"\n[graph]\nestimator = "every_step"\n')
    former.write_text('base = "paper-sim-2"\n[rendezvous]\nestimator = "every_step"\n')
    with pytest.warns(FutureWarning, match=r"estimator in .*, table \[rendezvous\], belongs to \[graph\]"):
        read = scenario_named(former)
    assert read.graph == scenario_named(now).graph
    former.write_text("[graph]\nkappa = 4\n")
    with pytest.raises(ValueError, match=r"kappa must be .*\[rendezvous\].*got '\[graph\]'"):
        scenario_named(former)


def test_without_a_base_the_defaults_hold(tmp_path: Path) -> None:
    plain = scenario_named(write(tmp_path, "n_steps = 9"))
    assert plain == Scenario(name="room", source=plain.source, n_steps=9)


def test_a_base_may_be_a_file_beside_it(tmp_path: Path) -> None:
    write(tmp_path, 'base = "paper-hw-2"\nsize_m = 9', "ours.toml")
    assert scenario_named(write(tmp_path, 'base = "ours.toml"\nn_steps = 3')).arena.size_m == 9.0
    write(tmp_path, 'base = "room.toml"', "ours.toml")
    with pytest.raises(ValueError, match=r"base in .* must be no circle, got 'room.toml'"):
        scenario_named(str(tmp_path / "room.toml"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("n_obstacle = 4", r"unknown key in .*room\.toml: 'n_obstacle'; known: .*base.*n_obstacles"),
        ("[arenas]\nsize_m = 4", r"unknown key in .*room\.toml: 'arenas'; known: .*arena.*sensing"),
        ("[arena]\nsizes = 4", r"room\.toml, table \[arena\]: 'sizes'; known: .*size_m"),
        (
            "[arena]\nsigma_t_m = 1",
            r"sigma_t_m must be at the top .* or in its table \[sensing\], got '\[arena",
        ),
        ("[arena]\nn_steps = 1", r"n_steps must be at the top of .*room\.toml, got '\[arena\]'"),
        ("size_m = 3\n[arena]\nsize_m = 4", r"size_m must be given once in .*room\.toml, got '\[arena\]'"),
        ("n_obstacles = 2.0", r"room\.toml: n_obstacles must be of type int, got 2\.0"),
        ("n_obstacles = true", r"room\.toml: n_obstacles must be of type int, got True"),
        ('size_m = "20"', r"room\.toml: size_m must be of type float, got '20'"),
        ("size_m = nan", r"room\.toml: size_m must be finite, got nan"),
        ("noise_scale = [1.0, inf]", r"room\.toml: noise_scale\[1\] must be finite, got inf"),
        ("noise_scale = 2.0", r"noise_scale must be of type tuple of float, got 2\.0"),
        ("arena = 5", r"arena in .*room\.toml must be a table, \[arena\], got 5"),
        ("[[arena]]\nsize_m = 4", r"arena in .*room\.toml must be a table, \[arena\], got \[\{"),
        ("size_m = -1", r"room\.toml: ArenaConfig\.size_m must be in 0\.1\.\.2000, got -1\.0"),
        (
            'wall_material = "paper"',
            r"room\.toml: unknown ArenaConfig\.wall_material 'paper'; known: brick",
        ),
        ("base = 2", r"room\.toml: base must be of type str, got 2"),
        ('base = "paper"', r"room\.toml: unknown scenario 'paper'; known: link-binds.*FILE\.toml"),
        ("n_steps = \n", r"room\.toml is not TOML: .*line 1"),
    ],
)
def test_what_a_file_may_not_say(text: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=message):
        scenario_named(write(tmp_path, text))


def test_a_file_that_is_no_text(tmp_path: Path) -> None:
    (tmp_path / "room.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ValueError, match=r"room\.toml: expected text in UTF-8, got UTF-16"):
        scenario_named(str(tmp_path / "room.toml"))
    with pytest.raises(FileNotFoundError, match=r"none\.toml"):
        scenario_named("none.toml")


def test_a_path_is_a_file_too(tmp_path: Path) -> None:
    path = write(tmp_path, "n_steps = 3")
    assert parallel_env(Path(path)).scenario == scenario_named(Path(path)) == scenario_named(path)


def test_an_environment_keeps_what_the_file_said(tmp_path: Path) -> None:
    """Copies are made from the value: the file may change or go."""
    path = write(tmp_path, 'base = "paper-hw-2"\nn_obstacles = 2')
    env = parallel_env(scenario=path, n_steps=3)
    Path(path).unlink()
    copy = pickle.loads(pickle.dumps(env))
    assert copy.scenario == env.scenario
    assert env.scenario.arena.n_obstacles == 2
    assert env.scenario.n_steps == 3


def test_a_map_reads_back_equal_with_a_line_for_each_obstacle(tmp_path: Path) -> None:
    ell = (((4.0, 4.0), (8.0, 4.0), (8.0, 4.5)), ((0.1, 0.3), (0.1, 0.2), (1 / 3, 0.2)))
    starts = ((2.0, 2.0, 0.0), (10.0, 10.0, 3.14))
    scenario = scenario_named("paper-hw-2", obstacles_m=ell, starts=starts, step_scale=[1, 0.5])
    text = scenario_toml(scenario)
    assert "  [[4.0, 4.0], [8.0, 4.0], [8.0, 4.5]],\n" in text
    assert scenario_named(write(tmp_path, text)) == scenario


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("agc=true", True),
        ("agc = False", False),
        ("noise_scale=[1, 2.5]", [1, 2.5]),
        ("outliers=bearing", "bearing"),
        ("name=a=b", "a=b"),
        ("size_m=1e1", 10.0),
    ],
)
def test_settings_are_literals_or_text(text: str, value: object) -> None:
    assert key_value(text) == (text.partition("=")[0].strip(), value)


def test_every_field_can_be_written() -> None:
    text = scenario_toml(SCENARIOS["paper-hw-2"])
    assert all(f"\n{name} = " in f"\n{text}" for name in field_owners())
    parts = {name for name, value in asdict(SCENARIOS["paper-hw-2"]).items() if isinstance(value, dict)}
    assert all(f"[{name}]" in text for name in parts)
