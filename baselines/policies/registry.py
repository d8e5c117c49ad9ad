"""Scripted policies and their registry. Each sees exactly what a learner sees; an oracle's name says so."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from baselines.policies import scripted, team_rules
from baselines.policies.learned.policy import LearnedPolicy
from baselines.policies.oracle import OracleBearing
from baselines.policies.policy import DrivesTeams
from baselines.policies.rendezvous import ActiveRendezvous, RandomRendezvous
from baselines.policies.specs import fitting, parameters_of, split_spec
from wifipgo.errors import pick
from wifipgo.scenarios import Scenario

POLICIES: Mapping[str, Callable[..., DrivesTeams]] = MappingProxyType(
    {
        "active": ActiveRendezvous,
        "both_drive": team_rules.both_drive,
        "convoy": scripted.convoy,
        "covariance": scripted.covariance,
        "fixed_point": scripted.fixed_point,
        "frontier": scripted.frontier,
        "frontier_active": scripted.frontier_active,
        "frontier_home": scripted.frontier_home,
        "leapfrog": scripted.leapfrog,
        "mesh": team_rules.mesh,
        "oracle_bearing": OracleBearing,
        "periodic": scripted.periodic,
        "persistent": scripted.persistent,
        "persistent_active": scripted.persistent_active,
        "ppo": LearnedPolicy,
        "random": RandomRendezvous,
        "team_plan": team_rules.team_plan,
        "turns": team_rules.turns,
        "vision": scripted.vision,
        "voronoi": team_rules.voronoi,
    }
)


def make_policy(spec: str, scenario: Scenario, **parameters: Any) -> DrivesTeams:
    """Build a policy from its name, with parameters if any: ``active:err_threshold=0.5``.

    Args:
        spec: ``name`` or ``name:key=value:key=value``.
        scenario: Gives the layout of the observations.
        parameters: More parameters of the policy; they win over those in ``spec``.

    Raises:
        ValueError: Unknown policy or parameter; the message lists what exists.
    """
    name, own = split_spec(spec)
    policy = pick(POLICIES, name, "policy")
    return policy(scenario, **fitting(name, own | parameters, parameters_of(policy)))
