"""The evaluation keeps its word: paired, repeatable, nothing lost, results whole or not at all."""

import json
import shlex
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from support.short_evaluation import SHORT, short

from baselines import evaluate
from baselines.evaluate import (
    Episode,
    EpisodesFailedError,
    main,
    run_episode,
)
from baselines.evaluation import jobs
from baselines.evaluation.batches import Batch
from baselines.evaluation.run_folder import FILES, MEDIAN, PICTURES
from baselines.policies import make_policy
from wifipgo.command import front
from wifipgo.files.results_folder import MANIFEST, partial_of
from wifipgo.scenarios import scenario_named

PNG = b"\x89PNG\r\n\x1a\n"


def steps(out: Path) -> pd.DataFrame:
    return pd.read_parquet(out / "steps.parquet")


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An evaluation that ran to its end."""
    out = tmp_path_factory.mktemp("evaluate") / "done"
    evaluate.evaluate(short(out))
    return out


def fail_at(monkeypatch: pytest.MonkeyPatch, trial: int, policy: str, problem: BaseException) -> None:
    """Make one episode raise, and so whatever is played with it."""
    real = jobs.carry_out

    def carry_out(batch: Batch) -> Sequence[Episode]:
        if any((task.trial, task.policy) == (trial, policy) for task in batch.items):
            raise problem
        return real(batch)

    monkeypatch.setattr(jobs, "carry_out", carry_out)


def test_everything_is_there_and_opens(done: Path) -> None:
    assert {path.name for path in done.iterdir()} == {*FILES, *PICTURES, MANIFEST, MEDIAN}
    assert not partial_of(done).exists()
    assert len(pd.read_parquet(done / "episodes.parquet")) == 2 * 3
    assert len(steps(done)) == 2 * 3 * 4 * 2
    assert all((done / name).read_bytes().startswith(PNG) for name in PICTURES)


def test_trials_are_paired(done: Path) -> None:
    """One seed a trial whatever the policy; until anything is decided, one world and one noise."""
    seeds = pd.read_parquet(done / "episodes.parquet").groupby("trial")["seed"]
    assert (seeds.nunique() == 1).all()
    assert seeds.first().is_unique
    first = steps(done).query("iteration == 1").set_index(["policy", "trial", "robot"])
    for column in ("x_true_m", "x_estimate_m"):
        np.testing.assert_array_equal(first.loc["active", column], first.loc["random", column])


def test_figures_follow_from_the_steps(done: Path) -> None:
    episodes = pd.read_parquet(done / "episodes.parquet").set_index(["policy", "trial"])
    rows = steps(done)
    by_episode = rows.groupby(["policy", "trial"])
    np.testing.assert_allclose(episodes["err_last10"], by_episode["err"].mean())
    last = rows[rows["iteration"] == 4].groupby(["policy", "trial"])
    np.testing.assert_allclose(episodes["ate_trans"], last["ate_trans"].mean())
    np.testing.assert_allclose(episodes["distance_m"], last["distance_m"].sum())


def test_summary_compares_with_active(done: Path) -> None:
    summary = json.loads((done / "summary.json").read_text())
    episodes = pd.read_parquet(done / "episodes.parquet").groupby("policy")["err_last10"].mean()
    paired = summary["paired"]["random"]
    assert summary["reference"] == "active"
    assert paired["n_pairs"] == 3
    assert paired["err_ratio"]["value"] == pytest.approx(episodes["random"] / episodes["active"])


def test_saved_configuration_gives_the_same_results(done: Path, tmp_path: Path) -> None:
    again = tmp_path / "again"
    assert main(["--config", str(done / "config.json"), "--out", str(again), "--jobs", "1"]) == 0
    pd.testing.assert_frame_equal(steps(done), steps(again))


def test_recorded_command_gives_the_same_results(done: Path, tmp_path: Path) -> None:
    command = shlex.split(json.loads((done / "config.json").read_text())["command"])
    assert command[0] == "wifipgo"
    again = tmp_path / "again"
    assert front.main([*command[1:-1], str(again), "--jobs", "1"]) == 0
    pd.testing.assert_frame_equal(steps(done), steps(again))


def test_results_do_not_depend_on_jobs(done: Path, tmp_path: Path) -> None:
    evaluate.evaluate(short(tmp_path / "two", jobs=2))
    pd.testing.assert_frame_equal(steps(done), steps(tmp_path / "two"))


def test_an_interrupted_run_is_continued(
    done: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    with monkeypatch.context() as patch:
        fail_at(patch, 1, "random", KeyboardInterrupt())
        with pytest.raises(KeyboardInterrupt):
            evaluate.evaluate(short(out))
    assert not out.exists()
    kept = {path: path.stat().st_mtime_ns for path in partial_of(out).glob("*.npz")}
    assert len(kept) == 3
    with pytest.raises(ValueError, match="interrupted run: --resume continues"):
        evaluate.evaluate(short(out))
    with pytest.raises(ValueError, match=r"differs in seed \(0 there, 1 now\)"):
        evaluate.evaluate(short(out, seed=1, resume=True))
    with pytest.raises(ValueError, match=r"differs in scenario\.n_steps"):
        evaluate.evaluate(short(out, overrides=("n_steps=5",), resume=True))
    assert {path: path.stat().st_mtime_ns for path in kept} == kept
    evaluate.evaluate(short(out, resume=True))
    pd.testing.assert_frame_equal(steps(done), steps(out))
    assert not capfd.readouterr().out  # as a library it is silent


def test_an_episode_that_raises_stops_no_other(
    done: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    with monkeypatch.context() as patch:
        fail_at(patch, 0, "random", RuntimeError("wheel lost"))
        with pytest.raises(EpisodesFailedError, match=r"policy random, trial 0, seed \d+: .*wheel lost"):
            evaluate.evaluate(short(out))
    assert len(list(partial_of(out).glob("*.npz"))) == 5
    assert "wheel lost" in (partial_of(out) / "failures.txt").read_text()
    evaluate.evaluate(short(out, resume=True))
    pd.testing.assert_frame_equal(steps(done), steps(out))


def test_results_that_are_there_are_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "out"
    evaluate.evaluate(short(out, trials=1))
    before = steps(out)
    with pytest.raises(ValueError, match="--overwrite"):
        evaluate.evaluate(short(out, trials=1))
    with monkeypatch.context() as patch:
        fail_at(patch, 0, "random", RuntimeError())
        with pytest.raises(EpisodesFailedError):
            evaluate.evaluate(short(out, trials=1, seed=1, overwrite=True))
    pd.testing.assert_frame_equal(steps(out), before)
    evaluate.evaluate(short(out, trials=1, seed=1, overwrite=True, resume=True))
    assert not steps(out).equals(before)
    assert not partial_of(out).exists()


def test_complete_results_are_shown_again(done: Path) -> None:
    written = (done / "summary.json").stat().st_mtime_ns
    summary = evaluate.evaluate(short(done, resume=True))
    assert summary.policies["active"]["n_steps"].value == 4.0
    assert (done / "summary.json").stat().st_mtime_ns == written


def test_a_folder_that_is_no_evaluation_is_never_replaced(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("all of it")
    with pytest.raises(ValueError, match=r"also holds 'thesis.tex'"):
        evaluate.evaluate(short(tmp_path, overwrite=True))
    assert (tmp_path / "thesis.tex").read_text() == "all of it"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--trials", "0"], "trials must be >= 1, got 0"),
        (["--scenario", "[red]x"], "unknown scenario '[red]x'; known: link-binds,"),
        (["--policies", "active,nobody"], "unknown policy 'nobody'; known: active,"),
        (["--policies", "active:gain=1"], "'gain'; known: caller_drives, err_threshold"),
        (["--policies", "random:gain=1"], "'gain'; known: none"),
        (["--policies", "active:err_threshold=high"], "err_threshold must be of type float, got 'high'"),
        (["--policies", ","], "policies must be one or more"),
        (["--policies", "random,random"], "policies must be all different"),
        (["--set", "n_obstacle=4"], "unknown scenario field 'n_obstacle'; known: "),
        (["--set", "n_obstacles"], "must be KEY=VALUE"),
        (["--set", "size_m=-1"], "ArenaConfig.size_m must be in 0.1..2000, got -1.0"),
        (["--seed", "-1"], "seed must be >= 0"),
        (["--jobs", "-1"], "jobs must be >= 0"),
        (["--worlds", "-1"], "worlds must be >= 0"),
        (["--executor", "slurm"], "unknown executor 'slurm'; known: process, ray, serial"),
        (["--ray-address", "auto"], "ray-address must be given with --executor ray only"),
        (["--config", "missing.json"], "missing.json: No such file"),
    ],
)
def test_what_cannot_run_is_refused_in_a_line(
    arguments: Sequence[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["--out", str(tmp_path / "out"), *arguments]) == 2
    printed = capsys.readouterr()
    assert message in printed.err
    assert printed.err.count("\n") == 1
    assert not printed.out
    assert not list(tmp_path.iterdir())


def test_a_path_that_cannot_be_written_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("mine")
    assert main(["--out", str(tmp_path / "file" / "out")]) == 2
    assert main(["--out", str(tmp_path / "file"), "--overwrite"]) == 2
    assert capsys.readouterr().err.count("\n") == 2
    assert (tmp_path / "file").read_text() == "mine"


def test_parameters_of_a_policy_count() -> None:
    """A threshold that nobody reaches makes the active policy one that walks at random."""
    scenario = scenario_named("paper-sim-2", n_steps=12, sigma_t_m=0.4)
    calm, random = (run_episode(scenario, spec, 3) for spec in ("active:err_threshold=1e9", "random"))
    np.testing.assert_array_equal(calm.reference, random.reference)
    alert = run_episode(scenario, make_policy("active", scenario, err_threshold=0.1), 3)
    assert alert.steps["calling"].any()


def test_single_trial_has_no_interval(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["--trials", "1", "--set", *SHORT, "--jobs", "1", "--out", str(tmp_path / "out")]
    assert main(arguments) == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["policies"]["active"]["distance_m"]["low"] is None
    assert "[-]" in capsys.readouterr().out


def test_help_teaches(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["--help"])
    printed = capsys.readouterr().out
    assert end.value.code == 0
    assert "wifipgo evaluate --scenario paper-hw-2-obstacles" in printed
    assert all(
        f"--{option}" in printed
        for option in ("policies", "trials", "seed", "set", "resume", "jobs", "worlds")
    )


def test_a_scenario_file_is_played_and_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The record holds the whole scenario: it repeats the run when the file has changed."""
    room, out = tmp_path / "room.toml", tmp_path / "out"
    text = 'base = "paper-hw-2"\nn_steps = 4\n[arena]\nn_obstacles = 2\nsize_m = 12\n'
    room.write_text(text + "obstacles_m = [[[4, 4], [8, 4], [8, 5]]]\nstarts = [[2, 2, 0], [9, 2, 0]]\n")
    arguments = ["--trials", "1", "--policies", "random", "--jobs", "1"]
    assert main(["--scenario", str(room), *arguments, "--out", str(out)]) == 0
    room.write_text("n_obstacle = 3")
    command = shlex.split(json.loads((out / "config.json").read_text())["command"])
    assert front.main([*command[1:-1], str(tmp_path / "again"), "--jobs", "1"]) == 0
    pd.testing.assert_frame_equal(steps(out), steps(tmp_path / "again"))
    capsys.readouterr()
    assert main(["--scenario", str(room), *arguments, "--out", str(tmp_path / "none")]) == 2
    assert "room.toml: 'n_obstacle'; known: " in capsys.readouterr().err.replace("\n", "")
