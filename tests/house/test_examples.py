"""Every example runs as it stands."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.project_files import ROOT

from envs.rendezvous_v0 import parallel_env

EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
# What an example needs beyond the package and its extra `train`; RLlib is not whole without dm-tree.
NEEDS = {
    "05_train_with_rllib.py": ("ray", "torch", "tree"),
    "06_collect_with_torchrl.py": ("torchrl",),
    "07_benchmarl_task.py": ("benchmarl",),
    "10_train_with_skrl.py": ("skrl", "torch"),
    "12_mappo_with_torchrl.py": ("torchrl",),
}
# Those that take minutes as they stand are run in small form.
SMALL = {
    "12_mappo_with_torchrl.py": (
        *("--agent-steps", "400", "--worlds", "2", "--epochs", "1", "--out", "mappo"),
        *("--scenarios", "paper-sim-2 size_m=4.0 n_steps=10", "paper-sim-2 size_m=6.0 n_steps=8 n_robots=3"),
    ),
}
MOST_LINES = {"12_mappo_with_torchrl.py": 105}  # a whole learner, with its options


def run(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-W", "error::DeprecationWarning:__main__", *arguments],  # no former names in it
        cwd=cwd,
        capture_output=True,
        text=True,
        check=False,
        env={"PATH": "", "PYTHONPATH": str(ROOT), "MPLBACKEND": "Agg", "HOME": str(cwd)},
    )


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_example_runs_and_is_short(path: Path, tmp_path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) <= MOST_LINES.get(path.name, 60)
    missing = [name for name in NEEDS.get(path.name, ()) if importlib.util.find_spec(name) is None]
    if missing:
        pytest.skip(f"not installed: {', '.join(missing)}")
    result = run(str(path), *SMALL.get(path.name, ()), cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert result.stdout


def test_examples_of_frameworks_go_past_a_meeting() -> None:
    """The room that they make is one in which robots meet within ten iterations, whatever they do."""
    for path in [path for path in EXAMPLES if path.name[:2] in {"04", "05", "06", "07", "10"}]:
        code = path.read_text(encoding="utf-8")
        assert re.search(r"size_m\W+4\.0", code), path.name
        assert "paper-sim-2" in code, path.name
    env, rng = parallel_env("paper-sim-2", size_m=4.0, n_steps=10), np.random.default_rng(0)
    for seed in range(3):
        env.reset(seed=seed)
        met = False
        while env.agents:
            *_, infos = env.step({agent: rng.uniform(-1.0, 1.0, 3) for agent in env.agents})
            met |= bool(infos["robot_0"]["met"].any())
        assert met, seed
