"""Training keeps its word: repeatable, continued where it stopped, whole checkpoints, clear refusals."""

import json
import os
import shutil
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

pytest.importorskip("stable_baselines3")

import torch
from rich.console import Console
from threadpoolctl import threadpool_limits

from baselines.evaluate import run_episode
from baselines.evaluation.episodes import trial_seed
from baselines.policies.learned.network import load_network
from baselines.policies.learned.policy import LearnedPolicy
from envs.rendezvous_v0 import parallel_env
from train import _checkpoints, _learning_curve, _rollouts
from train._config import HELD_OUT_SEED, EnvsConfig, ImitationConfig, PpoConfig, SelectionConfig, TrainConfig
from train._config_files import read_yaml
from train._model_arrays import arrays_of
from train.ppo import main
from train.training import Run, digest, train
from wifipgo.errors import BadInputError
from wifipgo.folder_lock import held

SHORT = EnvsConfig(n_envs=2, overrides=("n_steps=10",))
FEW = PpoConfig(agent_steps=160, n_steps=20, batch_size=40, n_epochs=2, hidden=(8,))
RARELY = SelectionConfig(every=0, trials=1, policies=("random",))


def small(out: Path, **changes: Any) -> TrainConfig:
    """Seconds: two environments with episodes of ten iterations, 160 agent-steps."""
    return replace(TrainConfig(envs=SHORT, ppo=FEW, selection=RARELY, out=out), **changes)


