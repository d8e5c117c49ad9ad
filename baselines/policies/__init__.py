"""Scripted and learned policies and their registry. Each sees exactly what a learner sees."""

from baselines.policies.oracle import Oracle, OracleBearing
from baselines.policies.registry import POLICIES, make_policy
from baselines.policies.rendezvous import Actions, ActiveRendezvous, Observations, Policy, RandomRendezvous

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
