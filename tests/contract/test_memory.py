"""The environment's memory does not grow; `python -m benchmarks.memory` looks at 20 000 steps."""

import subprocess
import sys
from pathlib import Path

import pytest
from support.project_files import ROOT


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="reads /proc")
def test_a_thousand_steps_and_resets_leave_nothing_behind() -> None:
    sizes = ["--steps", "1000", "--warm-up", "300", "--episode", "4", "--limit-mb", "5"]
    run = subprocess.run(
        [sys.executable, "-m", "benchmarks.memory", *sizes],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stdout + run.stderr
