"""Policies by name, and those of the user's own. Each sees what a learner sees; an oracle's name says so."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from hashlib import sha256
from pathlib import Path
from types import MappingProxyType
from typing import Any

from baselines.policies import scripted, team_rules
from baselines.policies.degraded_bearing import NoisyBearing
from baselines.policies.learned.policy import LearnedPolicy
from baselines.policies.learned.run_files import network_file
from baselines.policies.making import arguments
from baselines.policies.oracle import OracleBearing
from baselines.policies.own_policy import own_policy
from baselines.policies.own_source import own_digest, own_maker
from baselines.policies.policy import Driver, DrivesTeams
from baselines.policies.rendezvous import ActiveRendezvous, RandomRendezvous
from baselines.policies.signal_strength import Climb, PingRanging
from baselines.policies.specs import Spec, parse_spec, placed, split_list, with_labels
from baselines.policies.wiser_x import wiser_x
from wifipgo.errors import pick
from wifipgo.scenarios import Scenario

POLICIES: Mapping[str, Callable[..., DrivesTeams]] = MappingProxyType(
    {
        "active": ActiveRendezvous,
        "both_drive": team_rules.both_drive,
        "climb": Climb,
        "convoy": scripted.convoy,
        "covariance": scripted.covariance,
        "fixed_point": scripted.fixed_point,
        "frontier": scripted.frontier,
        "frontier_active": scripted.frontier_active,
        "frontier_home": scripted.frontier_home,
        "leapfrog": scripted.leapfrog,
        "mesh": team_rules.mesh,
        "noisy_bearing": NoisyBearing,
        "oracle_bearing": OracleBearing,
        "periodic": scripted.periodic,
        "persistent": scripted.persistent,
        "persistent_active": scripted.persistent_active,
        "ping_ranging": PingRanging,
        "ppo": LearnedPolicy,
        "random": RandomRendezvous,
        "team_plan": team_rules.team_plan,
        "turns": team_rules.turns,
        "vision": scripted.vision,
        "voronoi": team_rules.voronoi,
        "wiser_x": wiser_x,
    }
)


def make_policy(spec: str, scenario: Scenario, *, label: str = "", **parameters: Any) -> Driver:
    """Build a policy from its name or its place, with parameters if any: ``active:err_threshold=0.5``.

    Args:
        spec: As `baselines.policies.specs` has it: ``name:key=value``, ``my.module:Policy``,
            ``path/file.py:Policy``, each after ``label=`` or not.
        scenario: Gives the layout of the observations.
        label: What messages call a policy of the user's own; without one that of the spec.
        parameters: More parameters of the policy; they win over those in ``spec``.

    Raises:
        ValueError: Unknown policy or parameter (the message lists what exists), or one that cannot be made.
        OwnPolicyError: Code of the user's own raised.
    """
    found = parse_spec(spec, POLICIES)
    given = found.parameters | parameters
    if not found.where:
        policy = pick(POLICIES, found.name, "policy")
        made = policy(**arguments(found.name, policy, given, scenario))
        made.spec = ":".join([found.name, *(f"{key}={value}" for key, value in given.items())])
        return made
    maker = own_maker(found)
    keywords = arguments(f"{found.where}:{found.name}", maker, given, scenario)
    return own_policy(partial(maker, **keywords), label or found.label or found.short(1))


def specs_of(policies: str | Sequence[str]) -> tuple[Spec, ...]:
    """Policies of a list as text, or of several texts: all labelled, their files by absolute paths.

    Raises:
        BadInputError: A label twice.
    """
    texts = split_list(policies, POLICIES) if isinstance(policies, str) else policies
    return with_labels([placed(parse_spec(text, POLICIES)) for text in texts])


def recorded_specs(texts: Sequence[str]) -> tuple[Spec, ...]:
    """Specs of a record, whose labels are those of its tables: the whole text where none stands there."""
    found = [(text, parse_spec(text, POLICIES)) for text in texts]
    return tuple(spec._replace(label=spec.label or text) for text, spec in found)


def remarks(specs: Sequence[Spec], scenario: Scenario) -> list[str]:
    """What is to be said of policies before they play: those that were trained on something else."""
    made = {spec.label: make_policy(str(spec), scenario, label=spec.label) for spec in specs}
    said = {label: getattr(policy, "remark", "") for label, policy in made.items()}
    return [f"{label} {remark}" for label, remark in said.items() if remark]


def source_digest(spec: Spec) -> str:
    """Digest of what a policy is made of beyond this package: its code or its network; empty if it is ours.

    Raises:
        BadInputError: It is not there.
        OSError: It cannot be read.
    """
    if spec.where:
        return own_digest(spec)
    path, which = (str(spec.parameters.get(name, "")) for name in ("path", "checkpoint"))
    if not path:
        return ""
    return sha256(network_file(Path(path), which or "best").read_bytes()).hexdigest()[:16]
