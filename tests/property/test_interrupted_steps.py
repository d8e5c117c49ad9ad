"""A step that an exception leaves never was: taken again, it and all that follow are as if undisturbed."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

import numpy as np
import pytest

import envs._episode
import envs._playing
import envs._rendezvous
from envs._episode import Episode
from envs.rendezvous_v0 import RendezvousEnv, parallel_env
from wifipgo.graph.per_robot_smoothing import PerRobotSmoothers
from wifipgo.loop import iteration
from wifipgo.scenarios import scenario_named
from wifipgo.state import Commands
from wifipgo.world.arena import Arena

CROWD: dict[str, Any] = {"n_robots": 3, "n_slots": 2, "size_m": 5.0, "n_steps": 7, "kappa": 2, "step_m": 1.0}
VARIANTS: dict[str, dict[str, Any]] = {
    "gated": {"outliers": "paper", "outlier_share": 0.3, "packet_loss": 0.1},
    "every_step": {"estimator": "every_step", "aoa_factors": True},
    "distributed": {"backend": "distributed", "message_loss": 0.2},
}
# Iterations whose step is tried in vain, once for each stage: robots that met are among the last.
TRIED = (1, 5)
LOOP = (
    *("place_calls", "drive", "dead_reckon", "probe_links", "listen_to_team", "measure_relative_poses"),
    *("log_measurements", "exchange", "solve_at_every_step", "sense", "residual_error"),
    "propagate_uncertainty",
)
STAGES: list[tuple[Any, str]] = [
    *((iteration, name) for name in LOOP),
    (envs._episode, "_updated_map"),
    (envs._playing, "Outcome"),
    (Arena, "drive"),
    (RendezvousEnv, "_seen_and_said"),
    (envs._rendezvous, "infos_by_agent"),
]


def made(variant: str) -> RendezvousEnv:
    return parallel_env("paper-sim-2", **CROWD, **VARIANTS[variant])


def bits(value: Any) -> bytes:
    """What a step returns, to the bit."""
    if isinstance(value, np.ndarray):
        return value.tobytes()
    if isinstance(value, dict):
        return b"".join(bits([key, inner]) for key, inner in value.items())
    return b"".join(map(bits, value)) if isinstance(value, list | tuple) else repr(value).encode()


def stands(env: RendezvousEnv) -> bytes:
    return bits([*env.tick.truth[:3], *env.tick.belief[:2], env.state(), env.agents])


def played(env: RendezvousEnv, failures: list[Any]) -> list[bytes]:
    """All that an episode shows; some steps fail in every way that is asked for before they are taken."""
    rng, out = np.random.default_rng(7), [bits(env.reset(seed=11))]
    while env.agents:
        actions = {agent: rng.uniform(-1.0, 1.0, 3) for agent in env.agents}
        before = stands(env)
        for failure in failures if env.tick.belief.t in TRIED else []:
            with pytest.raises((RuntimeError, KeyboardInterrupt)), failure():
                env.step(actions)
            assert stands(env) == before
        out.append(bits(env.step(actions)))
    return out


@contextmanager
def broken(owner: Any, name: str) -> Iterator[None]:
    """A stage that fails when its work is done."""
    real = getattr(owner, name)

    def failing(*args: Any, **kwargs: Any) -> None:
        real(*args, **kwargs)
        raise RuntimeError(name)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(owner, name, failing)
        yield


@contextmanager
def stopped_at(n_calls: int) -> Iterator[None]:
    """Ctrl-C when the n-th function of this project is called."""
    left = n_calls

    def seen(frame: FrameType, event: str, arg: Any) -> None:
        nonlocal left
        left -= event == "call" and "/tests/" not in frame.f_code.co_filename
        if left == 0:
            sys.setprofile(None)
            raise KeyboardInterrupt

    sys.setprofile(seen)
    try:
        yield
    finally:
        sys.setprofile(None)


@pytest.mark.parametrize("variant", ["gated", "every_step"])
def test_a_step_that_fails_at_any_stage_can_be_taken_again(variant: str) -> None:
    """The draws of chance, the engine's contacts and the warm solvers are those of before."""
    stages = [*STAGES, (PerRobotSmoothers, "smoothed")] if variant == "every_step" else STAGES
    failures = [lambda stage=stage: broken(*stage) for stage in stages]
    assert played(made(variant), failures) == played(made(variant), [])


@pytest.mark.parametrize("variant", ["gated", "every_step"])
def test_ctrl_c_anywhere_in_a_step_leaves_the_episode_before(variant: str) -> None:
    """A step makes some thousand calls; the interruption comes at one that nobody chose."""
    calls = np.geomspace(1, 400, 8).astype(int).tolist()
    assert played(made(variant), [lambda n=n: stopped_at(n) for n in calls]) == played(made(variant), [])


def test_a_reset_that_fails_leaves_the_episode_before() -> None:
    """The episode goes on, and the next reset is the one that would have come."""
    env, undisturbed = made("gated"), made("gated")
    for one in (env, undisturbed):
        one.reset(seed=3)
    for stage in [
        (iteration, "sense"),
        (RendezvousEnv, "_seen_and_said"),
        (envs._rendezvous, "infos_by_agent"),
    ]:
        with pytest.raises(RuntimeError), broken(*stage):
            env.reset(seed=4)
        with pytest.raises(RuntimeError), broken(*stage):
            env.reset()
    actions = {agent: np.array([0.3, -0.2, 1.0]) for agent in env.agents}
    assert bits(env.step(actions)) == bits(undisturbed.step(actions))
    assert bits(env.reset()) == bits(undisturbed.reset())


@pytest.mark.parametrize("variant", VARIANTS)
def test_one_episode_advanced_twice_gives_one_answer(variant: str) -> None:
    """Looking ahead changes nothing: an episode is a value."""
    scenario = scenario_named("paper-sim-2", **CROWD, **VARIANTS[variant])
    rng = np.random.default_rng(2)
    ways = [Commands(rng.uniform(-1.0, 1.0, (3, 2)), np.ones(3, dtype=bool)) for _ in range(4)]
    ahead = [Episode.begun(scenario, [(5, 0)])]
    for way in ways:
        ahead.append(ahead[-1].advanced(way))
    for now, way, after in zip(ahead[:-1], ways, ahead[1:], strict=True):
        again = now.advanced(way)
        assert bits([*again.tick.truth[:3], *again.tick.belief[:3]]) == bits(
            [*after.tick.truth[:3], *after.tick.belief[:3]]
        )
