"""Networks of ``rays`` in plain torch: what is exported scores alike in numpy, and a team has no order."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch", reason="of the extra train")

import torch

from baselines.policies.learned.interfaces import DIRECTIONS, make_interface
from baselines.policies.learned.network import load_network
from baselines.policies.learned.policy import LearnedPolicy
from envs.directions import N_CHOICES, N_MOTIONS
from envs.rendezvous_v0 import vector_env
from train.rays_networks import RaysActor, RunningNorm, TeamCritic, network_of
from wifipgo.scenarios import scenario_named


def rows(*shape: int, seed: int = 0, interface: str = "rays") -> torch.Tensor:
    """Numbers far from the mean of 0 and the variance of 1."""
    n_shown = DIRECTIONS[interface].n_shown
    return 2.0 + 5.0 * torch.randn(*shape, n_shown, generator=torch.Generator().manual_seed(seed))


def actor_with_opinions(interface: str) -> RaysActor:
    torch.manual_seed(0)
    norm = RunningNorm(DIRECTIONS[interface].n_shown, clip=1.5)  # which some rows exceed
    norm.update(rows(40, seed=1, interface=interface))
    actor = RaysActor(interface, norm, hidden=(8, 8))
    with torch.no_grad():
        for parameter in actor.parameters():
            parameter.normal_(0.0, 0.3)
    return actor


@pytest.mark.parametrize("interface", DIRECTIONS)
def test_what_is_exported_scores_as_in_torch(interface: str, tmp_path: Path) -> None:
    actor, scenario = actor_with_opinions(interface), scenario_named("paper-sim-2")
    network_of(actor, scenario, {"seed": 0}).save(tmp_path / "policy.npz")
    shown = rows(30, interface=interface)
    scores = load_network(tmp_path / "policy.npz").scores(shown.numpy())
    choices = np.arange(N_CHOICES)
    sums = scores[:, choices % N_MOTIONS] + scores[:, N_MOTIONS + choices // N_MOTIONS]
    with torch.no_grad():
        np.testing.assert_allclose(actor(shown), sums, atol=1e-4)
        np.testing.assert_allclose(actor(shown.reshape(5, 3, 2, -1)).reshape(30, -1), sums, atol=1e-4)
    assert np.ptp(sums, axis=1).min() > 0.1
    assert LearnedPolicy(scenario, path=str(tmp_path)).remark == ""


def test_choices_of_the_environment_are_the_answers_of_rays() -> None:
    """All of them at once, a robot each, among obstacles: what comes of them is the same."""
    given = {"n_worlds": N_CHOICES // 2, "n_steps": 3}
    chosen = vector_env("paper-hw-2-obstacles", **given, actions="discrete")
    driven = vector_env("paper-hw-2-obstacles", **given)
    seen, _ = driven.reset(seed=3)
    np.testing.assert_array_equal(chosen.reset(seed=3)[0], seen)
    choices = np.arange(N_CHOICES)
    answers = np.stack([choices % N_MOTIONS, choices // N_MOTIONS], axis=1)
    commands = make_interface("rays", driven.scenario).commands(answers, seen.reshape(N_CHOICES, -1))
    after = driven.step(commands.reshape(-1, 2, 3))[0]
    np.testing.assert_array_equal(chosen.step(choices.reshape(-1, 2))[0], after)
    assert (after != seen).any()


def test_normalisation_is_by_all_rows_so_far() -> None:
    norm, parts = RunningNorm(213), [rows(7), rows(2, 3, seed=1) - 9.0, rows(1, seed=2)]
    for part in parts:
        norm.update(part)
    together = torch.cat([part.reshape(-1, 213) for part in parts]).double().numpy()
    np.testing.assert_allclose(norm.mean, together.mean(axis=0), rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(norm.variance, together.var(axis=0), rtol=1e-4)
    one = RunningNorm(213)
    one.update(torch.ones(1, 213))  # a single row has no variance
    assert torch.isfinite(one(rows(4))).all()


@pytest.mark.parametrize("n_robots", [1, 2, 5])
def test_a_team_has_no_order(n_robots: int) -> None:
    torch.manual_seed(0)
    critic, shown = TeamCritic(hidden=(8,), n_truth=2), rows(3, n_robots)
    truth = torch.rand(3, n_robots, 2)
    order = torch.arange(n_robots).roll(1)
    with torch.no_grad():
        values = critic(shown, critic.team(shown, truth))
        permuted = critic(shown[:, order], critic.team(shown[:, order], truth[:, order]))
        other = shown.clone()
        other[:, 0] = -other[:, 0]  # one robot sees something else
        changed = critic(other, critic.team(other, truth))
    assert values.shape == (3, n_robots, 1)
    torch.testing.assert_close(permuted, values[:, order])
    assert (changed != values).all()
    with torch.no_grad():
        lied_to = critic(shown, critic.team(shown, truth.flip(0)))
    assert (lied_to != values)[0].all()