def weights(run: Run) -> np.ndarray:
    return np.concatenate([p.detach().numpy().ravel() for p in run.model.policy.parameters()])


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run that imitated, then improved, to its end."""
    out = tmp_path_factory.mktemp("train") / "done"
    teach = ImitationConfig(policy="active", rounds=2, agent_steps=40, epochs=1)
    return train(small(out, imitation=teach))


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


def test_weights_depend_neither_on_workers_nor_on_threads(tmp_path: Path) -> None:
    """Four robots, three slots: profiles of so many links that two threads would sum them otherwise."""
    changes = ("n_robots=4", "n_slots=3", "n_steps=10", "size_m=10")
    ppo = replace(FEW, n_steps=10, batch_size=80, n_epochs=1)
    digests = set()
    for n_workers, threads in ((0, 2), (2, 2)):
        envs = replace(SHORT, overrides=changes, n_workers=n_workers)
        with threadpool_limits(threads):
            run = train(small(tmp_path / f"{n_workers}-{threads}", envs=envs, ppo=ppo))
        digests.add(digest(run.model))
    assert len(digests) == 1


@pytest.mark.parametrize("interface", ["rays", "flat"])
def test_numpy_decides_as_torch_does(tmp_path: Path, interface: str) -> None:
    """The exported network on the observations of an episode, beside the model that it was made of."""
    run = train(small(tmp_path / "run", envs=replace(SHORT, interface=interface)))
    policy = LearnedPolicy(run.scenario, path=str(run.checkpoints.path() / "policy.npz"))
    translated = run.norm.venv.interface  # type: ignore[attr-defined]
    env = parallel_env(run.scenario)
    observations, _ = env.reset(seed=3)
    while env.agents:
        rows = np.stack(list(observations.values()))
        answers, _ = run.model.predict(run.norm.normalize_obs(translated.shown(rows)), deterministic=True)
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


def test_an_interrupted_save_leaves_the_last_good_one(
    tmp_path: Path, done: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "run"
    shutil.copytree(done.config.out, out)
    checkpoints = _checkpoints.Checkpoints(out)
    good = checkpoints.path()
    network = load_network(good / "policy.npz")

    def full(*_: Any, **__: Any) -> None:
        raise OSError(28, "No space left on device")

    later, arrays = replace(done.state, agent_steps=999), _checkpoints.read_training(good)
    for owner, name in ((np, "savez"), (type(network), "save")):
        with monkeypatch.context() as patch:
            patch.setattr(owner, name, full)
            with pytest.raises(OSError, match="No space"):
                checkpoints.save(arrays, network, later)
    assert checkpoints.path() == good
    train(small(out, imitation=done.config.imitation, resume=True))


def refused(capsys: pytest.CaptureFixture[str], *args: str) -> str:
    """The message of a command line that is refused, on one line."""
    code = main(list(args))
    assert code == 2
    return " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("ppo: {learning_rat: 1}", "unknown key in {path}: 'ppo.learning_rat'; known:"),
        ("ppo: {gamma: 2}", "ppo.gamma must be in [0, 1], got 2.0"),
        ("ppo: {n_epochs: many}", "ppo.n_epochs must be of type int, got 'many'"),
        ("ppo: 3", "ppo must be a table of keys and values, got 3"),
        ("envs: {scenario: paper-sim-3}", "unknown scenario 'paper-sim-3'; known:"),
        ("envs: {reward: err}", "unknown envs.reward 'err'; known: error"),
        ("envs: {others: [paper-sim-50]}", "envs.others must be of scenarios with the observations of"),
        ("envs: {n_envs: 2, n_workers: 3}", "envs.n_workers must be in 0..2 (n_envs), got 3"),
        ("ppo: {agent_steps: 0}", "nothing to learn"),
        ("ppo: {critic_only: 2}", "ppo.critic_only must be 0 where imitation.policy is empty"),
        ("imitation: {policy: frontier_hom}", "unknown policy 'frontier_hom'; known: active,"),
        ("selection: {policies: ['active:err=1']}", "unknown parameter of policy 'active': 'err'; known:"),
        ("ppo: {batch_size: 300}", "ppo.batch_size must be a divisor of 1600"),
        (f"selection: {{seed: {HELD_OUT_SEED}}}", "the root of the held-out worlds"),
        ("[1, 2", "is not YAML"),
    ],
)
def test_bad_settings_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, told: str
) -> None:
    path = tmp_path / "run.yaml"
    path.write_text(text)
    said = refused(capsys, "--config", str(path), "--out", str(tmp_path / "out"))
    assert told.replace("{path}", str(path)) in said
    assert not (tmp_path / "out").exists()


def test_floats_without_a_point_are_floats(tmp_path: Path) -> None:
    """YAML 1.1 reads 3e-4 as text."""
    path = tmp_path / "run.yaml"
    path.write_text("ppo: {learning_rate: 3e-4}")
    assert read_yaml(path).ppo.learning_rate == 3e-4


def test_a_run_of_other_settings_is_not_continued(
    tmp_path: Path, done: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    shutil.copytree(done.config.out, out)
    again = ("--config", str(out / "config.yaml"), "--out", str(out))
    assert "--resume continues a run" in refused(capsys, *again)
    said = refused(capsys, *again, "--resume", "--ppo.gamma", "0.9")
    assert "ppo.gamma (0.99 there, 0.9 now)" in said
    said = refused(capsys, *again, "--resume", "--envs.scenario", "paper-hw-2")
    assert "another scenario, 'paper-sim-2': sensing.sigma_r_rad" in said


def copy_of(done: Run, out: Path) -> tuple[_checkpoints.Checkpoints, TrainConfig]:
    """Its checkpoints and what continues it."""
    shutil.copytree(done.config.out, out)
    return _checkpoints.Checkpoints(out), replace(done.config, out=out, resume=True)


def test_a_scenario_that_changed_under_its_name_is_refused(tmp_path: Path, done: Run) -> None:
    checkpoints, _ = copy_of(done, tmp_path / "run")
    folder = checkpoints.path()
    network = load_network(folder / "policy.npz")
    scenario = json.loads(json.dumps(network.scenario))
    scenario["sensing"]["sigma_t_m"] = 7.0
    replace(network, scenario=scenario).save(folder / "policy.npz")
    with pytest.raises(BadInputError, match=r"of another scenario, .* sensing.sigma_t_m \(7.0 there"):
        checkpoints.check(folder, done.scenario)
    replace(network, layout=[("own/err", 2), *network.layout[1:]]).save(folder / "policy.npz")
    with pytest.raises(BadInputError, match="the first is 'own/err': 2 in training, 1 in 'paper-sim-2'"):
        checkpoints.check(folder, done.scenario)


@pytest.mark.parametrize("name", ["training.npz", "policy.npz", "state.json"])
def test_one_flipped_byte_is_named_and_the_checkpoint_before_it_taken(
    tmp_path: Path, done: Run, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    checkpoints, config = copy_of(done, tmp_path / "run")
    path = checkpoints.path() / name
    content = bytearray(path.read_bytes())
    content[len(content) // 3] ^= 0x02
    path.write_bytes(bytes(content))
    run = Run(config, Console())
    run.norm.close()
    said = capsys.readouterr().out
    assert str(path) in said
    assert "going on from step-000000080" in said
    assert run.state.agent_steps == 0
    assert checkpoints.path().name == checkpoints.path("best").name == "step-000000080"
    # Nothing is left of what the damaged one scored.
    table = pd.read_parquet(config.out / "curve.parquet")
    assert table[table["policy"] == "learned"]["agent_steps"].tolist() == [80]
    (checkpoints.path() / name).write_bytes(b"")
    with pytest.raises(BadInputError, match=rf"step-000000080/{name}"):
        Run(config, Console())


@pytest.mark.parametrize(
    "pointer",
    ["", "[", "{}", '{"checkpoint": 3}', '{"checkpoint": "../step-000000240"}', '{"checkpoint": "{out}"}'],
)
def test_a_pointer_names_a_checkpoint_beside_it_or_is_refused(
    tmp_path: Path, done: Run, capsys: pytest.CaptureFixture[str], pointer: str
) -> None:
    checkpoints, config = copy_of(done, tmp_path / "run")
    elsewhere = checkpoints.path().rename(tmp_path / "step-000000240")
    (checkpoints.folder / "last.json").write_text(pointer.replace("{out}", str(elsewhere)))
    again = ("--config", str(config.out / "config.yaml"), "--out", str(config.out), "--resume")
    assert f"{checkpoints.folder / 'last.json'}" in refused(capsys, *again)
    (checkpoints.folder / "last.json").write_text('{"checkpoint": "step-000000240"}')
    (checkpoints.folder / "step-000000240").symlink_to(elsewhere)
    assert "must be a folder, not a link" in refused(capsys, *again)


def test_a_pickle_is_refused_and_does_not_run(
    tmp_path: Path, done: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    """As checkpoints had one once; and where an array would be."""
    checkpoints, config = copy_of(done, tmp_path / "run")
    folder = checkpoints.path()
    program = f"cos\nsystem\n(S'touch {tmp_path / 'ran'}'\ntR.".encode()
    again = ("--config", str(config.out / "config.yaml"), "--out", str(config.out), "--resume")
    (folder / "vecnormalize.pkl").write_bytes(program)
    assert "a pickle is a program" in refused(capsys, *again)
    assert not (tmp_path / "ran").exists()
    (folder / "vecnormalize.pkl").unlink()
    np.savez(folder / "training.npz", x=np.array([Path("x")], dtype=object))
    with pytest.raises(BadInputError, match="not of Python objects"):
        _checkpoints.read_training(folder)


class Killed(BaseException):
    """What no handler of ours catches."""


def test_a_kill_between_any_two_writes_leaves_no_score_of_a_lost_network(
    tmp_path: Path, done: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The best is the best of those that are there, and the curve has each of them once."""
    replace_file = os.replace
    for k in range(99):
        checkpoints, config = copy_of(done, tmp_path / str(k))
        run = Run(config, Console(quiet=True))
        run.model.num_timesteps += 40
        left = [k]

        def killing(*args: Any, left: list[int] = left) -> None:
            left[0] -= 1
            if left[0] < 0:
                raise Killed
            replace_file(*args)

        with monkeypatch.context() as patch, suppress(Killed):
            patch.setattr(os, "replace", killing)
            patch.setattr(_learning_curve, "mapped_shares", lambda *_: np.array([0.99]))
            run.evaluated(9)
        run.norm.close()
        again = Run(config, Console(quiet=True))
        again.norm.close()
        table = pd.read_parquet(config.out / "curve.parquet")
        mine = table[table["policy"] == "learned"].set_index("agent_steps")["mapped_share"]
        whole = [80, 240] if again.state.agent_steps == 160 else [80, 240, 280]
        assert mine.index.tolist() == whole
        assert checkpoints.path("best").name == f"step-{mine.idxmax():09d}"
        if left[0] >= 0:
            assert whole == [80, 240, 280]
            assert k >= 6
            return
        shutil.rmtree(config.out)


