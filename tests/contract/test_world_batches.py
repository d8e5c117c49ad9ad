"""Worlds of a VecEnv that are stepped at once give what environments one after the other give."""

import functools
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="training is an extra")

from envs.rendezvous_v0 import RendezvousEnv, parallel_env
from train import TeamVecEnv, rendezvous_vec_env
from train._world_batch import are_worlds

SMALL: dict[str, Any] = {"size_m": 4.0, "n_steps": 5}
KINDS: dict[str, list[partial[Any]]] = {
    "one scenario": [partial(parallel_env, "paper-sim-2", **SMALL)] * 3,
    "two scenarios, in turn": [
        partial(parallel_env, ("paper-sim-2", "paper-hw-2-obstacles")[k % 2], n_steps=4) for k in range(5)
    ],
    "ends of their own": [partial(parallel_env, "paper-sim-2", size_m=4.0, max_measurements=6)] * 3,
    "named blocks": [partial(parallel_env, "paper-hw-2", observation="dict", **SMALL)] * 2,
    "choices": [partial(parallel_env, scenario="paper-hw-2", actions="discrete", **SMALL)] * 2,
    "masks in the observation": [
        partial(parallel_env, "paper-sim-2", actions="discrete", observation="dict", **SMALL)
    ]
    * 2,
}


def made(maker: Callable[[], Any]) -> Any:
    return maker()


def one_by_one(makers: list[Any]) -> list[Callable[[], Any]]:
    """The same environments, not known for worlds."""
    return [partial(made, maker) for maker in makers]


def played(venv: TeamVecEnv, n_steps: int = 14) -> list[Any]:
    """All that comes out of a run with seeds, options and drawn actions."""
    venv.seed(3)
    venv.action_space.seed(5)
    out: list[Any] = [venv.reset(), venv.reset_infos]
    for t in range(n_steps):
        if t == 3:
            venv.set_options([{"n_obstacles": k % 2} for k in range(venv.n_envs)])
        out.append(venv.step(np.array([venv.action_space.sample() for _ in range(venv.num_envs)])))
        out.append(list(venv.reset_infos))
    venv.close()
    return out


@functools.cache
def played_alone(kind: str) -> list[Any]:
    """What comes out of the environments of a kind, one by one."""
    makers = one_by_one(KINDS[kind])
    assert not are_worlds(makers)
    return played(TeamVecEnv(makers))


@pytest.mark.parametrize("n_workers", [0, 2])
@pytest.mark.parametrize("kind", KINDS)
def test_at_once_is_one_by_one(kind: str, n_workers: int) -> None:
    makers, alone = KINDS[kind], played_alone(kind)
    assert are_worlds(makers)
    np.testing.assert_equal(played(TeamVecEnv(makers, n_workers=n_workers)), alone)
    ends = [out[2].all() for out in alone[2::2]]
    assert sum(ends) >= 2 or kind == "ends of their own"
    if kind == "ends of their own":
        dones = np.array([out[2][::2] for out in alone[2::2]])
        assert dones.any(axis=1).sum() > dones.all(axis=1).sum(), "no world ended by itself"


@pytest.mark.parametrize("n_workers", [0, 2])
def test_worlds_in_phases_end_at_other_times(n_workers: int) -> None:
    makers, phases = [partial(parallel_env, "paper-sim-2", n_steps=6)] * 5, [0.0, 1 / 3, 2 / 3, 0.0, 1 / 3]
    venv = TeamVecEnv(makers, n_workers=n_workers, phases=phases)
    venv.seed(0)
    venv.reset()
    ends = [np.flatnonzero(venv.step(np.zeros((10, 3), np.float32))[2][::2]).tolist() for _ in range(9)]
    assert ends == [[], [2], [], [1, 4], [], [0, 3], [], [2], []]
    venv.close()
    with pytest.raises(ValueError, match=r"phases must be in \[0, 1\), and 0 unless all"):
        TeamVecEnv(one_by_one(KINDS["one scenario"]), phases=[0.0, 0.5, 0.0])
    with pytest.raises(ValueError, match="phases must be 5, one an environment, got 2"):
        TeamVecEnv(makers, phases=[0.0, 0.5])


def test_what_was_handed_out_stays() -> None:
    """Arrays of a step are not those that the next one is written into."""
    for n_workers in (0, 1):
        venv = rendezvous_vec_env("paper-sim-2", n_envs=2, n_workers=n_workers, **SMALL)
        first = np.asarray(venv.reset())
        kept = first.copy()
        venv.step(np.ones((4, 3), np.float32))
        np.testing.assert_array_equal(first, kept)
        venv.close()


@pytest.mark.parametrize("makers", [KINDS["choices"], one_by_one(KINDS["choices"])], ids=["batch", "alone"])
def test_masks_are_by_row(makers: list[Any]) -> None:
    venv, alone = TeamVecEnv(makers), parallel_env("paper-hw-2", actions="discrete", **SMALL)
    seeds = venv.seed(4)
    venv.reset()
    for k in range(2):
        alone.reset(seed=seeds[2 * k])
        np.testing.assert_array_equal(
            venv.env_method("action_masks")[2 * k : 2 * k + 2], alone.action_masks()
        )
    assert np.shape(venv.env_method("action_masks", indices=[3, 0, -1])) == (3, 34)


def test_worlds_are_asked_one_by_one() -> None:
    venv = TeamVecEnv(KINDS["two scenarios, in turn"])
    venv.seed(0)
    venv.reset()
    names = [scenario.name for scenario in venv.get_attr("scenario")[::2]]
    assert names == ["paper-sim-2", "paper-hw-2-obstacles"] * 2 + ["paper-sim-2"]
    ticks = venv.get_attr("tick", indices=[0, 2, 4])
    rows = np.asarray([tick.truth.poses[0, :2] for tick in ticks])
    assert len(np.unique(rows, axis=0)) == 3
    assert venv.env_is_wrapped(RendezvousEnv) == [True] * 10
    assert len(venv.env_method("state", indices=[1, 3])) == 2
    with pytest.raises(ValueError, match=r"method must be 'render' or one of .*, got 'close'"):
        venv.env_method("close")
    with pytest.raises(ValueError, match="indices must be of all worlds of 'paper-sim-2'"):
        venv.set_attr("colour", 1, indices=[0])
    venv.set_attr("colour", 1, indices=[0, 4, 8])
    assert venv.get_attr("colour", indices=[8]) == [1]
    assert not venv.has_attr("colour")
