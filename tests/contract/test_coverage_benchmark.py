"""The benchmark of intervals reads a run and finds coverages that can be."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from benchmarks import coverage
from wifipgo.errors import BadInputError


def test_coverages_of_a_pool(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(coverage, "SIZES", (20,))
    rng = np.random.default_rng(0)
    parts = [
        pd.DataFrame(
            {
                "run": f"{room}, {policy}",
                "err_last10": rng.gamma(2.0, scale, 40),
                "ate_trans": rng.gamma(2.0, scale, 40),
                "ate_rot": 0.0,
                "rendezvous": rng.poisson(1.0, 40),
            }
        )
        for room in coverage.ROOMS
        for policy, scale in (("active", 1.0), ("random", 6.0))
    ]
    (tmp_path / "fig7").mkdir()
    pd.concat(parts).to_parquet(tmp_path / "fig7" / "episodes.parquet")
    coverage.measure(tmp_path, samples=4, json=tmp_path / "out.json")
    rows = json.loads((tmp_path / "out.json").read_text())
    assert len(rows) == 3 * 4 * len(coverage.SIZES)
    assert {row["ours"] for row in rows} <= {0.0, 0.25, 0.5, 0.75, 1.0}
    assert np.mean([row["ours"] for row in rows]) > 0.85
    assert "rendezvous of random" in capsys.readouterr().out


def test_a_run_without_the_figure_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=r"episodes\.parquet must be there: wifipgo reproduce fig7"):
        coverage.measure(tmp_path)
