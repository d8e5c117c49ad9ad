"""The benchmark of outlier methods: its grid, its figure of merit, and that it goes on where it stopped."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from baselines.reproduce.encounters import EncounterConfig
from benchmarks import outliers
from benchmarks.outliers import COLUMNS, OutlierConfig, errors, grid, main, reduction

CELLS = [
    cell
    for cell in grid(full=False)
    if (cell.range_m, cell.odometry_scale, cell.start_known) == (4.0, 0.1, True) and cell.n_outliers < 3
]


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> OutlierConfig:
    """Settings for four cells in this process."""
    monkeypatch.setattr(outliers, "grid", lambda *, full: CELLS)
    monkeypatch.setattr(outliers, "picture", lambda frame, title: Figure())
    return OutlierConfig(trials=2, jobs=1, out=tmp_path / "out")


def test_the_full_grid_is_that_of_the_method() -> None:
    cells = grid(full=True)
    assert len(set(cells)) == len(cells) == 456
    assert set(grid(full=False)) < set(cells)


def test_half_the_error_is_a_reduction_of_fifty_per_cent() -> None:
    base = np.array([1.0, 2.0, 3.0])
    assert reduction(base, 0.5 * base) == pytest.approx((50.0, 0.0))
    gain, half = reduction(base, np.array([2.0, 1.0, 3.0]))
    assert gain == pytest.approx(0.0)
    assert half == pytest.approx(100.0 * 1.96 * np.sqrt(1.0 / 3.0) / 2.0)


def test_trials_of_a_cell_are_its_own_and_repeat() -> None:
    first = errors(CELLS[0], 0, 0)
    assert len(first) == len(COLUMNS)
    assert first == errors(CELLS[0], 0, 0)
    assert first != errors(CELLS[0], 0, 1)
    assert first[0] != errors(replace(CELLS[0], range_m=3.0), 0, 0)[0]


def test_an_interrupted_run_goes_on_and_settings_do_not_mix(
    small: OutlierConfig, monkeypatch: pytest.MonkeyPatch
) -> None:
    run, done = outliers.run_cells, []

    def stop(config: OutlierConfig, cells: list[EncounterConfig], partial: Path) -> None:
        outliers.run_cell(partial / "0000.npz", cells[0], config.seed, config.n_trials)
        raise KeyboardInterrupt

    monkeypatch.setattr(outliers, "run_cells", stop)
    with pytest.raises(KeyboardInterrupt):
        main(small)
    assert not small.out.exists()
    monkeypatch.setattr(outliers, "run_cells", run)
    with pytest.raises(ValueError, match="unfinished work: --resume"):
        main(small)
    with pytest.raises(ValueError, match="those of this run"):
        main(replace(small, resume=True, seed=5))
    first = small.out.with_name("out.partial") / "0000.npz"
    done.append(first.stat().st_mtime_ns)

    def here(config: OutlierConfig, cells: list[EncounterConfig], partial: Path) -> None:
        assert (partial / "0000.npz").stat().st_mtime_ns == done[0]
        for k in range(1, len(cells)):
            outliers.run_cell(partial / f"{k:04d}.npz", cells[k], config.seed, config.n_trials)

    monkeypatch.setattr(outliers, "run_cells", here)
    main(replace(small, resume=True))
    assert {path.name for path in small.out.iterdir()} == {"cells.parquet", "summary.json", "outliers.png"}
    assert len(pd.read_parquet(small.out / "cells.parquet")) == len(CELLS) * len(COLUMNS)
    assert not first.parent.exists()
