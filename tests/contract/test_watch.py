"""Films and recordings: of the episode that an evaluation plays, there whole or not at all."""

import importlib.util
from collections.abc import Sequence
from pathlib import Path

import imageio.v2 as imageio
import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from baselines import watch
from baselines.evaluate import run_episode
from baselines.evaluation import episodes
from baselines.evaluation.recording import Recording
from baselines.watch import WatchConfig, main
from envs.render.scene import Scene, scene_of
from wifipgo.scenarios import scenario_named

SHORT = ("n_steps=3",)
HEIGHT_PX = 320
SPACE = (
    *(f"{which}/{what}" for which in ("true", "estimate") for what in ("paths", "robots")),
    *("graph/between_robots", "graph/places_seen_again", "links", "calls", "profiles", "met"),
)
CURVES = ("err/threshold", *(f"{name}/robot_{k}" for name in ("err", "ate_trans", "ate_rot") for k in (0, 1)))
HOLD = 20  # two seconds of the last picture at 10 pictures a second


def film_to(out: Path, *arguments: str) -> int:
    return main(["--out", str(out), "--set", *SHORT, "--height-px", str(HEIGHT_PX), *arguments])


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # imageio's reader leaks pipes
def test_mp4_has_a_picture_of_every_iteration_and_some_between(tmp_path: Path) -> None:
    assert film_to(tmp_path / "run.mp4", "--between", "1") == 0
    n_frames, seconds = imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "run.mp4"))
    assert n_frames == 1 + 3 * 2 + HOLD
    assert seconds == pytest.approx(n_frames / 10.0)
    frames = [np.asarray(frame) for frame in imageio.mimread(tmp_path / "run.mp4")]
    assert all(frame.shape == (320, 448, 3) for frame in frames)
    assert not np.array_equal(frames[0], frames[3])
    assert [path.name for path in tmp_path.iterdir()] == ["run.mp4"]


def test_gif_runs_at_the_rate_asked_for(tmp_path: Path) -> None:
    assert film_to(tmp_path / "run.gif", "--fps", "4", "--between", "0") == 0
    with Image.open(tmp_path / "run.gif") as film:
        assert film.info["duration"] == 250  # ms
        assert film.n_frames >= 4  # type: ignore[attr-defined]  # repeated pictures may be joined


def test_still_is_the_picture_that_the_environment_renders(tmp_path: Path) -> None:
    """The panel differs by its caption; the arena does not."""
    from envs.rendezvous_v0 import parallel_env  # noqa: PLC0415 (beside what it is compared with)

    assert film_to(tmp_path / "run.png", "--until", "0", "--seed", "5") == 0
    env = parallel_env("paper-hw-2", n_steps=3, render_mode="rgb_array", render_height_px=HEIGHT_PX)
    env.reset(seed=5)
    expected = env.render()
    assert expected is not None
    still = np.asarray(imageio.imread(tmp_path / "run.png"))
    np.testing.assert_array_equal(still[:, :HEIGHT_PX], expected[:, :HEIGHT_PX])


def test_what_is_watched_is_what_is_evaluated(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = WatchConfig(out=tmp_path / "run.png", overrides=SHORT, height_px=HEIGHT_PX, seed=3, trial=2)
    seed = episodes.trial_seed(3, 2)
    (episode,) = watch.watch(config)
    other = run_episode(scenario_named("paper-hw-2", n_steps=3), "active", seed)
    np.testing.assert_array_equal(episode.reference, other.reference)
    np.testing.assert_array_equal(episode.estimate, other.estimate)
    assert not capsys.readouterr().out  # as a library it is silent


def test_seed_and_summary_are_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert film_to(tmp_path / "run.png", "--seed", "12", "--policy", "random") == 0
    printed = capsys.readouterr().out
    assert "random, seed 12" in printed
    assert "rendezvous: 0" in printed
    assert f"written: {tmp_path / 'run.png'}" in printed


def test_a_failure_leaves_nothing_and_replaces_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = tmp_path / "run.mp4"
    before.write_bytes(b"mine")

    def break_down(*arguments: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Recording, "add", break_down)
    assert film_to(before, "--overwrite") == 130
    assert before.read_bytes() == b"mine"
    assert [path.name for path in tmp_path.iterdir()] == ["run.mp4"]
    monkeypatch.undo()
    assert film_to(before, "--overwrite") == 0
    assert before.read_bytes() != b"mine"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "out or rerun must be given, e.g. --out run.mp4"),
        (["--out", "run.avi"], "unknown kind of file for out '.avi'; known: .gif, .mp4, .png"),
        (["--out", "run"], "unknown kind of file for out ''; known: .gif, .mp4, .png"),
        (["--rerun", "run.mp4"], "unknown kind of file for rerun '.mp4'; known: .rrd"),
        (["--out", "nowhere/run.mp4"], "out must be in a folder that exists, got 'nowhere/run.mp4'"),
        (["--out", "there.png"], "out must be new (--overwrite replaces what is there), got 'there.png'"),
        (["--out", "folder.png", "--overwrite"], "out must be a file, got 'folder.png'"),
        (["--out", "/proc/run.mp4"], "out must be in a folder that takes files (No such file or directory)"),
        (["--out", "run.png", "--scenario", "paper"], "unknown scenario 'paper'; known: link-binds,"),
        (["--out", "run.png", "--policy", "nobody"], "unknown policy 'nobody'; known: active,"),
        (["--out", "run.png", "--policy", "active:gain=1"], "'gain'; known: "),
        (["--out", "run.png", "--set", "n_obstacle=4"], "unknown scenario field 'n_obstacle'; known: "),
        (["--out", "run.png", "--set", "n_obstacles"], "must be KEY=VALUE"),
        (["--out", "run.png", "--seed", "-1"], "seed must be >= 0, got -1"),
        (["--out", "run.png", "--trial", "-1"], "trial must be >= 0, got -1"),
        (["--out", "run.png", "--until", "-1"], "until must be >= 0, got -1"),
        (["--out", "run.png", "--between", "-1"], "between must be >= 0, got -1"),
        (["--out", "run.png", "--policies", "active,nobody"], "unknown policy 'nobody'; known: active,"),
        (["--rerun", "run.rrd", "--policies", "active,random"], "rerun must be of one policy"),
        (["--out", "run.png", "--fps", "0"], "fps must be in 1..100, got 0"),
        (
            ["--out", "run.png", "--height-px", "600"],
            "height_px must be a multiple of 16 in 320..4096, got 600",
        ),
    ],
)
def test_what_cannot_run_is_refused_in_a_line(
    arguments: Sequence[str],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "there.png").write_bytes(b"mine")
    assert main(arguments) == 2
    printed = capsys.readouterr()
    assert message in printed.err
    assert printed.err.count("\n") == 1
    assert not printed.out
    assert {path.name for path in tmp_path.iterdir()} == {"folder.png", "there.png"}
    assert (tmp_path / "there.png").read_bytes() == b"mine"