def test_what_is_restored_is_what_was_saved(tmp_path: Path, done: Run) -> None:
    """Weights, moments of the optimiser, statistics and generators, to the bit."""
    checkpoints, config = copy_of(done, tmp_path / "run")
    saved = _checkpoints.read_training(checkpoints.path())
    run = Run(config, Console(quiet=True))
    run.norm.close()
    restored = arrays_of(run.model, run.norm)
    assert set(restored) == {name for name in saved if not name.startswith("curve/")}
    assert sum(name.startswith("optimiser/") for name in restored) > 10
    for name, array in restored.items():
        if not name.startswith("chance/"):  # the logger and the curve may draw
            np.testing.assert_array_equal(array, saved[name], err_msg=name)


def test_two_trainings_do_not_share_a_folder(
    tmp_path: Path, done: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    _, config = copy_of(done, tmp_path / "run")
    again = ("--config", str(config.out / "config.yaml"), "--out", str(config.out), "--resume")
    with held(config.out):
        assert "no other run works in" in refused(capsys, *again)


def test_overwrite_removes_nothing_but_a_run_of_ours(
    tmp_path: Path, done: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    _, config = copy_of(done, tmp_path / "run")
    for thesis in (config.out / "thesis.tex", config.out / "checkpoints" / "thesis.tex"):
        thesis.write_text("40 pages")
        assert "thesis.tex" in refused(capsys, "--out", str(config.out), "--overwrite")
        assert thesis.exists()
        thesis.unlink()


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("")
    said = refused(capsys, "--out", str(tmp_path / "file" / "run"))
    assert str(tmp_path / "file") in said
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("")
    assert "must be new or empty" in refused(capsys, "--out", str(tmp_path / "mine"), "--overwrite")
    assert (tmp_path / "mine" / "thesis.txt").exists()


def test_torch_is_left_at_one_thread(done: Run) -> None:
    assert torch.get_num_threads() == 1
    assert run_episode(done.scenario, "random", 1).figures["n_steps"] == 10


def test_worlds_of_training_are_not_those_of_an_evaluation() -> None:
    with pytest.raises(ValueError, match="whose worlds are not those of an evaluation"):
        _rollouts._keep_apart([trial_seed(HELD_OUT_SEED, 3)], 1)
