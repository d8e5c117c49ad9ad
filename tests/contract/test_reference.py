"""The policy that others are compared with is the user's choice, also of results that are there."""

import json
from pathlib import Path

import pytest
from support.short_evaluation import short

from baselines import evaluate as evaluation
from baselines.evaluate import evaluate
from wifipgo.errors import BadInputError


def test_another_reference_compares_anew_and_plays_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(evaluation, "draw", lambda *_: None)
    out = tmp_path / "out"
    first = evaluate(short(out, trials=2, policies="random,b=active", reference="random"))
    assert set(first.paired) == {"b"}
    assert "fewer than 10" in json.loads((out / "summary.json").read_text())["warnings"][0]
    monkeypatch.setattr(evaluation, "run_shown", lambda *_, **__: pytest.fail("played again"))
    table = out / "t.csv"
    changes = {"trials": 2, "policies": "random,b=active", "reference": "b", "resume": True}
    second = evaluate(short(out, table=(table,), **changes))
    saved = json.loads((out / "summary.json").read_text())
    assert saved["reference"] == json.loads((out / "config.json").read_text())["reference"] == "b"
    one, other = first.paired["b"].score_difference.value, second.paired["random"].score_difference.value
    assert one is not None
    assert other == pytest.approx(-one)
    assert table.read_text().count("\n") == 1 + 2 * len(second.units)


def test_an_unknown_reference_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match="unknown reference 'c'; known: b, random"):
        evaluate(short(tmp_path / "out", policies="random,b=active", reference="c"))
    assert not (tmp_path / "out.partial").exists()
