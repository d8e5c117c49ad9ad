"""The network of interfaces that choose among directions, in torch: scorers of these, of stop and call.

`baselines.policies.learned.network.Network.scores` is the same in numpy.
"""

from collections.abc import Sequence
from typing import Any

import torch
from stable_baselines3.common.policies import ActorCriticPolicy
from torch import nn

from wifipgo.world.lidar import N_LIDAR_RAYS


class Tanh(nn.Module):
    """Hyperbolic tangent by way of the logistic function, which takes torch less than half the time."""

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Within 1e-7 of `torch.tanh`."""
        return torch.sigmoid(x + x).mul(2.0).sub(1.0)


def perceptron(n_in: int, hidden: Sequence[int], n_out: int | None) -> nn.Sequential:
    """Affine maps with tanh between them; without ``n_out`` it ends with a hidden layer."""
    layers: list[nn.Module] = []
    for n in hidden:
        layers += [nn.Linear(n_in, n), Tanh()]
        n_in = n
    return nn.Sequential(*layers, *([nn.Linear(n_in, n_out)] if n_out else []))


def split_of(shown: torch.Tensor, n_whole: int) -> tuple[torch.Tensor, torch.Tensor]:
    """Numbers of the robot, and those of each direction, (..., rays, numbers)."""
    directions = shown[..., n_whole:].reshape(*shown.shape[:-1], -1, N_LIDAR_RAYS)
    return shown[..., :n_whole], directions.transpose(-1, -2)


def pooled_of(whole: torch.Tensor, directions: torch.Tensor) -> torch.Tensor:
    """Numbers of the robot, then mean and largest of each number of the directions."""
    return torch.cat([whole, directions.mean(dim=-2), directions.amax(dim=-2)], dim=-1)


def scores_of(
    whole: torch.Tensor, directions: torch.Tensor, *, ray: nn.Module, rest: nn.Module
) -> torch.Tensor:
    """Scores of the directions, by one network for all, and of the stop, silence and the call."""
    for_each = whole.unsqueeze(-2).expand(*directions.shape[:-1], whole.shape[-1])
    rays = ray(torch.cat([directions, for_each], dim=-1)).squeeze(-1)
    return torch.cat([rays, rest(pooled_of(whole, directions))], dim=-1)


class RaysNets(nn.Module):
    """Scores of all choices, and what the value is read from."""

    latent_dim_pi = N_LIDAR_RAYS + 3

    def __init__(self, hidden: Sequence[int], n_whole: int, n_shown: int, n_critic: int) -> None:
        """Make the networks; small last layers begin with choices that are all alike.

        Args:
            hidden: Units of the hidden layers.
            n_whole: Numbers of the robot as a whole among what is shown; those of the directions follow.
            n_shown: Numbers that the robot is shown.
            n_critic: Numbers after these, which only the value is read from.
        """
        super().__init__()
        self.latent_dim_vf = hidden[-1]
        self._n_whole, self._n_shown = n_whole, n_shown
        n_direction = (n_shown - n_whole) // N_LIDAR_RAYS
        pooled = n_whole + 2 * n_direction
        self.ray = perceptron(n_direction + n_whole, hidden, 1)
        self.whole = perceptron(pooled, hidden, 3)
        self.value = perceptron(pooled + n_critic, hidden, None)
        for net in (self.ray, self.whole, self.value):
            for layer in net:
                if isinstance(layer, nn.Linear):
                    nn.init.orthogonal_(layer.weight, 2.0**0.5)
                    nn.init.zeros_(layer.bias)
        for last in (self.ray[-1], self.whole[-1]):
            nn.init.orthogonal_(last.weight, 0.01)  # type: ignore[arg-type]

    def forward(self, shown: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Both."""
        return self.forward_actor(shown), self.forward_critic(shown)

    def forward_actor(self, shown: torch.Tensor) -> torch.Tensor:
        """Scores of the directions, the stop, silence and the call."""
        return scores_of(*self._split(shown), ray=self.ray, rest=self.whole)

    def forward_critic(self, shown: torch.Tensor) -> torch.Tensor:
        """What the value is read from."""
        pooled = [pooled_of(*self._split(shown)), shown[:, self._n_shown :]]
        out: torch.Tensor = self.value(torch.cat(pooled, dim=1))
        return out

    def _split(self, shown: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        return split_of(shown[:, : self._n_shown], self._n_whole)


class RaysPolicy(ActorCriticPolicy):
    """Actor and critic of stable-baselines3 with these networks."""

    def __init__(
        self, *args: Any, n_whole: int, n_critic: int = 0, hidden: Sequence[int] = (64, 64), **kwargs: Any
    ) -> None:
        """Remember the sizes of the networks, as `RaysNets` takes them; the rest is stable-baselines3's."""
        self._hidden, self._n_whole, self._n_critic = tuple(hidden), n_whole, n_critic
        super().__init__(*args, **(kwargs | {"ortho_init": False}))

    def _build_mlp_extractor(self) -> None:
        n_shown = self.features_dim - self._n_critic
        nets = RaysNets(self._hidden, self._n_whole, n_shown, self._n_critic)
        self.mlp_extractor = nets  # type: ignore[assignment]

    def _build(self, lr_schedule: Any) -> None:
        """The scores are the logits: nothing comes after them."""
        super()._build(lr_schedule)
        self.action_net = nn.Identity()
        nn.init.orthogonal_(self.value_net.weight, 1.0)
        self.optimizer = self.optimizer_class(
            self.parameters(), **({"lr": lr_schedule(1)} | self.optimizer_kwargs)
        )


def actor_parameters(policy: ActorCriticPolicy) -> list[nn.Parameter]:
    """Parameters that only the choice of actions depends on."""
    critic = ("mlp_extractor.value", "value_net")
    return [p for name, p in policy.named_parameters() if not name.startswith(critic)]
