"""The environment under RLlib, and what it trains as a policy. One iteration, where RLlib is installed."""

import importlib
import json
import pickle
import shutil
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from gymnasium import spaces

from baselines.evaluate import run_episode
from baselines.policies.learned.network import load_network
from train import TranslatedEnv, rllib
from train.rllib import RllibConfig, exported, main
from wifipgo.files.folder_lock import held
from wifipgo.scenarios import scenario_named


def states(config: RllibConfig, n_in: int, n_out: int) -> dict[str, np.ndarray]:
    """Weights as RLlib names them."""
    rng, stem = np.random.default_rng(0), "encoder.actor_encoder.net.mlp"
    sizes = [n_in, *config.hidden, n_out]
    names = [f"{stem}.{2 * k}" for k in range(len(config.hidden))] + ["pi.net.mlp.0"]
    arrays: dict[str, np.ndarray] = {}
    for name, before, after in zip(names, sizes[:-1], sizes[1:], strict=True):
        arrays |= {
            f"{name}.weight": rng.standard_normal((after, before)),
            f"{name}.bias": rng.standard_normal(after),
        }
    return arrays


@pytest.mark.parametrize(("interface", "n_in", "n_out"), [("rays", 213, 19), ("flat", 368, 6)])
def test_what_is_exported_is_a_policy(tmp_path: Path, interface: str, n_in: int, n_out: int) -> None:
    config = RllibConfig(interface=interface, hidden=(8, 4))
    scenario = scenario_named("paper-sim-2", n_steps=3)
    path = tmp_path / "policy.npz"
    exported(states(config, n_in, n_out), config, scenario).save(path)
    assert len(load_network(path).nets["action"]) == 3
    assert run_episode(scenario, f"ppo:path={path}", 1).figures["n_steps"] == 3


def test_the_translated_environment_is_a_parallel_environment() -> None:
    env = TranslatedEnv("paper-sim-2", n_steps=3)
    observations, _ = env.reset(seed=1)
    for agent in env.possible_agents:
        env.action_space(agent).seed(1)
    assert isinstance(env.action_space("robot_0"), spaces.MultiDiscrete)
    while env.agents:
        assert all(env.observation_space(a).contains(row) for a, row in observations.items())
        observations, *_ = env.step({a: env.action_space(a).sample() for a in env.agents})
    assert set(observations) == set(env.possible_agents)


def test_without_rllib_it_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    real = importlib.import_module

    def absent(name: str, *args: Any, **kwargs: Any) -> Any:
        if name.startswith("ray"):
            raise ImportError(name)
        return real(name, *args, **kwargs)

    monkeypatch.setattr(importlib, "import_module", absent)
    assert main(["--out", str(tmp_path / "out")]) == 2
    assert "pip install -e '.[rllib]'" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_bad_settings_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    for args, told in (
        (["--minibatch-size", "9999"], "minibatch_size must be <= batch_size (1600)"),
        (["--n-runners", "4096"], "n_runners must be <= "),
        (["--interface", "sonar"], "unknown interface 'sonar'; known: flat, rays"),
    ):
        with pytest.raises(SystemExit) as refusal:
            main(args)
        assert refusal.value.code == 2
        assert told in " ".join(capsys.readouterr().err.split())


class FakeAlgorithm:
    """What of RLlib's algorithm a run calls; its weights say how many updates made them."""

    def __init__(self, config: RllibConfig) -> None:
        """No update yet."""
        self.config, self.updates = config, 0

    def train(self) -> dict[str, Any]:
        """One update in which no episode ends."""
        self.updates += 1
        return {"env_runners": {}}

    def get_module(self, name: str) -> Any:
        """The module of the robots."""
        biased = {k: v + self.updates for k, v in states(self.config, 213, 19).items()}
        return SimpleNamespace(get_state=lambda: biased)

    def save_to_path(self, path: str) -> None:
        """As RLlib: files in folders, pickles among them."""
        (Path(path) / "learner").mkdir()
        (Path(path) / "learner" / "state.pkl").write_bytes(pickle.dumps(self.updates))

    def restore_from_path(self, path: str) -> None:
        """Take the state up."""
        self.updates = pickle.loads((Path(path) / "learner" / "state.pkl").read_bytes())

    def stop(self) -> None:
        """Nothing runs."""


@pytest.fixture
def fake(monkeypatch: pytest.MonkeyPatch) -> None:
    """RLlib without RLlib: what a run does with its folder is ours."""
    ray = SimpleNamespace(cluster_resources=lambda: {"CPU": 2.0})
    monkeypatch.setattr(rllib, "load_ray", lambda *_, **__: ray)
    monkeypatch.setattr(rllib, "joined", lambda *_, **__: nullcontext())
    monkeypatch.setattr(rllib, "make_algorithm", lambda config, *_, **__: FakeAlgorithm(config))


