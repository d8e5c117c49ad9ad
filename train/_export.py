"""A trained model as a small file that needs no torch: `baselines.policies.learned.network.Network`."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.vec_env import VecNormalize
from torch import nn

from baselines.policies.learned.interfaces import layout_read, make_interface
from baselines.policies.learned.network import Layer, Network, plain
from train._rays_policy import RaysNets
from wifipgo.scenarios import Scenario


def exported(
    policy: ActorCriticPolicy,
    norm: VecNormalize,
    scenario: Scenario,
    *,
    interface: str,
    origin: Mapping[str, Any],
) -> Network:
    """Weights of the actor and the statistics that its input is normalised by."""
    n_shown = make_interface(interface, scenario).n_shown
    mean, variance, clip = np.zeros(n_shown), np.ones(n_shown), np.inf
    if norm.norm_obs:
        found: Any = norm.obs_rms
        mean, variance, clip = found.mean[:n_shown].copy(), found.var[:n_shown].copy(), norm.clip_obs
    return Network(
        interface=interface,
        nets=_nets(policy),
        mean=mean.astype(np.float32),
        variance=variance.astype(np.float32),
        clip=float(min(clip, 1e9)),
        layout=layout_read(interface, scenario),
        scenario=plain(scenario),
        origin=dict(origin),
    )


def _nets(policy: ActorCriticPolicy) -> dict[str, list[Layer]]:
    nets: Any = policy.mlp_extractor
    if isinstance(nets, RaysNets):
        return {"ray": layers_of(nets.ray), "whole": layers_of(nets.whole)}
    return {"action": layers_of([*nets.policy_net, policy.action_net])}


def layers_of(net: Iterable[nn.Module]) -> list[Layer]:
    """Affine maps of a perceptron, in order."""
    maps = [module for module in net if isinstance(module, nn.Linear)]
    return [Layer(m.weight.detach().numpy().copy(), m.bias.detach().numpy().copy()) for m in maps]
