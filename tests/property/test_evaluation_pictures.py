"""Pictures of an evaluation can be read, whatever is compared: texts fit, and one trial stands for all."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.layouts import assert_readable, curves, saved_figures

from baselines.evaluation import pictures
from baselines.evaluation.arena_picture import draw_arena, window
from baselines.evaluation.episodes import Episode
from baselines.evaluation.err_picture import draw_err
from baselines.evaluation.intervals import mean_of
from baselines.evaluation.labels import names_of, wrapped
from baselines.evaluation.median_trial import median_trial
from baselines.evaluation.plan import Plan
from baselines.evaluation.plots import bands, by_trial
from baselines.evaluation.run_folder import Tables
from baselines.evaluation.score_picture import draw_score
from baselines.policies.specs import Spec
from wifipgo.scenarios import scenario_named
from wifipgo.world.layout import room_walls

LONG = "ppo:path=/data/someone/experiments/2026-11-28/rendezvous/seed-{}/checkpoints/best/policy.npz"
NAMES = {
    1: ["active"],
    15: [LONG.format(k) if k % 3 else 2 * f"active{k}" + k * "x" for k in range(15)],
}
SCENARIO = scenario_named("paper-hw-2")


def plan_of(policies: Sequence[str], trials: int) -> Plan:
    """A plan whose policies need not exist."""
    plan = object.__new__(Plan)
    values = {
        "scenario": SCENARIO,
        "specs": tuple(Spec(policy, "", "random", ()) for policy in policies),
        "trials": trials,
        "seed": 0,
        "trials_from": 0,
        "against": "",
    }
    for name, value in values.items():
        object.__setattr__(plan, name, value)
    return plan


def episode(policy: str, rng: np.random.Generator, trial: int, n_steps: int = 6) -> Episode:
    """Two robots that drive about a corner of the room."""
    reference = np.cumsum(rng.uniform(-1.0, 1.5, (2, n_steps + 1, 3)), axis=1) + 2.0
    estimate = reference + 0.3 * rng.standard_normal(reference.shape)
    score, err = curves(1, n_steps, rng)[0], 30.0 * curves(2, n_steps, rng).T
    steps = {"err": err, "mapped_share": np.stack([score, score], axis=1), "met": err > 20.0}
    figures = {"mapped_share": float(score[-1]), "ate_trans": 0.1234, "rendezvous": 1}
    meetings = np.array([[2.0, *reference[0, 2, :2]]])
    return Episode(
        policy=policy,
        trial=trial,
        seed=3_000_000_000 + trial,
        figures=figures,
        steps=steps,
        meetings=meetings,
        reference=reference,
        estimate=estimate,
        walls_m=room_walls(20.0),
        obstacles_m=(),
    )


def tables_of(episodes: Sequence[Episode]) -> Tables:
    """Their rows."""
    parts = []
    for e in episodes:
        iteration, robot = np.indices(e.steps["err"].shape).reshape(2, -1)
        keys = {"policy": e.policy, "trial": e.trial, "iteration": iteration + 1, "robot": robot}
        parts.append(pd.DataFrame(keys | {name: column.ravel() for name, column in e.steps.items()}))
    rows = [{"policy": e.policy, "trial": e.trial, **e.figures} for e in episodes]
    return Tables(pd.DataFrame(rows), pd.concat(parts, ignore_index=True))


@pytest.mark.parametrize("n", NAMES)
def test_every_picture_can_be_read(n: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    saved, rng, trials = saved_figures(monkeypatch), np.random.default_rng(n), 1 if n == 1 else 3
    plan = plan_of(NAMES[n], trials)
    episodes = [episode(policy, rng, trial) for policy in plan.policies for trial in range(trials)]
    tables, shown = tables_of(episodes), {e.policy: e for e in episodes if e.trial == 0}
    draw_score(tmp_path / "score.png", plan, tables)
    draw_err(tmp_path / "err.png", plan, tables)
    draw_arena(tmp_path / "arena.png", plan, shown, median_trial(tables.episodes))
    for figure in saved:
        assert_readable(figure)


def test_rows_of_the_score_are_in_the_order_of_the_score(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    saved, rng = saved_figures(monkeypatch), np.random.default_rng(0)
    plan = plan_of(["low", "high", "middle"], 2)
    episodes = [episode(policy, rng, trial) for policy in plan.policies for trial in range(2)]
    tables = tables_of(episodes)
    factor = tables.steps["policy"].map({"low": 0.2, "high": 1.0, "middle": 0.5})
    tables.steps["mapped_share"] *= factor
    draw_score(tmp_path / "score.png", plan, tables)
    below: Any = saved[0].axes[1]
    ticks = dict(zip(below.get_yticks(), (t.get_text() for t in below.get_yticklabels()), strict=True))
    assert [ticks[row] for row in sorted(ticks, reverse=True)] == ["high", "middle", "low"]
    means = {line.get_ydata()[0]: line.get_xdata()[0] for line in below.lines if line.get_marker() == "o"}
    assert means[2] > means[1] > means[0]


@settings(max_examples=20)
@given(scores=st.lists(st.floats(0.0, 1.0), min_size=1, max_size=9, unique=True))
def test_of_one_policy_the_trial_in_the_middle_is_shown(scores: list[float]) -> None:
    rows = pd.DataFrame({"policy": "a", "trial": range(10, 10 + len(scores)), "mapped_share": scores})
    found = median_trial(rows)
    shown = scores[found.number - 10]
    assert shown in {np.quantile(scores, 0.5, method="lower"), np.quantile(scores, 0.5, method="higher")}
    assert found.ranks == {"a": 1 + sum(score > shown for score in scores)}


def test_the_trial_is_in_the_middle_for_every_policy() -> None:
    """Trial 1 is the median of the means, and the best of one policy and the worst of the other."""
    a, b = [0.1, 0.9, 0.5, 0.4, 0.6], [0.9, 0.1, 0.5, 0.7, 0.3]
    rows = pd.DataFrame({"policy": ["a"] * 5 + ["b"] * 5, "trial": [*range(5)] * 2, "mapped_share": a + b})
    assert median_trial(rows) == (2, {"a": 3, "b": 3}, 5)


def test_an_early_end_keeps_the_score_and_meets_nobody() -> None:
    rng = np.random.default_rng(1)
    short, long = episode("a", rng, 0, n_steps=2), episode("a", rng, 1, n_steps=5)
    found = by_trial(tables_of([short, long]).steps, "a")
    assert found.length.tolist() == [2, 5]
    np.testing.assert_array_equal(found.score[0, 1:], short.steps["mapped_share"][-1, 0])
    assert not found.met[0, 2:].any()
    np.testing.assert_allclose(found.err[1], long.steps["err"].mean(axis=1))


def test_bands_are_those_of_each_iteration() -> None:
    values = curves(7, 4, np.random.default_rng(2))
    for k, column in enumerate(values.T):
        alone = mean_of(column)
        assert bands(values)[:, k].tolist() == pytest.approx([alone.value, alone.low, alone.high])


def test_the_arena_is_filled() -> None:
    """What happened spans nine tenths of the long side and half of it or more of the short one."""
    rng = np.random.default_rng(3)
    for width, height in ((1.0, 5.0), (12.0, 3.0), (4.0, 4.0)):
        one = episode("a", rng, 0)
        for poses in (one.reference, one.estimate):
            poses[..., :2] = rng.uniform(0.0, 1.0, poses[..., :2].shape) * [width, height]
        points = np.concatenate([one.reference, one.estimate]).reshape(-1, 3)[:, :2]
        limits = window([one])
        assert (limits[:, 0] <= points.min(axis=0)).all()
        assert (limits[:, 1] >= points.max(axis=0)).all()
        side = limits[:, 1] - limits[:, 0]
        filled = np.ptp(points, axis=0) / side
        assert filled.max() > 0.9
        assert side.min() >= 0.49 * side.max()


@settings(max_examples=40)
@given(text=st.text(min_size=1, max_size=200), width=st.integers(8, 40), most=st.integers(1, 4))
def test_lines_fit(text: str, width: int, most: int) -> None:
    lines = wrapped(text, width, most_lines=most).split("\n")
    assert len(lines) <= most
    assert all(len(line) <= width for line in lines)


def test_what_is_played_again_is_the_policy_behind_the_label() -> None:
    """Where parts were joined, the episodes to show may be in none of them."""
    rng, plan = np.random.default_rng(4), plan_of(["mine", "other"], 2)
    tables = tables_of([episode(policy, rng, trial) for policy in plan.policies for trial in range(2)])
    tasks = pictures._tasks(plan, tables, Path("folder"))
    assert [(task.policy, task.spec) for task in tasks] == [("mine", "random"), ("other", "random")]
    assert pictures.episodes_to_show(plan, tables) == [task.path.name for task in tasks]


def test_names_stay_apart() -> None:
    """Paths that differ in the middle, where a long name is cut."""
    paths = [f"ppo:path=/runs/{40 * 'a'}/{k}/{60 * 'b'}/policy.npz" for k in range(3)]
    assert len(set(names_of(paths))) == 3
