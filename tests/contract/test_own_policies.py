"""Policies of a user's own play wherever ours do; what is wrong with one is said by name."""

import json
import shutil
from concurrent.futures import ProcessPoolExecutor
from importlib.resources import files
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from support.short_evaluation import SHORT, short

from baselines import evaluate as evaluation
from baselines.evaluate import EpisodesFailedError, evaluate, main, run_episode, run_episodes
from baselines.evaluation.config import parsed, plan_of
from baselines.evaluation.drivers import try_policy
from baselines.evaluation.episodes import trial_seed
from baselines.film.config import WatchConfig
from baselines.policies import make_policy
from baselines.watch import watch
from wifipgo.errors import BadInputError
from wifipgo.scenarios import scenario_named

OWN = """
import numpy as np

class Plain:
    '''Turns on its own count: what one episode leaves behind would be seen in the next.'''
    def __init__(self, gain=0.5):
        self.gain, self.n = gain, 0
    def act(self, observations):
        self.n += 1
        angle = self.gain * self.n
        return {robot: np.array([np.cos(angle), np.sin(angle), 1.0]) for robot in observations}

class Seeded(Plain):
    def reset(self, seed):
        self.n = seed % 7

class Rows:
    '''The same as Plain, for many worlds.'''
    def reset_rows(self, seeds, episodes=None, *, mask=None):
        self.n = 0
    def act_rows(self, rows):
        self.n += 1
        angle = 0.5 * self.n
        return np.broadcast_to([np.cos(angle), np.sin(angle), 1.0], (*rows.shape[:2], 3))

def maker(scenario, *, gain: float = 0.5):
    assert scenario.n_robots == 2
    return Plain(gain)

class Answers:
    def __init__(self, what):
        self.what = what
    def act(self, observations):
        good = {robot: [0, 0, 0] for robot in observations}
        return {
            "list": [[0, 0, 0]] * 2,
            "missing": {"robot_0": [0, 0, 0]},
            "unknown": good | {"robot_7": [0, 0, 0]},
            "shape": good | {"robot_1": [0, 0]},
            "choice": good | {"robot_1": 3},
            "nan": good | {"robot_1": [0, float("nan"), 0]},
            "text": good | {"robot_1": ["0", "0", "0"]},
        }[self.what]

class Late(Plain):
    def act(self, observations):
        if self.n == 1:
            raise ZeroDivisionError("nothing left")
        return super().act(observations)

class NeedsFile:
    def __init__(self):
        open("/no/such/weights.npz")

class Idle:
    pass

class Leaves(Plain):
    def __init__(self, when="act"):
        if when == "init":
            raise SystemExit(0)
    def act(self, observations):
        raise SystemExit

number = 3
"""
SCENARIO = scenario_named("paper-hw-2", n_steps=2)


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """A file of policies, in a folder whose name holds everything that separates."""
    path = tmp_path / "12:30, lr=1" / "own.py"
    path.parent.mkdir()
    path.write_text(OWN, encoding="utf-8")
    return path


def spec(own: Path, rest: str) -> str:
    return f"'{own}':{rest}"


def figures(policy: object, seeds: list[int]) -> list[dict[str, float]]:
    return [dict(e.figures) for e in run_episodes(SCENARIO, policy, seeds)]  # type: ignore[arg-type]


@pytest.mark.parametrize("rest", ["Plain", "Seeded", "Rows"])
def test_many_worlds_are_each_world_alone(own: Path, rest: str) -> None:
    """Nothing goes over from one world or episode to another, whether there is a `reset` or not."""
    seeds = [3, 4]
    alone = [dict(run_episode(SCENARIO, spec(own, rest), seed).figures) for seed in seeds]
    assert figures(spec(own, rest), seeds) == alone


def test_forms_of_one_policy_are_one_policy(own: Path) -> None:
    expected = figures(spec(own, "Plain"), [3, 4])
    assert figures(spec(own, "Rows"), [3, 4]) == expected
    assert figures(spec(own, "maker"), [3, 4]) == expected
    assert figures(spec(own, "Plain:gain=0.9"), [3, 4]) != expected