def run(out: Path, *args: str) -> int:
    return main(["--hidden", "8", "--checkpoint-every", "2", "--out", str(out), *args])


def bias(out: Path) -> float:
    return float(load_network(out / "policy.npz").nets["action"][-1].bias[0])


@pytest.mark.usefixtures("fake")
def test_a_run_is_continued_from_its_last_checkpoint(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out, whole = tmp_path / "out", tmp_path / "whole"

    def interrupted(self: FakeAlgorithm) -> dict[str, Any]:
        if self.updates == 3:
            raise KeyboardInterrupt
        return train(self)

    train = FakeAlgorithm.train
    with monkeypatch.context() as patch:
        patch.setattr(FakeAlgorithm, "train", interrupted)
        assert run(out, "--iterations", "5") == 130
    assert not (out / "policy.npz").exists()
    assert run(out, "--iterations", "5") == 2
    assert "--resume continues a run" in capsys.readouterr().err
    assert run(out, "--iterations", "5", "--resume") == 0
    assert "update    3" in capsys.readouterr().out
    assert run(whole, "--iterations", "5") == 0
    assert bias(out) == bias(whole)
    assert run(out, "--iterations", "6", "--resume") == 0
    assert bias(out) == pytest.approx(bias(whole) + 1)
    assert {path.name for path in (out / "checkpoints").iterdir()} == {"iteration-000000006", "last.json"}
    assert run(out, "--iterations", "7", "--resume", "--gamma", "0.5") == 2
    assert "gamma (0.99 there, 0.5 now)" in capsys.readouterr().err


@pytest.mark.usefixtures("fake")
def test_nothing_is_loaded_but_what_the_run_saved(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert run(out, "--iterations", "2") == 0
    pointer, saved = out / "checkpoints/last.json", out / "checkpoints/iteration-000000002"
    good, state = pointer.read_text(), saved / "learner/state.pkl"
    copied = shutil.copytree(saved, tmp_path / "elsewhere")
    for name in (str(copied), "../../elsewhere", "iteration-2", 3, None):
        pointer.write_text(json.dumps(json.loads(good) | {"checkpoint": name}))
        assert run(out, "--iterations", "3", "--resume") == 2
        assert "must be a pointer to a checkpoint beside it" in capsys.readouterr().err
    pointer.write_text(good)
    weights = state.read_bytes()
    state.write_bytes(weights + b"x")
    assert run(out, "--iterations", "3", "--resume") == 2
    assert "as it was written" in capsys.readouterr().err
    state.unlink()
    state.symlink_to(copied / "learner/state.pkl")
    assert run(out, "--iterations", "3", "--resume") == 2
    assert "a file and no link" in capsys.readouterr().err
    state.unlink()
    state.write_bytes(weights)
    assert run(out, "--iterations", "3", "--resume") == 0


@pytest.mark.usefixtures("fake")
def test_only_what_a_run_wrote_is_replaced(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "settings.json").write_text("{}")
    assert run(out, "--iterations", "1", "--overwrite") == 2
    (out / "settings.json").unlink()
    assert run(out, "--iterations", "1") == 0
    (out / "thesis.tex").write_text("40 pages")
    assert run(out, "--iterations", "1", "--overwrite") == 2
    assert "also holds 'thesis.tex'" in capsys.readouterr().err
    (out / "thesis.tex").unlink()
    with held(out):
        assert run(out, "--iterations", "1", "--overwrite") == 2
    assert "a folder that no other run works in" in capsys.readouterr().err
    assert run(out, "--iterations", "1", "--overwrite") == 0


def test_one_iteration(tmp_path: Path) -> None:
    pytest.importorskip("ray.rllib.algorithms.ppo", reason="the extra rllib is not installed")
    out = tmp_path / "out"
    few = ["--iterations", "1", "--batch-size", "100", "--minibatch-size", "50", "--n-epochs", "1"]
    assert main([*few, "--hidden", "8", "--out", str(out)]) == 0
    assert {path.name for path in out.iterdir()} == {
        "checkpoints",
        "manifest.jsonl",
        "policy.npz",
        "settings.json",
    }
    assert main([*few, "--hidden", "8", "--out", str(out), "--resume", "--iterations", "2"]) == 0
    assert run_episode("paper-sim-2", f"ppo:path={out / 'policy.npz'}", 1).figures["n_steps"] == 50
