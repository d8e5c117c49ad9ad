"""What drives the teams of an evaluation: of a spec, an object, or a class or function of one's own."""

from collections.abc import Callable
from functools import partial
from typing import Any

from baselines.evaluation.recording import Now
from baselines.policies import POLICIES, Driver, Oracle, TeamsPolicy, drives_teams, make_policy
from baselines.policies.making import arguments
from baselines.policies.own_policy import Acts, Checked, own_policy
from baselines.policies.policy import EachAlone
from baselines.policies.specs import parse_spec
from envs.rendezvous_v0 import vector_env
from wifipgo.scenarios import Scenario

# A spec, what acts, or what makes it.
AnyPolicy = str | Acts | TeamsPolicy | Callable[..., Acts | TeamsPolicy]


def name_of(policy: AnyPolicy) -> str:
    """Label of a policy that was given none."""
    if isinstance(policy, str):
        return parse_spec(policy, POLICIES).label or policy
    return str(getattr(policy, "__name__", type(policy).__name__))


def driver_of(policy: AnyPolicy, scenario: Scenario, name: str) -> TeamsPolicy:
    """What drives the teams."""
    if isinstance(policy, str):
        return make_policy(policy, scenario, label=name)
    if is_made_anew(policy):
        maker: Any = policy
        return own_policy(partial(maker, **arguments(name, maker, {}, scenario)), name)
    return policy if drives_teams(policy) else EachAlone([Checked(policy, name)])


def is_made_anew(policy: AnyPolicy) -> bool:
    """Whether each world gets a policy of its own: of a spec, a class or a function, not of an object."""
    return isinstance(policy, str | type) or not hasattr(policy, "act")


def try_policy(scenario: Scenario, policy: Driver, seed: int) -> None:
    """Let a policy act once, at the start of a world.

    Raises:
        BadInputError: Actions that cannot be carried out, or a policy that raises.
    """
    env = vector_env(scenario, n_worlds=1)
    policy.reset_rows([seed])
    observations, _ = env.reset(seed=[seed])
    if isinstance(policy, Oracle):
        policy.see_truth(Now.of(env).true)
    policy.act_rows(observations)
