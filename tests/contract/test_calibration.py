"""Errors beside recordings: figures of rows of our own making, files, refusals."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from support.synthetic_run import write_run

from benchmarks import calibration
from benchmarks.calibration import RECORDED, SIGHTS, CalibrationConfig, off_by, report, spread_of
from wifipgo.errors import BadInputError


def rows_of(scenario: str, sight: str, errors_deg: np.ndarray, *, n_runs: int = 1) -> pd.DataFrame:
    place = np.repeat(np.arange(len(errors_deg) // n_runs), n_runs).astype(str)
    return pd.DataFrame(
        {"scenario": scenario, "sight": sight, "place": place, "room": place, "error_deg": errors_deg}
    )


def test_spreads_are_those_that_the_rows_were_drawn_with() -> None:
    """Places 3 deg apart, runs 0.5: what is drawn is found, and quantiles are those of the sum."""
    rng, n, runs = np.random.default_rng(5), 4000, 8
    errors_deg = (rng.normal(0.0, 3.0, (n, 1)) + rng.normal(0.0, 0.5, (n, runs))).ravel()
    found = spread_of(rows_of("mine", SIGHTS[0], errors_deg, n_runs=runs))
    assert found.between_deg == pytest.approx(3.0, rel=0.05)
    assert found.within_deg == pytest.approx(0.5, rel=0.1)
    normal = np.hypot(3.0, 0.5) * np.array([0.6745, 1.1503, 1.6449])
    np.testing.assert_allclose(found.quantiles_deg, normal, rtol=0.05)
    assert found.gross < 1e-3


def test_the_standard_error_counts_rooms_not_bearings() -> None:
    """400 uniform errors, each twenty times in its room: sqrt(p (1 - p) / 400) / density."""
    errors_deg = np.repeat(np.random.default_rng(2).uniform(0.0, 10.0, 400), 20)
    found = spread_of(rows_of("mine", SIGHTS[0], errors_deg, n_runs=20))
    share = np.array(calibration.QUANTILES) / 100.0
    np.testing.assert_allclose(found.stderr_deg, 10.0 * np.sqrt(share * (1.0 - share) / 400), rtol=0.35)


def test_a_scenario_that_is_twice_as_wrong_is_off_by_its_whole() -> None:
    errors_deg = np.linspace(-6.0, 6.0, 101)
    rows = pd.concat([rows_of(RECORDED, SIGHTS[0], errors_deg), rows_of("mine", SIGHTS[0], 2.0 * errors_deg)])
    spreads = report(rows)
    assert off_by(spreads["mine", SIGHTS[0]], spreads[RECORDED, SIGHTS[0]]) == pytest.approx(1.0)
    assert list(spreads) == [(RECORDED, SIGHTS[0]), ("mine", SIGHTS[0])]


def test_recordings_and_rooms_of_a_scenario(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Runs of our own making stand for recordings; the files are there, and nothing else."""
    monkeypatch.setattr(calibration, "N_ROBOTS", 3)
    monkeypatch.setattr(calibration, "N_RUNS", 2)
    for name, transmitter in (("LOS_mine", "tx2"), ("NLOS_mine", "tx3")):
        write_run(tmp_path / "data" / name, transmitters_m={transmitter: (-2.4, 2.6, 0.7)}, seed=3)
    out = tmp_path / "out"
    config = CalibrationConfig(scenarios=("radio-hard",), rooms=10, data=tmp_path / "data", out=out)
    calibration.main(config)
    assert sorted(path.name for path in out.iterdir()) == ["calibration.parquet", "calibration.png"]
    rows = pd.read_parquet(out / "calibration.parquet")
    assert set(rows["scenario"]) == {RECORDED, "radio-hard"}
    assert (rows["scenario"] == RECORDED).sum() == 2
    simulated = rows[(rows["scenario"] == "radio-hard") & (rows["sight"] == SIGHTS[0])]
    assert simulated.groupby("place").size().mode().item() == calibration.N_RUNS
    assert "beyond sight" in capsys.readouterr().out


def test_without_data_it_says_where_they_are_described(tmp_path: Path) -> None:
    for data in (tmp_path, tmp_path / "none"):
        with pytest.raises(BadInputError, match=r"docs/howto/data\.md"):
            calibration.recorded_rows(data)


def test_few_rooms_decide_nothing() -> None:
    with pytest.raises(BadInputError, match="rooms must be >= 10"):
        CalibrationConfig(rooms=9)
