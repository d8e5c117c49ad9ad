"""The environment under RLlib, and what it trains as a policy. One iteration, where RLlib is installed."""

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium import spaces

from baselines.evaluate import run_episode
from baselines.policies.learned.network import load_network
from train._interface_env import TranslatedEnv
from train.rllib import RllibConfig, exported, main
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


def test_one_iteration(tmp_path: Path) -> None:
    pytest.importorskip("ray.rllib.algorithms.ppo", reason="the extra rllib is not installed")
    out = tmp_path / "out"
    few = ["--iterations", "1", "--batch-size", "100", "--minibatch-size", "50", "--n-epochs", "1"]
    assert main([*few, "--hidden", "8", "--out", str(out)]) == 0
    assert {path.name for path in out.iterdir()} == {"checkpoint", "policy.npz", "settings.json"}
    assert run_episode("paper-sim-2", f"ppo:path={out / 'policy.npz'}", 1).figures["n_steps"] == 50