def test_objects_and_classes_play_from_python() -> None:
    class Stay:
        def act(self, observations: object) -> dict[str, list[int]]:
            return {"robot_0": [0, 0, 0], "robot_1": [0, 0, 0]}

    episodes = [run_episode(SCENARIO, policy, 3) for policy in (Stay, Stay())]
    assert {e.policy for e in episodes} == {"Stay"}
    assert all(e.figures["distance_m"] == 0.0 for e in episodes)


@pytest.mark.parametrize(
    ("what", "message"),
    [
        ("list", "answer of policy 'mine' must be a dict with one action for each agent, got [["),
        ("missing", "policy 'mine' must give robot_1 an action, got actions for robot_0"),
        ("unknown", "must be for one of robot_0, robot_1, got one for 'robot_7'"),
        (
            "shape",
            "for robot_1 must be of shape (3,), a waypoint and a call: actions are continuous, got (2,)",
        ),
        (
            "choice",
            "for robot_1 must be of shape (3,), a waypoint and a call: actions are continuous, got ()",
        ),
        ("nan", "for robot_1 must be finite, got [0.0, nan, 0.0]"),
        ("text", "for robot_1 must be 3 numbers, got"),
    ],
)
def test_what_is_wrong_with_an_answer_is_named(own: Path, what: str, message: str) -> None:
    policy = make_policy(spec(own, f"Answers:what={what}"), SCENARIO, label="mine")
    with pytest.raises(BadInputError) as refused:
        try_policy(SCENARIO, policy, 3)
    assert message in str(refused.value)


def test_a_policy_cannot_end_the_evaluation(own: Path) -> None:
    with pytest.raises(BadInputError, match=r"act of policy 'own.py:Leaves' raised SystemExit"):
        try_policy(SCENARIO, make_policy(spec(own, "Leaves"), SCENARIO), 3)


@pytest.mark.parametrize(
    ("rest", "message"),
    [
        ("Plan", "known: Answers, Idle, Late, Leaves, NeedsFile, Plain, Rows, Seeded"),
        ("number", "must be a class, or a function that makes a policy, got 3"),
        ("Idle", "must be something with act(observations)"),
        ("NeedsFile", "making policy 'own.py:NeedsFile' raised FileNotFoundError"),
        ("Leaves:when=init", "making policy 'own.py:Leaves:when=init' raised SystemExit: 0"),
        ("Answers", "must be given what"),
        ("Plain:gian=2", "unknown parameter"),
        ("Plain:gain=fast", "must be of type float, got 'fast'"),
    ],
)
def test_what_cannot_be_made_is_refused(own: Path, rest: str, message: str) -> None:
    with pytest.raises(BadInputError) as refused:
        make_policy(spec(own, rest), SCENARIO)
    assert message in str(refused.value)


def test_places_without_a_policy_are_refused(tmp_path: Path) -> None:
    (tmp_path / "other.py").write_text("def broken(:\n")
    for text, message in {
        f"{tmp_path}/own.py:Plain": "a file that is there; its folder has other.py",
        f"{tmp_path}/other.py:Plain": "raised SyntaxError",
        "no_such_module_of_mine:Plain": "a module that can be imported from here",
        "json.no_such:Plain": "a module that can be imported from here",
        "json:Plain": "known:",
    }.items():
        with pytest.raises(BadInputError) as refused:
            make_policy(text, SCENARIO)
        assert message in str(refused.value)


