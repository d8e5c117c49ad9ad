"""Whatever robots are told to do, what comes back stays in its space: more than 10 000 steps."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from gymnasium import spaces
from support import wild_drives
from support.wild_drives import HARD, SMALL, WHOLE, Trial, check_within

ROOT = Path(__file__).parents[2]
SHORT = {"n_steps": 25}
STEPS = {"small": 8250, "hard": 2000, "many": 70}


def test_teams_stay_in_bounds() -> None:
    """More than ten thousand steps, at full speed, which is without type checks."""
    assert sum(STEPS.values()) > 10_000
    done = subprocess.run(
        [sys.executable, str(Path(wild_drives.__file__))],
        capture_output=True,
        text=True,
        check=False,
        env={"PATH": "", "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == STEPS


def test_a_look_finds_what_is_out_of_bounds() -> None:
    box = spaces.Box(-1.0, 1.0, (2,), np.float32)
    good = np.array([1.0, -1.0], dtype=np.float32)
    check_within(spaces.Dict({"a": box}), {"a": np.stack([good, good])})
    bad = (good * 1.001, good * np.nan, good.astype(float), np.zeros(3, dtype=np.float32))
    for row in bad:
        assert not box.contains(row)
        with pytest.raises(AssertionError):
            check_within(spaces.Dict({"a": box}), {"a": row[None]})


@pytest.mark.parametrize("scenario", SMALL)
def test_types_hold_in_every_scenario(scenario: str) -> None:
    """A short episode with type checks."""
    assert Trial(scenario, 2, WHOLE | SHORT).play(0) == 50


@pytest.mark.parametrize("changes", HARD, ids="-".join)
def test_types_hold_under_hard_conditions(changes: dict[str, object]) -> None:
    assert Trial("paper-hw-2", 2, changes | SHORT).play(0) == 50
