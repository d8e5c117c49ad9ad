"""Networks that choose among directions, for learners that take torch modules: actor, critic, export.

The actor scores directions as `train.ppo` has it, so what it learns is played by ``ppo:path=FILE``, in numpy.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from torch import nn

from baselines.policies.learned.interfaces import DIRECTIONS, layout_read
from baselines.policies.learned.network import Network, plain
from envs.directions import N_MOTIONS
from train._export import layers_of
from train._rays_policy import perceptron, pooled_of, scores_of, split_of
from wifipgo.errors import pick
from wifipgo.scenarios import Scenario
from wifipgo.world.lidar import N_LIDAR_RAYS

__all__ = ["RaysActor", "RunningNorm", "TeamCritic", "network_of"]


class RunningNorm(nn.Module):
    """By mean and variance of all rows that it was given; of none, as it is.

    Attributes:
        clip: Largest normalised number.
    """

    mean: torch.Tensor
    variance: torch.Tensor
    count: torch.Tensor

    def __init__(self, n_numbers: int, *, clip: float = 10.0) -> None:
        """Begin with no rows."""
        super().__init__()
        self.clip = clip
        self.register_buffer("mean", torch.zeros(n_numbers))
        self.register_buffer("variance", torch.ones(n_numbers))
        self.register_buffer("count", torch.zeros(()))

    @torch.no_grad()
    def update(self, rows: torch.Tensor) -> None:
        """Take more rows into account, (..., numbers)."""
        rows = rows.reshape(-1, rows.shape[-1])
        total = self.count + len(rows)
        share, mean = len(rows) / total, rows.mean(dim=0)
        between = share * (1.0 - share) * (mean - self.mean).square()
        variance = (1.0 - share) * self.variance + share * rows.var(dim=0, correction=0) + between
        self.mean.lerp_(mean, share)
        self.variance.copy_(variance)
        self.count.copy_(total)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Normalised, (..., numbers)."""
        return ((x - self.mean) / (self.variance + 1e-8).sqrt()).clamp(-self.clip, self.clip)


class _OfRays(nn.Module):
    """What actor and critic have in common: how numbers of directions are told from those of the robot.

    Attributes:
        interface: Name in `baselines.policies.learned.interfaces.DIRECTIONS`.
        norm: Of what is shown; actor and critic may share it.
        n_pooled: Numbers of the robot as a whole, then mean and largest of each number of the directions.
    """

    def __init__(self, interface: str, norm: RunningNorm | None = None) -> None:
        """Look up the sizes."""
        super().__init__()
        kind = pick(DIRECTIONS, interface, "interface")
        self.interface, self.n_whole = interface, kind.n_whole
        self.n_direction = (kind.n_shown - kind.n_whole) // N_LIDAR_RAYS
        self.n_pooled = self.n_whole + 2 * self.n_direction
        self.norm = norm or RunningNorm(kind.n_shown)

    def _split(self, shown: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Normalised numbers of the robot, and those of each direction, (..., rays, numbers)."""
        return split_of(self.norm(shown), self.n_whole)


class RaysActor(_OfRays):
    """Logits of the choices of `envs.directions`, for rows of any shape; all robots share it.

    Args:
        interface: By which robots are shown what they see.
        norm: Of what is shown; without one, a new one.
        hidden: Units of the hidden layers.
    """

    def __init__(
        self, interface: str = "rays", norm: RunningNorm | None = None, hidden: Sequence[int] = (64, 64)
    ) -> None:
        """Make the networks; small last layers begin with choices that are all alike."""
        super().__init__(interface, norm)
        self.ray = _begun(perceptron(self.n_direction + self.n_whole, hidden, 1), 0.01)
        self.whole = _begun(perceptron(self.n_pooled, hidden, 3), 0.01)

    def forward(self, shown: torch.Tensor) -> torch.Tensor:
        """Of a motion and a call the sum of their scores: both are drawn apart, (..., 34)."""
        scores = scores_of(*self._split(shown), ray=self.ray, rest=self.whole)
        motions, calls = scores[..., :N_MOTIONS], scores[..., N_MOTIONS:]
        return (calls.unsqueeze(-1) + motions.unsqueeze(-2)).flatten(-2)


class TeamCritic(_OfRays):
    """Value of a robot's situation from what it is shown and the mean over its team: any number of robots.

    Args:
        interface: By which robots are shown what they see.
        norm: Of what is shown; without one, a new one.
        hidden: Units of the hidden layers.
        n_truth: Numbers that are true of a robot and that it is not shown.
    """

    def __init__(
        self,
        interface: str = "rays",
        norm: RunningNorm | None = None,
        hidden: Sequence[int] = (64, 64),
        *,
        n_truth: int = 0,
    ) -> None:
        """Make the network."""
        super().__init__(interface, norm)
        self.value = _begun(perceptron(2 * (self.n_pooled + n_truth), hidden, 1), 1.0)

    def team(self, shown: torch.Tensor, truth: torch.Tensor) -> torch.Tensor:
        """What is true of a robot, and the mean over the robots: (..., robots, n_pooled + 2 n_truth).

        Nothing in it is learned.
        """
        seen = torch.cat([truth, pooled_of(*self._split(shown))], dim=-1)
        return torch.cat([truth, seen.mean(dim=-2, keepdim=True).expand_as(seen)], dim=-1)

    def forward(self, shown: torch.Tensor, team: torch.Tensor) -> torch.Tensor:
        """Value, (..., 1)."""
        out: torch.Tensor = self.value(torch.cat([pooled_of(*self._split(shown)), team], dim=-1))
        return out


def network_of(actor: RaysActor, scenario: Scenario, origin: Mapping[str, Any]) -> Network:
    """What a robot needs to run an actor: ``network_of(...).save(path)``, then ``ppo:path=...``.

    Args:
        actor: Trained.
        scenario: That it was trained on.
        origin: Command, seed, settings: where it comes from, for whoever finds the file.
    """
    norm = actor.norm
    mean, variance = (x.numpy().astype(np.float32) for x in (norm.mean, norm.variance))
    return Network(
        interface=actor.interface,
        nets={"ray": layers_of(actor.ray), "whole": layers_of(actor.whole)},
        mean=mean,
        variance=variance,
        clip=norm.clip,
        layout=layout_read(actor.interface, scenario),
        scenario=plain(scenario),
        origin=dict(origin),
    )


def _begun(net: nn.Sequential, last: float) -> nn.Sequential:
    """Weights to begin with: orthogonal, the last layer's of this size."""
    maps = [layer for layer in net if isinstance(layer, nn.Linear)]
    for layer in maps:
        nn.init.orthogonal_(layer.weight, last if layer is maps[-1] else 2.0**0.5)
        nn.init.zeros_(layer.bias)
    return net
