"""Packages of extras that are absent or broken: one sentence that says how to install them."""

import os
import subprocess
import sys
from collections.abc import Iterable
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType

import pytest

from train import ppo, rllib
from wifipgo.command.checkout import install_line

ROOT = Path(__file__).parents[2]


def ended(folder: Path, *command: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """A command in a process of its own, which finds modules in a folder first."""
    env = os.environ | {"PYTHONPATH": f"{folder}{os.pathsep}{ROOT}"} | environment
    return subprocess.run(
        [sys.executable, "-m", *command], cwd=folder, env=env, capture_output=True, text=True, check=False
    )


class Absent(MetaPathFinder):
    """Finds nothing for some names, and lets nobody else find anything."""

    def __init__(self, names: Iterable[str]) -> None:
        """Take the names away."""
        self._names = frozenset(names)

    def find_spec(
        self, fullname: str, path: Iterable[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Refuse them, and leave all else to others."""
        if fullname.partition(".")[0] in self._names:
            raise ModuleNotFoundError(f"No module named {fullname!r}", name=fullname)
        return None


def take_away(monkeypatch: pytest.MonkeyPatch, *names: str) -> None:
    """Packages as if they were not installed, in one test."""
    for name in names:
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.setattr(sys, "meta_path", [Absent(names), *sys.meta_path])


@pytest.mark.parametrize(
    ("absent", "extra"),
    [
        *((name, "train") for name in ("torch", "stable_baselines3", "tensorboard", "yaml", "cloudpickle")),
        ("ray", "rllib"),
    ],
)
def test_an_absent_package_is_named(
    absent: str,
    extra: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    take_away(monkeypatch, absent)
    main = rllib.main if extra == "rllib" else ppo.main
    assert main(["--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert f"needs {absent}, which is not installed: install the extra '{extra}'" in said
    assert said.endswith(f"with {install_line(extra)}\n")
    assert said.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_a_broken_torch_is_said_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "torch.py").write_text("raise OSError('libtorch_cpu.so: cannot open shared object file')\n")
    done = ended(tmp_path, "train.ppo")
    assert done.returncode == 2
    assert "torch, which cannot be loaded (OSError: libtorch_cpu.so: cannot open shared" in done.stderr
    assert f"pip install -e '{ROOT}[train]'" in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_back_end_that_is_not_there_changes_nothing(tmp_path: Path) -> None:
    pytest.importorskip("stable_baselines3")
    bad = ("--ppo.batch-size", "300", "--out", str(tmp_path / "out"))
    done = ended(tmp_path, "train.ppo", *bad, MPLBACKEND="module://nowhere.at_all")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "ppo.batch_size must be a divisor of" in done.stderr


def test_help_does_without_the_extra(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    take_away(monkeypatch, "torch", "stable_baselines3", "yaml")
    monkeypatch.delitem(sys.modules, "train._yaml", raising=False)
    with pytest.raises(SystemExit) as end:
        ppo.main(["--help"])
    assert end.value.code == 0
    assert "wifipgo train --config" in capsys.readouterr().out
    assert ppo.main(["--config", "absent.yaml"]) == 2
    assert "a training file needs yaml, which is not installed" in capsys.readouterr().err
