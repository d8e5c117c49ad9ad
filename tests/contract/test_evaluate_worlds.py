"""Many worlds at once change nothing: results, resuming, worlds that end early, policies of one team."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from support.short_evaluation import short

from baselines import evaluate
from baselines.evaluate import Episode, run_episode, run_episodes
from baselines.evaluation import jobs
from baselines.evaluation.run_folder import steps_frame
from baselines.policies import make_policy
from envs.rendezvous_v0 import parallel_env
from wifipgo.files.results_folder import partial_of
from wifipgo.scenarios import scenario_named


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An evaluation of one batch a policy that ran to its end."""
    out = tmp_path_factory.mktemp("worlds") / "done"
    evaluate.evaluate(short(out))
    return out


@pytest.mark.parametrize("worlds", [1, 2, 5])
def test_results_do_not_depend_on_worlds(done: Path, tmp_path: Path, worlds: int) -> None:
    out = tmp_path / "out"
    evaluate.evaluate(short(out, worlds=worlds))
    for name in ("episodes.parquet", "steps.parquet", "summary.json"):
        assert (out / name).read_bytes() == (done / name).read_bytes()


def test_a_run_goes_on_in_the_middle_of_a_batch(
    done: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is left is put into other batches, of another size."""
    out, real, played = tmp_path / "out", run_episodes, []

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    def seen(*args: Any, **kwargs: Any) -> list[Episode]:
        played.append(kwargs["trials"])
        return real(*args, **kwargs)

    with monkeypatch.context() as patch:
        patch.setattr(evaluate, "_publish", interrupt)
        with pytest.raises(KeyboardInterrupt):
            evaluate.evaluate(short(out, worlds=3))
    for name in ("00-00001.npz", "01-00000.npz", "01-00002.npz"):
        (partial_of(out) / name).unlink()
    monkeypatch.setattr(jobs, "run_episodes", seen)
    evaluate.evaluate(short(out, worlds=2, resume=True))
    assert played == [[0, 2], [1]]
    for name in ("episodes.parquet", "steps.parquet"):
        assert (out / name).read_bytes() == (done / name).read_bytes()


def test_worlds_that_end_before_others_are_as_if_alone() -> None:
    """Each ends when its measurements are taken; what is played beside it goes on, and it does not."""
    scenario = scenario_named("paper-outliers", size_m=10.0)
    together = run_episodes(scenario, "active", range(4), trials=range(4))
    assert len({episode.figures["n_steps"] for episode in together}) > 1
    for seed, one in enumerate(together):
        alone = run_episode(scenario, "active", seed, trial=seed)
        assert one.figures == alone.figures
        for name in ("reference", "estimate", "meetings"):
            np.testing.assert_array_equal(getattr(one, name), getattr(alone, name))
        pd.testing.assert_frame_equal(steps_frame([one]), steps_frame([alone]))


def test_a_policy_of_ones_own_plays_many_worlds() -> None:
    """One that knows a single team plays them one after the other, and gives what the same on rows gives."""
    scenario = scenario_named("paper-hw-2", n_steps=4)
    inside = make_policy("active", scenario)

    class OneTeam:
        """The same policy with one face less."""

        reset, act = staticmethod(inside.reset), staticmethod(inside.act)

    for one, other in zip(
        run_episodes(scenario, OneTeam(), [3, 4]), run_episodes(scenario, "active", [3, 4]), strict=True
    ):
        np.testing.assert_array_equal(one.reference, other.reference)
        assert one.figures == other.figures


def test_steps_have_what_the_team_saw_and_mapped() -> None:
    """What the environment of one world says after each step, played by hand."""
    env = parallel_env("paper-hw-2", n_steps=5)
    policy, told = make_policy("active", env.scenario), []
    policy.reset(3)
    observations, _ = env.reset(seed=3)
    while env.agents:
        observations, *_, infos = env.step(policy.act(observations))
        told.append(
            [[info[f"{name}_truth"] for info in infos.values()] for name in ("coverage", "mapped_share")]
        )
    episode = run_episodes(env.scenario, "active", [7, 3])[1]
    for name, expected in zip(("coverage", "mapped_share"), np.moveaxis(np.array(told), 1, 0), strict=True):
        np.testing.assert_array_equal(episode.steps[name], expected)
        assert episode.figures[name] == expected[-1, 0]
    assert np.ptp(episode.steps["coverage"]) > 0.0
