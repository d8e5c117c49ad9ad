"""The profile of a step times parts that are called, none within another, and its shares add up."""

import json
from pathlib import Path

import pytest

from benchmarks import step_profile
from wifipgo.loop import iteration


def test_parts_add_up_and_nothing_stays_patched() -> None:
    before = dict(vars(iteration))
    found = step_profile.profile("paper-hw-2", 2, n_steps=12, size_m=6.0)
    parts = {name: found[name] for name in step_profile.PARTS}
    assert min(parts.values()) > 0.0
    assert found[step_profile.REST] > 0.0
    assert sum(parts.values()) + found[step_profile.REST] == pytest.approx(found[step_profile.WHOLE])
    assert vars(iteration) == before


def test_times_are_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "new" / "times.json"
    step_profile.main(step_profile.ProfileConfig(scenario=("paper-hw-2",), repeats=1, json=out))
    assert "meetings: solve and exchange" in capsys.readouterr().out
    times = json.loads(out.read_text(encoding="utf-8"))
    assert set(times["paper-hw-2"]) == {*step_profile.PARTS, step_profile.WHOLE, step_profile.REST}
