"""Scripted policies and their registry. Each sees exactly what a learner sees; an oracle's name says so."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from baselines import _strategies
from baselines._learned import LearnedPolicy
from baselines._oracle import Oracle, OracleBearing
from baselines._specs import fitting, parameters_of, split_spec
from baselines._team import Actions, ActiveRendezvous, Observations, Policy, RandomRendezvous
from wifipgo.errors import pick
from wifipgo.scenarios import Scenario

__all__ = [
    "POLICIES",
    "Actions",
    "ActiveRendezvous",
    "Observations",
    "Oracle",
    "OracleBearing",
    "Policy",
    "RandomRendezvous",
    "make_policy",
]

POLICIES: Mapping[str, Callable[..., Policy]] = MappingProxyType(
    {
        "active": ActiveRendezvous,
        "convoy": _strategies.convoy,
        "covariance": _strategies.covariance,
        "fixed_point": _strategies.fixed_point,
        "frontier": _strategies.frontier,
        "frontier_active": _strategies.frontier_active,
        "frontier_home": _strategies.frontier_home,
        "leapfrog": _strategies.leapfrog,
        "oracle_bearing": OracleBearing,
        "periodic": _strategies.periodic,
        "persistent": _strategies.persistent,
        "persistent_active": _strategies.persistent_active,
        "ppo": LearnedPolicy,
        "random": RandomRendezvous,
        "vision": _strategies.vision,
    }
)


def make_policy(spec: str, scenario: Scenario, **parameters: Any) -> Policy:
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
