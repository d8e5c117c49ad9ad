"""Packages of extras that are absent or broken: one sentence that says how to install them."""

import importlib
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from train import ppo, rllib

ROOT = Path(__file__).parents[2]


def ended(folder: Path, *command: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """A command in a process of its own, which finds modules in a folder first."""
    env = os.environ | {"PYTHONPATH": f"{folder}{os.pathsep}{ROOT}"} | environment
    return subprocess.run(
        [sys.executable, "-m", *command], cwd=folder, env=env, capture_output=True, text=True, check=False
    )


@pytest.mark.parametrize(("absent", "extra"), [("torch", "train"), ("yaml", "train"), ("ray", "rllib")])
def test_an_absent_package_is_named(
    absent: str,
    extra: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    found = importlib.import_module

    def without(name: str, package: str | None = None) -> ModuleType:
        if name == absent:
            raise ModuleNotFoundError(name=name)
        return found(name, package)

    monkeypatch.setattr(importlib, "import_module", without)
    main = rllib.main if extra == "rllib" else ppo.main
    assert main(["--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert f"needs {absent}, which is not installed: install the extra '{extra}'" in said
    assert f"in a checkout pip install -e '.[{extra}]'" in said
    assert said.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_a_broken_torch_is_said_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "torch.py").write_text("raise OSError('libtorch_cpu.so: cannot open shared object file')\n")
    done = ended(tmp_path, "train.ppo")
    assert done.returncode == 2
    assert "torch, which cannot be loaded (OSError: libtorch_cpu.so: cannot open shared" in done.stderr
    assert "pip install -e '.[train]'" in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_back_end_that_is_not_there_changes_nothing(tmp_path: Path) -> None:
    pytest.importorskip("stable_baselines3")
    bad = ("--ppo.batch-size", "300", "--out", str(tmp_path / "out"))
    done = ended(tmp_path, "train.ppo", *bad, MPLBACKEND="module://nowhere.at_all")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "ppo.batch_size must be a divisor of" in done.stderr