def test_an_evaluation_can_be_repeated_until_the_source_changes(
    own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Labels are in the tables, paths in the record absolute; processes of their own find the policy."""
    monkeypatch.chdir(own.parent)
    out = tmp_path / "out"
    monkeypatch.setattr(evaluation, "draw", lambda *_: None)
    evaluate(short(out, policies="mine=own.py:Plain:gain=0.9,own.py:Plain", trials=1))
    table = pd.read_parquet(out / "episodes.parquet")
    assert table["policy"].tolist() == ["mine", "own.py:Plain"]
    record = json.loads((out / "config.json").read_text())
    assert record["policies"][0] == f'mine="{own}":Plain:gain=0.9'
    assert record["sources"].keys() == {"mine", "own.py:Plain"}
    monkeypatch.chdir(tmp_path)
    words = ["--config", str(out / "config.json"), "--resume", "--jobs", "1", "--out", str(out)]
    plan = plan_of(parsed(words))
    with ProcessPoolExecutor(1, get_context("spawn")) as apart:
        seed = trial_seed(plan.seed, 0)
        again = apart.submit(run_episode, plan.scenario, str(plan.specs[0]), seed, label="mine").result()
    assert dict(again.figures) == table[[*again.figures]].iloc[0].to_dict()
    own.write_text(OWN + "# changed\n", encoding="utf-8")
    assert main([*words, "--trials", "2"]) == 2
    said = capfd.readouterr()
    assert said.err.splitlines()[-1].startswith("error: ")
    assert "differs in sources.mine" in said.err.splitlines()[-1]
    assert "the source of mine is another" in said.out


def test_what_a_policy_raises_is_shown_in_its_own_code(
    own: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    with pytest.raises(EpisodesFailedError) as failed:
        evaluate(short(out, policies=f"random,late={spec(own, 'Late')}", trials=1))
    lines = str(failed.value).splitlines()
    assert lines[0].startswith("failed: policy late, trial 0")
    assert "act of policy 'late' raised ZeroDivisionError: nothing left (own.py, line" in lines[0]
    assert [line for line in lines if line.strip().startswith("File")] == [
        line for line in lines if str(own) in line
    ]
    code = main(["--policies", f"random,{spec(own, 'Answers:what=nan')}", "--out", str(tmp_path / "no")])
    assert code == 2
    assert "finite" in capfd.readouterr().err
    assert not (tmp_path / "no.partial").exists()


def test_a_policy_of_ones_own_is_watched(own: Path, tmp_path: Path) -> None:
    config = WatchConfig(policy=f"mine={spec(own, 'Plain')}", overrides=SHORT, out=tmp_path / "a.png")
    assert config.caption == "mine, seed 0"
    pytest.importorskip("pygame")
    assert [episode.policy for episode in watch(config)] == ["mine"]


def run_folder(tmp_path: Path) -> Path:
    """A run as training leaves it, its best checkpoint the shipped policy."""
    best, last = (tmp_path / "run" / "checkpoints" / f"step-00000000{k}" for k in (1, 2))
    for folder in (best, last):
        folder.mkdir(parents=True)
    shutil.copyfile(str(files("baselines") / "trained" / "everywhere.npz"), best / "policy.npz")
    (last / "policy.npz").write_bytes(b"not whole")
    for which, folder in {"best": best, "last": last}.items():
        (best.parent / f"{which}.json").write_text(json.dumps({"checkpoint": folder.name}))
    return tmp_path / "run"


def test_a_run_stands_for_its_best_checkpoint(tmp_path: Path) -> None:
    run, seen = run_folder(tmp_path), {f"robot_{k}": np.zeros(368, np.float32) for k in range(2)}
    expected = make_policy("ppo", SCENARIO).act(seen)["robot_0"]
    for path in (run, run / "checkpoints" / "step-000000001"):
        np.testing.assert_array_equal(
            make_policy(f"ppo:path={path}", SCENARIO).act(seen)["robot_0"], expected
        )
    with pytest.raises(BadInputError, match=r"step-000000002/policy.npz is no trained policy"):
        make_policy(f"ppo:path={run}:checkpoint=last", SCENARIO)
    with pytest.raises(BadInputError, match="unknown checkpoint 'first'"):
        make_policy(f"ppo:path={run}:checkpoint=first", SCENARIO)
    with pytest.raises(BadInputError, match="got a folder without these"):
        make_policy(f"ppo:path={tmp_path}", SCENARIO)


def test_a_learned_policy_says_that_it_plays_something_else() -> None:
    def remark(scenario: str, **changes: object) -> str:
        return str(getattr(make_policy("ppo", scenario_named(scenario, **changes)), "remark"))  # noqa: B009

    assert remark("paper-sim-2") == remark("paper-hw-2-obstacles") == ""
    assert remark("paper-hw-2-dark").endswith("plays 'paper-hw-2-dark': visual_range_m 6.0 there, 0.0 now")
    assert "n_steps 50 there, 4 now" in remark("paper-sim-2", n_steps=4)
