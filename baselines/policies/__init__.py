"""Scripted and learned policies and their registry. Each sees exactly what a learner sees."""

from baselines.policies.oracle import Oracle, OracleBearing
from baselines.policies.own_policy import Acts
from baselines.policies.policy import (
    Actions,
    Driver,
    DrivesTeams,
    Observations,
    Policy,
    TeamsPolicy,
    drives_teams,
    for_teams,
)
from baselines.policies.registry import POLICIES, make_policy
from baselines.policies.rendezvous import ActiveRendezvous, RandomRendezvous

__all__ = [
    "POLICIES",
    "Actions",
    "ActiveRendezvous",
    "Acts",
    "Driver",
    "DrivesTeams",
    "Observations",
    "Oracle",
    "OracleBearing",
    "Policy",
    "RandomRendezvous",
    "TeamsPolicy",
    "drives_teams",
    "for_teams",
    "make_policy",
]
