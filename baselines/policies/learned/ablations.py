"""Ablations of a trained policy, which show what of its input and output it uses: ``ppo:without=profile``.

The network stays. What is taken from its observations is set to what they hold where nothing is heard or
seen. So a loss says what this network uses, not what another could do that was trained without.
"""

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from envs.rendezvous_v0 import layout
from wifipgo.errors import pick
from wifipgo.scenarios import Scenario

_REQUEST = 2  # number of an action that says whether to call
_AND = "+"


class Ablation(NamedTuple):
    """One thing that is taken away.

    Attributes:
        blocks: Pattern of the blocks of the observation that hold it.
        silent: Whether no call goes out.
        forgets: Whether nothing is remembered from one iteration to the next.
    """

    blocks: str = "(?!)"
    silent: bool = False
    forgets: bool = False


ABLATIONS: Mapping[str, Ablation] = MappingProxyType(
    {
        "profile": Ablation(r"slot\d+/profile"),
        "camera": Ablation(r"own/sighted(_bearing)?"),
        "calls": Ablation(silent=True),
        "memory": Ablation(forgets=True),
    }
)


class Without:
    """Takes things away from observations and actions.

    Args:
        names: Of `ABLATIONS`, several with a plus between them; empty: none.
        scenario: Whose observations these are.

    Attributes:
        forgets: Whether what an interface remembers is taken away.

    Raises:
        UnknownNameError: There is no such; lists those that exist.
    """

    def __init__(self, names: str, scenario: Scenario) -> None:
        """Find the columns."""
        parts = [pick(ABLATIONS, name, "ablation in without:") for name in names.split(_AND)] if names else []
        hidden = [
            np.r_[field.where]
            for field in layout(scenario)
            if any(re.fullmatch(part.blocks, field.name) for part in parts)
        ]
        self._hidden = np.concatenate([np.zeros(0, dtype=np.int64), *hidden])
        self._silent = any(part.silent for part in parts)
        self.forgets = any(part.forgets for part in parts)

    def shown(self, rows: Float[np.ndarray, "rows numbers"]) -> Float[np.ndarray, "rows numbers"]:
        """Observations with zeros in what is hidden, as where nobody is heard or seen."""
        if len(self._hidden) == 0:
            return rows
        out = rows.copy()
        out[:, self._hidden] = 0.0
        return out

    def commanded(self, actions: Float[np.ndarray, "rows 3"]) -> Float[np.ndarray, "rows 3"]:
        """Actions, none of which asks for a call if calls are taken away."""
        if not self._silent:
            return actions
        out = actions.copy()
        out[:, _REQUEST] = -1.0
        return out
