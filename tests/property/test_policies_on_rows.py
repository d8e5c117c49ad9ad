"""A policy that drives the teams of many worlds drives each as it would drive that team alone, to the bit."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from baselines.policies import (
    POLICIES,
    ActiveRendezvous,
    DrivesTeams,
    Oracle,
    drives_teams,
    for_teams,
    make_policy,
)
from baselines.policies.policy import EachAlone
from envs.rendezvous_v0 import layout
from wifipgo.errors import BadInputError
from wifipgo.scenarios import Scenario, scenario_named

SPECS = (*POLICIES, "frontier_home:nearest=True", "ppo:sample=True", "leapfrog:period=2")
TEAMS = {
    "two": scenario_named("paper-sim-2"),
    "five": scenario_named("paper-sim-2", n_robots=5, n_slots=3),
}
WORLDS, STEPS = 4, 12
# Worlds that begin anew in each step, beside the first.
BEGIN = {0: (0, 1, 2, 3), 3: (1,), 4: (0, 2), 9: (2,)}


def seen(scenario: Scenario, n_steps: int, n_worlds: int) -> np.ndarray:
    """Anything that fits the layout, a third of it zeros; small errors, so that some robots are lost only."""
    rng, fields = np.random.default_rng(5), layout(scenario)
    low, high = (
        np.concatenate([np.full(f.size, getattr(f, end)) for f in fields]) for end in ("low", "high")
    )
    for field in fields:
        if field.name.endswith("err"):
            high[field.where] = 2.0
    shape = (n_steps, n_worlds, scenario.n_robots, len(low))
    rows = rng.uniform(low, high, shape) * (rng.random(shape) < 0.67)
    for field in fields:
        if field.unit == "0 or 1":
            rows[..., field.where] = rows[..., field.where] > 0.5
    return rows.astype(np.float32)


def alone(
    spec: str, scenario: Scenario, rows: np.ndarray, poses: np.ndarray, begins: Mapping[int, int]
) -> Any:
    """Actions of one team; ``begins`` has the seed with which an episode begins in a step."""
    policy, out = make_policy(spec, scenario), []
    for step, (team, truth) in enumerate(zip(rows, poses, strict=True)):
        if step in begins:
            policy.reset(begins[step], step)
        if isinstance(policy, Oracle):
            policy.see_truth(truth)
        actions = policy.act({f"robot_{i}": row for i, row in enumerate(team)})
        out.append(np.stack(list(actions.values())))
    return np.stack(out)


@pytest.mark.parametrize("size", TEAMS)
@pytest.mark.parametrize("spec", SPECS)
def test_worlds_of_any_age_are_driven_as_if_alone(spec: str, size: str) -> None:
    scenario = TEAMS[size]
    rows = seen(scenario, STEPS, WORLDS)
    poses = np.random.default_rng(6).uniform(0.0, 9.0, (STEPS, WORLDS, scenario.n_robots, 3))
    policy, together = make_policy(spec, scenario), []
    for step in range(STEPS):
        if step in BEGIN:
            mask = np.isin(np.arange(WORLDS), BEGIN[step])
            policy.reset_rows(range(WORLDS), [step] * WORLDS, mask=mask)
        if isinstance(policy, Oracle):
            policy.see_truth(poses[step])
        together.append(policy.act_rows(rows[step]))
    for world in range(WORLDS):
        begins = {step: world for step, worlds in BEGIN.items() if world in worlds}
        expected = alone(spec, scenario, rows[:, world], poses[:, world], begins)
        np.testing.assert_array_equal(np.stack(together)[:, world], expected)
        assert expected.dtype == together[0].dtype == np.float32


class OneTeam:
    """A policy of somebody's own, which knows one team and says how often it was asked."""

    def __init__(self) -> None:
        """Nobody asked yet."""
        self.seed, self.asked = -1, 0

    def reset(self, seed: int, episode: int = 0) -> None:
        """Count from here."""
        self.seed, self.asked = seed + 100 * episode, 0

    def act(self, observations: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """The seed and what is seen first."""
        self.asked += 1
        return {name: np.full(3, self.seed + row[0], np.float32) for name, row in observations.items()}


def test_policies_of_one_team_drive_many_in_a_loop() -> None:
    teams = EachAlone([OneTeam() for _ in range(3)])
    teams.reset_rows([5, 6, 7])
    teams.reset_rows([5, 6, 7], [0, 1, 0], mask=np.array([False, True, False]))
    actions = teams.act_rows(np.full((3, 2, 4), 0.5))
    np.testing.assert_array_equal(actions[..., 0], [[5.5, 5.5], [106.5, 106.5], [7.5, 7.5]])
    assert isinstance(for_teams(OneTeam()), EachAlone)
    policy = make_policy("random", TEAMS["two"])
    assert for_teams(policy) is policy


class Shy(ActiveRendezvous):
    """One that changes what it does with a team: that is what counts, and it knows no other way."""

    def act(self, observations: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Nobody calls."""
        return {name: action * [1, 1, 0] for name, action in super().act(observations).items()}


def test_a_changed_act_counts() -> None:
    policy = Shy(TEAMS["two"])
    assert not drives_teams(policy)
    rows = seen(TEAMS["two"], 1, 1)[0]
    assert make_policy("active", TEAMS["two"]).act_rows(rows)[..., 2].any()
    assert not for_teams(policy).act_rows(rows)[..., 2].any()


def test_what_does_not_fit_is_refused() -> None:
    policy = make_policy("active", TEAMS["two"])
    assert isinstance(policy, DrivesTeams)
    policy.reset_rows([1, 2])
    rows = seen(TEAMS["two"], 1, 3)[0]
    with pytest.raises(
        BadInputError, match="worlds of the observations must be 2, as reset_rows was told, got 3"
    ):
        policy.act_rows(rows)
    with pytest.raises(BadInputError, match="numbers of the scenario"):
        policy.act_rows(rows[:2, :, 1:])
    with pytest.raises(BadInputError, match="seeds must be of the 2 worlds that go on, got 3"):
        policy.reset_rows([1, 2, 3], mask=np.array([True, False, True]))
    with pytest.raises(BadInputError, match="mask must be a bool for each of 2 seeds"):
        policy.reset_rows([1, 2], mask=np.array([True]))
