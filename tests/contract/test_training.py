"""Training keeps its word: it is repeatable, continued where it stopped, and leaves what it promises."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from support.short_training import FEW, SHORT, small

pytest.importorskip("stable_baselines3")

import torch
from rich.console import Console
from threadpoolctl import threadpool_limits

from baselines.evaluate import run_episode
from baselines.evaluation.episodes import trial_seed
from baselines.policies.learned.network import load_network
from baselines.policies.learned.policy import LearnedPolicy
from envs.rendezvous_v0 import parallel_env
from train import _rollouts
from train._checkpoints import read_training
from train._config import HELD_OUT_SEED, TrainConfig
from train._config_files import read_yaml
from train.training import Run, digest, train


def weights(run: Run) -> np.ndarray:
    return np.concatenate([p.detach().numpy().ravel() for p in run.model.policy.parameters()])


def test_a_run_leaves_what_it_promises(done: Run) -> None:
    out = done.config.out
    names = {"checkpoints", "config.yaml", "curve.parquet", "curve.png", "tensorboard", "versions.json"}
    names.add("manifest.jsonl")
    assert {path.name for path in out.iterdir()} == names
    table = pd.read_parquet(out / "curve.parquet")
    # 2 rounds of 40 while imitating, then 160.
    assert table[table["policy"] == "learned"]["agent_steps"].tolist() == [80, 240]
    assert table[table["policy"] == "random"]["mapped_share"].between(0.0, 1.0).all()
    assert (out / "curve.png").read_bytes().startswith(b"\x89PNG")
    assert list((out / "tensorboard").iterdir())
    assert read_yaml(out / "config.yaml") == replace(done.config, out=TrainConfig().out)


def test_one_seed_gives_the_same_weights(tmp_path: Path, done: Run) -> None:
    again = train(replace(done.config, out=tmp_path / "again"))
    np.testing.assert_array_equal(weights(done), weights(again))
    untrained = Run(replace(done.config, out=tmp_path / "untrained"), Console(quiet=True))
    untrained.norm.close()
    assert digest(done.model) == digest(again.model) != digest(untrained.model)


@pytest.mark.parametrize("others", [(), ("paper-hw-2 n_robots=3 n_slots=2",)], ids=["alike", "mixed"])
def test_weights_depend_neither_on_workers_nor_on_threads(tmp_path: Path, others: tuple[str, ...]) -> None:
    """Four robots, three slots: profiles of so many links that two threads would sum them otherwise."""
    changes = ("n_robots=4", "n_slots=3", "n_steps=10", "size_m=10")
    envs = replace(SHORT, others=others, overrides=changes)
    ppo = replace(FEW, agent_steps=70, n_steps=10, batch_size=35 if others else 40, n_epochs=1)
    digests = set()
    for n_workers, threads in ((0, 2), (2, 1)):
        with threadpool_limits(threads):
            run = train(small(tmp_path / f"{n_workers}", envs=replace(envs, n_workers=n_workers), ppo=ppo))
        digests.add(digest(run.model))
    assert len(digests) == 1


@pytest.mark.parametrize(("interface", "critic"), [("trail", "team"), ("rays", "own"), ("flat", "own")])
def test_numpy_decides_as_torch_does(tmp_path: Path, interface: str, critic: str) -> None:
    """The exported network on the observations of an episode, beside the model that it was made of."""
    envs, ppo = replace(SHORT, interface=interface), replace(FEW, critic=critic)
    run = train(small(tmp_path / "run", envs=envs, ppo=ppo))
    policy = LearnedPolicy(run.scenario, path=str(run.checkpoints.path() / "policy.npz"))
    translated = run.norm.venv.interface  # type: ignore[attr-defined]
    env = parallel_env(run.scenario)
    observations, _ = env.reset(seed=3)
    policy.reset(3)
    memory, for_value = None, np.zeros((2, run.model.observation_space.shape[0] - translated.n_shown))  # type: ignore[index]
    while env.agents:
        rows = np.stack(list(observations.values()))
        memory = translated.remembered(rows, memory)
        shown = np.concatenate([translated.shown(rows, memory), for_value], axis=1)
        answers, _ = run.model.predict(run.norm.normalize_obs(shown), deterministic=True)
        actions = policy.act(observations)
        np.testing.assert_allclose(
            np.stack(list(actions.values())), translated.commands(answers, rows), atol=1e-5
        )
        observations, *_ = env.step(actions)


def test_a_run_is_continued_where_it_stopped(tmp_path: Path) -> None:
    out = tmp_path / "run"
    first = train(small(out))
    longer = small(out, ppo=replace(FEW, agent_steps=320), resume=True)
    second = train(longer)
    assert (first.state.agent_steps, second.state.agent_steps) == (160, 320)
    assert second.state.updates == 4
    table = pd.read_parquet(out / "curve.parquet")
    assert table[table["policy"] == "learned"]["agent_steps"].tolist() == [160, 320]
    assert (table["policy"] == "random").sum() == 1  # not played again
    # Continuing to where it already is changes nothing.
    np.testing.assert_array_equal(weights(Run(longer, Console(quiet=True))), weights(second))


def test_a_run_begins_with_the_best_network_of_another(tmp_path: Path, done: Run) -> None:
    """With its weights and normalisation, not its optimiser; a continued run does not begin again."""
    later = small(tmp_path / "later", start=str(done.config.out))
    begun = Run(later, Console(quiet=True))
    begun.norm.close()
    best = read_training(done.checkpoints.path("best"))
    for name, tensor in begun.model.policy.state_dict().items():
        np.testing.assert_array_equal(tensor.numpy(), best[f"policy/{name}"])
    np.testing.assert_array_equal(begun.norm.obs_rms.mean, best["norm/obs_rms/mean"])  # type: ignore[attr-defined]
    assert not begun.model.policy.optimizer.state_dict()["state"]
    run = train(replace(later, overwrite=True))
    more = train(replace(later, resume=True, ppo=replace(FEW, agent_steps=200)))
    assert digest(begun.model) != digest(run.model) != digest(more.model)
    for after in (run, more):
        origin = load_network(after.checkpoints.path() / "policy.npz").origin
        assert origin["begun_with"] == load_network(done.checkpoints.path("best") / "policy.npz").origin
    assert run.state.imitated == 0


def test_a_run_begins_with_no_network_of_another_shape(tmp_path: Path, done: Run) -> None:
    later = small(tmp_path / "later", start=str(done.config.out), ppo=replace(FEW, hidden=(9,)))
    with pytest.raises(
        ValueError, match=r"start must be a run with the same network.*ppo\.hidden \(\[8\] there"
    ):
        Run(later, Console(quiet=True))
    assert not later.out.exists()


def test_torch_has_the_same_threads_on_every_machine(done: Run) -> None:
    assert torch.get_num_threads() == 2
    assert run_episode(done.scenario, "random", 1).figures["n_steps"] == 10


def test_worlds_of_training_are_not_those_of_an_evaluation() -> None:
    with pytest.raises(ValueError, match="whose worlds are not those of an evaluation"):
        _rollouts._keep_apart([trial_seed(HELD_OUT_SEED, 3)], 1)
