"""Pictures of figures, benchmarks, rooms and trainings: texts fit, and no legend hides a curve."""

from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from support.layouts import assert_readable, curves, saved_figures

from baselines.conduct.conduct import Conduct
from baselines.conduct.findings import Findings
from baselines.conduct.picture import draw_findings
from baselines.evaluation.episodes import Episode
from baselines.evaluation.labels import whole
from baselines.reproduce import _draw_outliers, fig8
from baselines.reproduce._outlier_trials import METHODS
from baselines.reproduce._runs import Setting
from baselines.reproduce._two_robots import ROOMS
from baselines.reproduce.encounter_grid import ODOMETRY
from baselines.suite.definition import Part, Suite
from benchmarks import outliers, real_csi
from envs._describe_picture import draw_room
from envs.rendezvous_v0 import RendezvousEnv
from train._learning_curve import LEARNED, drawn
from wifipgo.graph.outliers.aoa_weights import likelihood
from wifipgo.scenarios import SCENARIOS


def test_figure_10(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Bearings within a degree, as where the signal is strong, and trials of which some are far off."""
    saved, rng = saved_figures(monkeypatch), np.random.default_rng(0)
    n, off_rad = 60, 0.3 * rng.standard_normal(60)
    met = pd.DataFrame(
        {
            "aoa_error_rad": 0.01 * rng.standard_normal(n),
            "pose_azimuth_error_rad": 0.3 * rng.standard_normal(n),
            "off_rad": off_rad,
            "weight": likelihood(np.abs(off_rad)),
            "is_outlier": rng.random(n) < 0.3,
        }
    )
    rows = product(METHODS, ("no", "random", "same", "gross"), (1.0, 4.0), ODOMETRY.values())
    grid = pd.DataFrame(rows, columns=["method", "kind", "range_m", "odometry"]).assign(error=1.0)
    _draw_outliers.draw(tmp_path / "fig10.png", rng.exponential(0.3, (20, len(METHODS))), met, grid)
    assert_readable(saved[0])
    numbers = {text.get_text() for axes in saved[0].axes for text in axes.texts}
    assert numbers == {"0"}


@pytest.mark.parametrize("value", [-0.4, -0.0, 0.3])
def test_zero_has_no_sign(value: float) -> None:
    assert whole(value) == "0"


def test_outlier_methods() -> None:
    rng = np.random.default_rng(1)
    cells = outliers.grid(full=False)
    rows = [
        {
            "kind": cell.kind if cell.n_outliers else "no",
            "n_outliers": cell.n_outliers,
            "range_m": cell.range_m,
            "odometry": ODOMETRY[cell.odometry_scale],
            "method": method,
            "reduction": 100.0 * rng.uniform(-2.0, 1.0),
            "half": 3.0,
        }
        for cell, method in product(cells, outliers.COLUMNS)
    ]
    figure = outliers.picture(
        pd.DataFrame(rows), "Outlier methods: 456 cells, 200 paired trials each, seed 0"
    )
    assert_readable(figure)


def test_learning_curve() -> None:
    """The band is named, and a checkpoint beside the scripted policies leaves room for the curve."""
    keys = [(10_000 * k, LEARNED) for k in range(8)]
    keys += [(0, name) for name in ("active", "ppo:path=/data/someone/runs/a-long-name/checkpoints/best.npz")]
    rows = [(at, name, t, 0.5 + 0.01 * t) for (at, name), t in product(keys, range(5))]
    figure = drawn(
        pd.DataFrame(rows, columns=["agent_steps", "policy", "trial", "mapped_share"]), "paper-sim-2"
    )
    assert_readable(figure)
    assert figure.axes[0].get_position().width > 0.5
    names = {text.get_text() for text in figure.legends[0].get_texts()}
    assert {"95 % of its mean", LEARNED, "active: 0.52"} <= names


def test_why_a_policy_wins(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Long names, scenarios enough, and teams that never meet."""
    saved, rng, n = saved_figures(monkeypatch), np.random.default_rng(4), 12
    parts = {name: Part(SCENARIOS["paper-sim-2"], 1, ()) for name in ("sim", "hw", "boxes", "hetero", "four")}
    policy, rule = "mine=ppo:path=/data/someone/runs/a-long-name/checkpoints/best.npz", "team_plan"
    without = tuple(f"{policy} without {name}" for name in ("profile", "camera", "calls"))

    def played() -> Conduct:
        share, of_robots = rng.uniform(size=(n, 50)), rng.uniform(0.0, 20.0, (n, 50, 2))
        nothing = np.zeros((n, 50, 2), dtype=bool)
        grows = np.cumsum(share, axis=1) / 50.0
        return Conduct(grows, grows, nothing, nothing, of_robots, of_robots, of_robots, of_robots)

    everything = {name: {label: played() for label in (rule, policy, *without)} for name in parts}
    suite = Suite(name="suite-v1", parts=parts, worlds=n)
    found = Findings(suite, policy, rule, without, (rule, policy), everything)
    draw_findings(tmp_path / "why.png", found, title=f"{policy} beside {rule}, 12 worlds")
    assert_readable(saved[0])
    assert all(axes.get_title(loc="left") and axes.get_xlabel() for axes in saved[0].axes)


def test_real_recordings(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    saved, rng = saved_figures(monkeypatch), np.random.default_rng(2)
    rows = [
        real_csi.Row._make([name, "1", str(k), "tx1", 99, 0.0, 0.0, *rng.exponential(5.0, 5).tolist(), 0.5])
        for name in ("LOS_Set_A", "NLOS_Set_A")
        for k in range(15)
    ]
    real_csi.save_picture(rows, rng.random(30) < 0.1, tmp_path / "real_csi.png")
    assert_readable(saved[0])
    assert all(axes.get_xlabel() and axes.get_ylabel() for axes in saved[0].axes)


def test_no_circle_of_a_room_is_cut(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A robot that starts at a wall sees farther than the wall."""
    saved = saved_figures(monkeypatch)
    env = RendezvousEnv("paper-hw-2", starts=[[0.4, 0.5, 0.0], [19.0, 19.5, 1.0]], sensor_range_m=4.0)
    env.reset(seed=0)
    draw_room(tmp_path / "room.png", env, seed=0)
    assert_readable(saved[0])
    (axes,) = saved[0].axes
    low, high = axes.get_xlim()
    for circle in axes.patches:
        box = circle.get_extents().transformed(axes.transData.inverted())
        assert low <= box.x0 <= box.x1 <= high
        assert low <= box.y0 <= box.y1 <= high


def test_figure_8_draws_the_threshold_that_was_played(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The scenario's own is 10; a run under a changed assumption has another."""
    saved, rng = saved_figures(monkeypatch), np.random.default_rng(3)
    trials = [object.__new__(Episode) for _ in range(3)]
    for trial in trials:
        object.__setattr__(trial, "steps", {"err": 40.0 * curves(2, 9, rng).T})
    rooms = {room: dict.fromkeys(("active", "random", "random, every step"), trials) for room in ROOMS}
    setting = Setting(trials=3, seed=0, cache=tmp_path, changes={"err_threshold": 5.0})
    fig8._draw_all(tmp_path / "fig8.png", rooms, setting)
    assert_readable(saved[0])
    labels = {text.get_text() for text in saved[0].legends[0].get_texts()}
    assert "threshold 5" in labels
    assert {"active", "active, robot 0"} <= labels