@pytest.mark.parametrize(
    ("target", "absent", "extra"),
    [
        ("--out=run.mp4", "pygame", "video"),
        ("--out=run.mp4", "imageio_ffmpeg", "video"),
        ("--rerun=run.rrd", "rerun", "viz"),
    ],
)
def test_a_missing_extra_is_named(
    target: str, absent: str, extra: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    found = importlib.util.find_spec

    def without(name: str, package: str | None = None) -> object:
        return None if name == absent else found(name, package)

    monkeypatch.setattr(importlib.util, "find_spec", without)
    assert main([target]) == 2
    assert f"the extra '{extra}'" in capsys.readouterr().err


def test_policies_side_by_side_play_what_each_plays_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The arenas of the last picture are those of two stills; the rest says who it is."""
    out = tmp_path / "both.png"
    assert film_to(out, "--policies", "active,random", "--seed", "3") == 0
    printed = capsys.readouterr().out
    assert "active: Err" in printed
    assert "random: Err" in printed
    both = np.asarray(imageio.imread(out))
    top = 26  # height of the names
    for place, policy in enumerate(("active", "random")):
        assert film_to(tmp_path / f"{policy}.png", "--policy", policy, "--seed", "3") == 0
        alone = np.asarray(imageio.imread(tmp_path / f"{policy}.png"))[:, :HEIGHT_PX]
        left = place * HEIGHT_PX
        np.testing.assert_array_equal(both[top : top + HEIGHT_PX, left : left + HEIGHT_PX], alone)


def test_a_film_shows_the_score_that_is_reported() -> None:
    """The shares mapped and seen after every step."""
    scenes: list[Scene] = []
    scenario = scenario_named("paper-sim-2", n_steps=4)
    episode = run_episode(
        scenario, "team_plan", 3, on_tick=lambda tick, _: scenes.append(scene_of(tick, scenario))
    )
    shown = np.array([(scene.mapped_share, scene.seen_share) for scene in scenes[1:]])
    told = np.stack([episode.steps["mapped_share"][:, 0], episode.steps["coverage"][:, 0]], axis=1)
    np.testing.assert_allclose(shown, told)
    assert (np.diff(shown[:, 1]) > 0.0).any()


def test_help_teaches(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["--help"])
    printed = capsys.readouterr().out
    assert end.value.code == 0
    assert "wifipgo watch --scenario paper-hw-2-obstacles" in printed
    assert all(f"--{option}" in printed for option in ("policy", "seed", "set", "out", "rerun", "fps"))


def test_recording_holds_space_and_curves(tmp_path: Path) -> None:
    """What another program finds in the file: entities, and a point of each curve for each iteration."""
    pytest.importorskip("rerun", reason="the extra viz is not installed")
    from rerun.chunk import RrdReader  # noqa: PLC0415 (belongs to an extra)

    arguments = ["--set", "n_steps=6", "n_obstacles=2", "size_m=10", "--seed", "1"]
    assert main(["--rerun", str(tmp_path / "run.rrd"), *arguments]) == 0
    assert [path.name for path in tmp_path.iterdir()] == ["run.rrd"]
    chunks = list(RrdReader(str(tmp_path / "run.rrd")).stream())
    moving = {chunk.entity_path: 0 for chunk in chunks if not chunk.is_static}
    for chunk in chunks:
        if not chunk.is_static:
            moving[chunk.entity_path] += chunk.num_rows
    expected = {f"/space/{name}" for name in SPACE} | {f"/{name}" for name in CURVES}
    assert expected <= moving.keys()
    assert {moving[entity] for entity in expected} == {7}
    assert {"/space/walls", "/space/obstacles"} <= {chunk.entity_path for chunk in chunks if chunk.is_static}
    assert {"iteration"} == {name for chunk in chunks for name in chunk.timeline_names}
