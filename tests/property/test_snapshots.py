"""Snapshots: what follows one is the same to the bit, in whatever order, process or number of times."""

import hashlib
import os
import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from envs.rendezvous_v0 import EpisodeSnapshot, RendezvousEnv, parallel_env

ROOM: dict[str, Any] = {
    "n_robots": 3,
    "n_slots": 2,
    "size_m": 4.5,
    "n_steps": 14,
    "kappa": 2,
    "n_obstacles": 1,
}
VARIANTS: dict[str, dict[str, Any]] = {
    "plain": {},
    "robust": {"outliers": "bearing", "outlier_share": 0.3, "packet_loss": 0.1},
    "every_step": {"estimator": "every_step", "aoa_factors": True},
    "distributed": {"backend": "distributed", "message_loss": 0.2},
}
TAKEN_AT = 6


def made(variant: str) -> RendezvousEnv:
    return parallel_env("paper-hw-2", **ROOM, **VARIANTS[variant])


def bits(value: Any) -> bytes:
    """What an env shows, to the bit; pickles of equal values may differ by what they share."""
    if isinstance(value, np.ndarray):
        return value.tobytes()
    if isinstance(value, dict):
        return b"".join(bits([key, inner]) for key, inner in value.items())
    return b"".join(map(bits, value)) if isinstance(value, list | tuple) else repr(value).encode()


def played(env: RendezvousEnv, actions: np.ndarray) -> list[bytes]:
    """All that the env shows while it lasts."""
    out = []
    for one in actions:
        if not env.agents:
            break
        step = env.step(dict(zip(env.agents, one, strict=True)))
        out.append(bits([*step, env.state()]))
        assert all(np.isfinite(row).all() for row in step[0].values())
    return out


def ways(seed: int) -> np.ndarray:
    actions = np.random.default_rng(seed).uniform(-1.0, 1.0, (14, 3, 3))
    actions[..., 2] = 1.0
    return actions


@pytest.mark.parametrize("variant", VARIANTS)
def test_what_follows_a_snapshot_repeats_to_the_bit(variant: str) -> None:
    """Undisturbed, after another branch, after another episode, and in another environment."""
    env = made(variant)
    env.reset(seed=4)
    first = played(env, ways(0)[:TAKEN_AT])
    snapshot = env.snapshot()
    expected = played(env, ways(0)[TAKEN_AT:])
    assert len(first) == TAKEN_AT
    assert len(expected) == 14 - TAKEN_AT
    assert not env.agents
    env.restore(snapshot)
    branch = played(env, ways(1)[TAKEN_AT:])
    assert branch != expected
    env.reset(seed=9)
    played(env, ways(2)[:3])
    env.restore(snapshot)
    assert played(env, ways(0)[TAKEN_AT:]) == expected
    other = made(variant)
    other.restore(pickle.loads(pickle.dumps(snapshot)))
    assert played(other, ways(1)[TAKEN_AT:]) == branch


def test_robots_met_before_and_after_the_snapshot() -> None:
    env = made("every_step")
    env.reset(seed=4)
    steps = [env.step(dict(zip(env.agents, one, strict=True)))[4] for one in ways(0)]
    met = [any(info["met"].any() for info in infos.values()) for infos in steps]
    assert any(met[:TAKEN_AT])
    assert any(met[TAKEN_AT:])


def test_restoring_shows_what_was_shown() -> None:
    env = made("plain")
    env.reset(seed=1)
    observations, *_, infos = env.step(dict(zip(env.agents, ways(3)[0], strict=True)))
    snapshot = env.snapshot()
    env.step(dict(zip(env.agents, ways(3)[1], strict=True)))
    again, said = env.restore(snapshot)
    assert bits([again, said]) == bits([observations, infos])


def test_options_and_the_sequence_of_episodes_come_back() -> None:
    env = made("plain")
    env.reset(seed=2, options={"n_obstacles": 0})
    snapshot = env.snapshot()
    following = bits(env.reset())
    env.restore(snapshot)
    assert env.scenario.arena.n_obstacles == 0
    assert bits(env.reset()) == following


def test_a_snapshot_goes_on_in_another_process(tmp_path: Path) -> None:
    """Nothing of it hangs on this process: engines and solvers are made anew."""
    env = made("every_step")
    env.reset(seed=4)
    played(env, ways(0)[:TAKEN_AT])
    (tmp_path / "snapshot").write_bytes(pickle.dumps(env.snapshot()))
    expected = played(env, ways(0)[TAKEN_AT:])
    program = (
        "import hashlib, pickle, sys; from property.test_snapshots import *\n"
        "env = made('every_step'); env.restore(pickle.load(open(sys.argv[1], 'rb')))\n"
        f"print(hashlib.sha256(b''.join(played(env, ways(0)[{TAKEN_AT}:]))).hexdigest())"
    )
    paths = os.pathsep.join([str(Path(__file__).parents[1]), *sys.path])
    done = subprocess.run(
        [sys.executable, "-c", program, str(tmp_path / "snapshot")],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"PYTHONPATH": paths},
    )
    assert done.stdout.strip() == hashlib.sha256(b"".join(expected)).hexdigest()


def snapshot_of(scenario: str = "paper-hw-2", **overrides: Any) -> EpisodeSnapshot:
    env = parallel_env(scenario, **overrides)
    env.reset(seed=0)
    return env.snapshot()


@pytest.mark.parametrize(
    ("snapshot", "says"),
    [
        (lambda: 3, "snapshot must be .* got int"),
        (lambda: snapshot_of("paper-sim-2"), "snapshot.scenario.name must be that of the environment"),
        (lambda: snapshot_of(n_steps=7), "snapshot.scenario.n_steps must be .* 50, got 7"),
        (lambda: replace(snapshot_of(), format=0), "snapshot.format must be 2, that of this version, got 0"),
        (lambda: replace(snapshot_of(), blocks=(("own/err", 2),)), "snapshot.blocks must be"),
    ],
)
def test_a_snapshot_of_something_else_is_refused(snapshot: Any, says: str) -> None:
    env = parallel_env("paper-hw-2")
    env.reset(seed=0)
    before = env.state().tobytes()
    with pytest.raises(ValueError, match=says):
        env.restore(snapshot())
    assert env.state().tobytes() == before


def test_there_is_none_before_reset() -> None:
    with pytest.raises(RuntimeError, match="reset"):
        parallel_env("paper-hw-2").snapshot()
