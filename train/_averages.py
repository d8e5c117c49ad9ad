"""The average of a policy over its training: what is judged and shipped, while the policy itself learns on.

Updates of PPO are noisy, and a policy goes around what it closes in on; the mean of where it has been is
nearer to that than where it is (Polyak and Juditsky 1992; Izmailov et al. 2018 for networks). Later updates
count more, by a power of their number (Shamir and Zhang 2013), so early ones are forgotten at any length.
"""

from collections.abc import Mapping
from functools import partial

import numpy as np
import torch
from stable_baselines3.common.policies import ActorCriticPolicy
from torch.optim.swa_utils import AveragedModel

from train._alike import require_alike
from wifipgo.errors import require

AVERAGE = "average/"
_UPDATES = f"{AVERAGE}updates"


class PolicyAverage:
    """Average of a policy's weights over updates.

    Args:
        policy: That learns.
        mean_age: Of the weights in the average, as a share of the updates so far; 0: no average, the policy
            as it is.
    """

    def __init__(self, policy: ActorCriticPolicy, mean_age: float) -> None:
        """Nothing is averaged yet."""
        self._policy = policy
        self._average: AveragedModel | None = None
        if mean_age:
            self._average = AveragedModel(policy, avg_fn=partial(_averaged, exponent=1.0 / mean_age - 2.0))

    def update(self) -> None:
        """Let the policy as it is now count."""
        if self._average is not None:
            self._average.update_parameters(self._policy)

    @property
    def policy(self) -> ActorCriticPolicy:
        """The average; the policy itself where there is none, or nothing in it."""
        if self._average is None or not self._average.n_averaged:
            return self._policy
        found = self._average.module
        assert isinstance(found, ActorCriticPolicy)
        return found

    def arrays(self) -> dict[str, np.ndarray]:
        """By name, to go on from; empty without an average."""
        if self._average is None:
            return {}
        weights = self._average.module.state_dict()
        found = {f"{AVERAGE}{name}": tensor.numpy().copy() for name, tensor in weights.items()}
        return found | {_UPDATES: self._average.n_averaged.numpy().copy()}

    def restore(self, arrays: Mapping[str, np.ndarray], *, where: str) -> None:
        """Put in place what `arrays` gave.

        Raises:
            BadInputError: An array is missing, of another shape or not finite; names it.
        """
        if self._average is None:
            return
        require_alike(arrays, self.arrays(), where)
        require(int(arrays[_UPDATES]) >= 0, f"{where}: {_UPDATES}", ">= 0", int(arrays[_UPDATES]))
        names = self._average.module.state_dict()
        weights = {name: torch.from_numpy(arrays[f"{AVERAGE}{name}"].copy()) for name in names}
        self._average.module.load_state_dict(weights)
        self._average.n_averaged.fill_(int(arrays[_UPDATES]))


def _averaged(
    average: torch.Tensor, now: torch.Tensor, before: torch.Tensor | int, *, exponent: float
) -> torch.Tensor:
    """Polynomial-decay averaging: the k-th of k updates weighs (exponent + 1) / (k + exponent)."""
    weight = (exponent + 1.0) / (float(before) + 1.0 + exponent)
    return torch.lerp(average, now, weight)
