"""Checkpoints: whole or the one before, of the same scenario, and numbers only."""

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
from matplotlib.figure import Figure
from support.short_training import copy_of, refused, small

pytest.importorskip("stable_baselines3")

from rich.console import Console

from baselines.policies.learned.network import load_network
from train import _checkpoints, _learning_curve
from train._model_arrays import arrays_of
from train.training import Run, train
from wifipgo.errors import BadInputError


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
    monkeypatch.setattr(_learning_curve, "drawn", lambda *_: Figure(figsize=(1.0, 1.0)))  # in no time
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
