"""The network of the interface ``rays`` in torch: a scorer of directions, one of stopping and calling.

`baselines.policies.learned.network.Network.scores` is the same in numpy.
"""

from collections.abc import Sequence
from typing import Any

import torch
from stable_baselines3.common.policies import ActorCriticPolicy
from torch import nn

from baselines.policies.learned.ray_interface import N_DIRECTION, N_WHOLE
from wifipgo.world.lidar import N_LIDAR_RAYS

_POOLED = N_WHOLE + 2 * N_DIRECTION


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


class RaysNets(nn.Module):
    """Scores of all choices, and what the value is read from."""

    latent_dim_pi = N_LIDAR_RAYS + 3

    def __init__(self, hidden: Sequence[int]) -> None:
        """Make the networks; small last layers begin with choices that are all alike."""
        super().__init__()
        self.latent_dim_vf = hidden[-1]
        self.ray = perceptron(N_DIRECTION + N_WHOLE, hidden, 1)
        self.whole = perceptron(_POOLED, hidden, 3)
        self.value = perceptron(_POOLED, hidden, None)
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
        whole, directions = _split(shown)
        each = torch.cat([directions, whole[:, None].expand(-1, N_LIDAR_RAYS, -1)], dim=2)
        return torch.cat([self.ray(each)[..., 0], self.whole(_pooled(whole, directions))], dim=1)

    def forward_critic(self, shown: torch.Tensor) -> torch.Tensor:
        """What the value is read from."""
        out: torch.Tensor = self.value(_pooled(*_split(shown)))
        return out


class RaysPolicy(ActorCriticPolicy):
    """Actor and critic of stable-baselines3 with these networks."""

    def __init__(self, *args: Any, hidden: Sequence[int] = (64, 64), **kwargs: Any) -> None:
        """Remember the hidden layers; the rest is stable-baselines3's."""
        self._hidden = tuple(hidden)
        super().__init__(*args, **(kwargs | {"ortho_init": False}))

    def _build_mlp_extractor(self) -> None:
        self.mlp_extractor = RaysNets(self._hidden)  # type: ignore[assignment]

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


def _split(shown: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    directions = shown[:, N_WHOLE:].reshape(len(shown), N_DIRECTION, N_LIDAR_RAYS)
    return shown[:, :N_WHOLE], directions.transpose(1, 2)


def _pooled(whole: torch.Tensor, directions: torch.Tensor) -> torch.Tensor:
    return torch.cat([whole, directions.mean(dim=1), directions.amax(dim=1)], dim=1)
