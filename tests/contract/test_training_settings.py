"""Settings and folders of a training: what is refused, and how."""

import shutil
from pathlib import Path

import pytest
from support.short_training import copy_of, refused

pytest.importorskip("stable_baselines3")


from train import _config_files
from train._config import HELD_OUT_SEED
from train._config_files import read_yaml, settings_file
from train.training import Run, train
from wifipgo.files.folder_lock import held


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("ppo: {learning_rat: 1}", "unknown key in {path}: 'ppo.learning_rat'; known:"),
        ("ppo: {gamma: 2}", "ppo.gamma must be in [0, 1], got 2.0"),
        ("ppo: {n_epochs: many}", "ppo.n_epochs must be of type int, got 'many'"),
        ("ppo: 3", "ppo must be a table of keys and values, got 3"),
        ("envs: {scenario: paper-sim-3}", "unknown scenario 'paper-sim-3'; known:"),
        ("envs: {reward: err}", "unknown envs.reward 'err'; known: error"),
        (
            "envs: {interface: flat, others: [paper-sim-50]}",
            "envs.others must be of scenarios with the observations of",
        ),
        ("envs: {n_envs: 2, n_workers: 3}", "envs.n_workers must be in 0..2 (n_envs), got 3"),
        ("ppo: {agent_steps: 0}", "nothing to learn"),
        ("ppo: {critic_only: 2}", "ppo.critic_only must be 0 where imitation.policy is empty"),
        ("imitation: {policy: active, instead: [random]}", "imitation.instead must be POLICY in SCENARIO"),
        (
            "imitation: {instead: [random in paper-sim-2]}",
            "imitation.instead must be empty without imitation",
        ),
        ("imitation: {policy: active, instead: [rando in paper-sim-2]}", "unknown policy 'rando'"),
        ("imitation: {policy: start}", "imitation.policy must be other than start unless a network is begun"),
        (
            "imitation: {policy: active, instead: [start in paper-sim-2]}",
            "imitation.policy must be other than start unless",
        ),
        ("imitation: {policy: active, stay_weight: 0}", "imitation.stay_weight must be > 0, got 0.0"),
        ("start: no/such/run", "no/such/run/checkpoints/best.json"),
        ("imitation: {policy: frontier_hom}", "unknown policy 'frontier_hom'; known: active,"),
        ("selection: {policies: ['active:err=1']}", "unknown parameter of policy 'active': 'err'; known:"),
        ("ppo: {batch_size: 300}", "ppo.batch_size must be a divisor of 6400"),
        (f"selection: {{seed: {HELD_OUT_SEED}}}", "another root of held-out worlds"),
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


def test_a_run_from_before_a_setting_existed_is_continued(tmp_path: Path, done: Run) -> None:
    """What its record does not name did what is the default now."""
    _, config = copy_of(done, tmp_path / "run")
    record = config.out / "config.yaml"
    lines = record.read_text().splitlines(keepends=True)
    older = [line for line in lines if not line.startswith(("start:", "  endless:"))]
    assert len(older) == len(lines) - 2
    record.write_text("".join(older))
    assert train(config).state == done.state
    record.write_text("".join(older).replace("norm:", "norm:\n  gone: 1"))
    with pytest.raises(ValueError, match=r"norm\.gone \(1 there, None now\)"):
        train(config)


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
    assert "must be new or empty" in refused(capsys, "--out", str(tmp_path / "mine"))
    assert "also holds 'thesis.txt'" in refused(capsys, "--out", str(tmp_path / "mine"), "--overwrite")
    assert (tmp_path / "mine" / "thesis.txt").exists()


def test_settings_that_ship_are_found_from_anywhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By name, or as documented for a checkout; a file that is there goes first."""
    monkeypatch.chdir(tmp_path)
    shipped = Path(_config_files.__file__).parent / "configs" / "from-nothing.yaml"
    for told in ("from-nothing", "from-nothing.yaml", "train/configs/from-nothing.yaml"):
        assert settings_file(Path(told)) == shipped
    assert read_yaml(shipped).envs.n_envs == 16
    for other in ("other.yaml", "configs/from-nothing.yaml"):
        assert settings_file(Path(other)) == Path(other)
    with pytest.raises(
        ValueError,
        match="unknown training settings 'from-nothin'; known: "
        "everywhere, everywhere-wide, fifty, from-nothing, paper",
    ):
        settings_file(Path("from-nothin"))
    Path("from-nothing").write_text("")
    assert settings_file(Path("from-nothing")) == Path("from-nothing")
