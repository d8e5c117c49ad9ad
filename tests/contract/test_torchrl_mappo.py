"""MAPPO of TorchRL: what it is shown, advantages by hand, the policy that an update is held to."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("torchrl", reason="not among the dependencies; see docs/frameworks.md")

import torch
from torchrl.envs.utils import check_env_specs

from baselines.policies import make_policy
from baselines.policies.learned.interfaces import DIRECTIONS, make_interface
from train.torchrl_env import RendezvousTorchEnv
from train.torchrl_lessons import Lesson, imitate
from train.torchrl_mappo import Mappo
from wifipgo.errors import BadInputError

SMALL: dict[str, Any] = {"scenario": "paper-sim-2", "num_envs": 3, "size_m": 4.0, "n_steps": 5}


def choosing(**changes: Any) -> RendezvousTorchEnv:
    return RendezvousTorchEnv(**SMALL | {"interface": "rays", "actions": "discrete", "seed": 2} | changes)


@pytest.mark.parametrize("interface", DIRECTIONS)
def test_what_is_shown_is_what_the_interface_makes_of_observations(interface: str) -> None:
    """In worlds that end apart: those that go on remember no step twice."""
    own: dict[str, Any] = {"max_measurements": 6, "n_steps": 9}
    env, whole = choosing(interface=interface, **own), choosing(interface=None, **own)
    torch.manual_seed(3)
    plain = whole.rollout(12, break_when_any_done=False)
    actions = iter(plain["robots", "action"].unbind(dim=1))
    shown = env.rollout(12, lambda td: td.set(("robots", "action"), next(actions)), break_when_any_done=False)
    translation, memory = make_interface(interface, env.worlds.scenario), None
    for t in range(12):
        rows, after = (
            each["robots", "observation"][:, t].flatten(0, 1).numpy() for each in (plain, plain["next"])
        )
        memory = translation.remembered(rows, memory)
        later = translation.shown(after, translation.remembered(after, memory))
        now, then = (each["robots", "observation"][:, t].flatten(0, 1) for each in (shown, shown["next"]))
        np.testing.assert_array_equal(now, translation.shown(rows, memory), f"step {t}")
        np.testing.assert_array_equal(then, later, f"after step {t}")
    ends = plain["next", "done"].sum(dim=0)
    assert ((ends > 0) & (ends < 3)).any()


def test_torchrl_accepts_what_is_shown() -> None:
    check_env_specs(choosing(interface="trail"))


@pytest.mark.parametrize("terminate_at_end", [True, False])
def test_advantages_are_those_of_a_sum_by_hand(terminate_at_end: bool) -> None:
    """Past the ends of episodes; one by the clock is either an end, or a cut with a value behind it."""
    torch.manual_seed(0)
    env, mappo = choosing(terminate_at_end=terminate_at_end), Mappo(gamma=0.9, lmbda=0.8, hidden=(8,))
    with torch.no_grad():
        rollout = env.rollout(8, mappo.policy, break_when_any_done=False)
    reward = rollout["next", "robots", "reward"].clone()
    rows = mappo.rows([rollout])["robots"]
    now, after = rollout["robots", "state_value"], rollout["next", "robots", "state_value"]
    advantage, follows = torch.zeros(3, 2, 1), torch.zeros(8, 3, 2, 1)
    for t in reversed(range(8)):
        alive = ~rollout["next", "done"][:, t, None]
        follows[t] = reward[:, t] + (0.9 * alive * follows[t + 1] if t < 7 else 0.0)
    by_hand = torch.zeros_like(now)
    for t in reversed(range(8)):
        told = rollout["next"][:, t]
        goes_on, has_value = (~told[flag][:, None] for flag in ("done", "terminated"))
        error = reward[:, t] / follows.std(correction=0) + 0.9 * has_value * after[:, t] - now[:, t]
        advantage = by_hand[:, t] = error + 0.9 * 0.8 * goes_on * advantage
    torch.testing.assert_close(rows["advantage"].reshape(3, 8, 2, 1), by_hand, atol=1e-5, rtol=1e-4)
    torch.testing.assert_close(rows["value_target"].reshape(3, 8, 2, 1), by_hand + now, atol=1e-5, rtol=1e-4)
    returns = follows.transpose(0, 1) / follows.std(correction=0)
    torch.testing.assert_close(rows["return"].reshape(3, 8, 2, 1), returns, atol=1e-5, rtol=1e-4)
    assert rollout["next", "done"].sum() == 3


def test_an_update_is_held_to_the_policy_that_it_begins_with() -> None:
    """Teams of two and four side by side; the normalisation has moved since they chose."""
    torch.manual_seed(0)
    mappo = Mappo("trail", hidden=(8,))
    envs = [choosing(interface="trail", n_robots=n_robots) for n_robots in (2, 4)]
    for parameter in mappo.loss.parameters():
        parameter.data.normal_(0.0, 0.3)
    with torch.no_grad():
        rollouts = [env.rollout(5, mappo.policy) for env in envs]
    rows = mappo.rows(rollouts)
    assert len(rows) == 3 * 5 * (2 + 4)
    losses = mappo.loss(rows)
    assert losses["max_ratio"].item() == pytest.approx(1.0, abs=1e-4)
    (losses["loss_objective"] + losses["loss_critic"] + losses["loss_entropy"]).backward()
    assert all(parameter.grad is not None for parameter in mappo.loss.parameters())
    assert {id(p) for p in mappo.actor.parameters()} < {id(p) for p in mappo.loss.parameters()}
    policy: Any = mappo.policy
    with torch.no_grad():
        drawn = {policy(rollouts[0].clone())["robots", "action"].sum().item() for _ in range(5)}
    assert len(drawn) > 1  # drawn, not the best each time


def test_critic_reads_what_is_true_of_robot_and_team() -> None:
    env, mappo = choosing(n_robots=3), Mappo(hidden=(8,))
    with torch.no_grad():
        rollout = env.rollout(4, mappo.policy)
    info = rollout["robots", "info"]
    team = mappo.rows([rollout])["robots", "team"].reshape(3, 4, 3, -1)
    mapped = info["mapped_share_truth"]
    torch.testing.assert_close(team[..., 0], mapped)
    torch.testing.assert_close(team[..., 5], mapped.mean(dim=-1, keepdim=True).expand_as(mapped))
    assert team[..., 3].std() > 0.0  # errors of the trajectory differ


def test_lessons_are_what_the_script_would_do_where_the_network_got() -> None:
    """Robots play on past an end; told by playing the script alone, on the same worlds, step by step."""
    torch.manual_seed(1)
    env, mappo = choosing(interface="trail"), Mappo("trail", hidden=(8,))
    driven = Lesson("team_plan", env, mappo)
    with torch.no_grad():
        alone = env.rollout(8, driven, break_when_any_done=False)
        driven.share = 0.0
        drifted = env.rollout(8, driven, break_when_any_done=False)
    assert alone["next", "done"].any()
    torch.testing.assert_close(alone["robots", "action"], alone["robots", "right"])
    assert (drifted["robots", "action"] != drifted["robots", "right"]).float().mean() > 0.3
    translation, script = (
        make_interface("trail", env.worlds.scenario),
        make_policy("team_plan", env.worlds.scenario),
    )
    again = choosing(interface=None)
    actions = iter(alone["robots", "action"].unbind(dim=1))
    seen = again.rollout(8, lambda td: td.set(("robots", "action"), next(actions)), break_when_any_done=False)
    script.reset_rows([0, 1, 2])
    for t in range(5):  # to the end of the first episode
        rows = seen["robots", "observation"][:, t].numpy()
        motion, call = translation.answers(script.act_rows(rows).reshape(-1, 3)).T
        np.testing.assert_array_equal(alone["robots", "right"][:, t].ravel(), motion + 17 * call)


def test_imitation_comes_to_choose_as_the_script() -> None:
    torch.manual_seed(0)
    env, mappo = choosing(interface="trail", num_envs=8, n_steps=10, size_m=8.0), Mappo("trail")

    def agreement() -> float:
        with torch.no_grad():
            played = env.rollout(10, Lesson("team_plan", env, mappo))
            best = mappo.actor(played["robots", "observation"]).argmax(dim=-1)
        return (best == played["robots", "right"]).float().mean().item()

    before = agreement()
    assert imitate(mappo, [env], ["team_plan"], rounds=2, epochs=20, batch_size=64) == 2 * 8 * 10 * 2
    assert agreement() > max(before + 0.2, 0.5)


def test_each_scenario_may_have_a_teacher_of_its_own() -> None:
    torch.manual_seed(0)
    own: dict[str, Any] = {"interface": "trail", "num_envs": 4}
    envs, mappo = [choosing(n_robots=n, **own) for n in (2, 3)], Mappo("trail", hidden=(8,))
    assert imitate(mappo, envs, ["team_plan", "frontier_home"], rounds=1, epochs=1) == 4 * 5 * (2 + 3)
    with pytest.raises(BadInputError, match="policies to imitate must be 1 or 2, got 3"):
        imitate(mappo, envs, ["team_plan"] * 3)


def test_a_training_goes_on_from_what_another_saved(tmp_path: Path) -> None:
    """Choices, values, normalisation, of returns too, are the same; what does not fit changes nothing."""
    torch.manual_seed(0)
    env, first, later = choosing(), Mappo(hidden=(8,)), Mappo(hidden=(8,))
    imitate(first, [env], ["team_plan"], rounds=1, epochs=2, batch_size=10)
    first.save(file := tmp_path / "mappo.npz")
    with torch.no_grad():
        played = env.rollout(4, first.policy)
    before = later.rows([played.clone()])["robots"]
    with pytest.raises(BadInputError, match=r"mappo\.npz: actor/ray\.0\.weight must be of shape"):
        Mappo(hidden=(9,)).load(file)
    with pytest.raises(BadInputError, match="must be with the arrays"):
        Mappo("trail", hidden=(8, 8)).load(file)
    arrays = dict(np.load(file))
    np.savez(broken := tmp_path / "broken.npz", **arrays | {"returns/mean": np.array([np.nan], np.float32)})
    with pytest.raises(BadInputError, match="returns/mean must be finite"):
        later.load(broken)
    later.load(file)
    again, expected = (each.rows([played.clone()])["robots"] for each in (later, first))
    for name in ("action_log_prob", "value_target", "advantage", "return"):
        torch.testing.assert_close(again[name], expected[name])
        assert not torch.allclose(before[name], expected[name])
