"""How a network meets the environment: what it is shown of an observation, and what its answers mean.

Each interface is a pair of pure functions on rows, `shown` and `commands`, the same in training and on a
robot.  ``flat`` shows the observation as it is and answers with the action itself.  ``rays`` is made so
that little has to be learned: see `baselines.policies.learned.ray_interface`.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Shaped

from baselines.policies.learned.ray_interface import Rays
from envs.rendezvous_v0 import layout
from wifipgo.errors import pick
from wifipgo.scenarios import Scenario

Rows = Float[np.ndarray, "rows numbers"]
Shown = Float[np.ndarray, "rows shown"]
Actions = Float[np.ndarray, "rows 3"]
Answers = Shaped[np.ndarray, "rows answers"]


@runtime_checkable
class Interface(Protocol):
    """Between observations and a network, and between the network and actions.

    Attributes:
        n_shown: Numbers that the network is shown of each robot.
        n_choices: Options of each answer; empty where the answer is the action, a point in [-1, 1]^3.
        reads: Pattern of the names of all blocks that it has to find as they were in training.
        scale: Lengths that it takes from the scenario; scenarios with others are translated otherwise.
    """

    n_shown: int
    n_choices: tuple[int, ...]
    reads: str
    scale: tuple[float, ...]

    def shown(self, rows: Rows) -> Shown:
        """What the network sees, float32."""

    def commands(self, answers: Answers, rows: Rows) -> Actions:
        """Actions that the answers mean to robots that observe ``rows``."""

    def answers(self, actions: Actions) -> Answers:
        """Answers that come closest to actions: what a network would have to say to imitate them."""


class Flat:
    """The observation as it is; the answer is the action."""

    n_choices: tuple[int, ...] = ()
    reads = ".*"
    scale: tuple[float, ...] = ()

    def __init__(self, scenario: Scenario) -> None:
        """Learn the width of the observation."""
        self.n_shown = sum(field.size for field in layout(scenario))

    def shown(self, rows: Rows) -> Shown:
        """The observation."""
        return rows.astype(np.float32, copy=False)

    def commands(self, answers: Answers, rows: Rows) -> Actions:
        """The answer, within bounds."""
        return np.clip(answers, -1.0, 1.0).astype(np.float32, copy=False)

    def answers(self, actions: Actions) -> Answers:
        """The action."""
        return np.clip(actions, -1.0, 1.0).astype(np.float32, copy=False)


INTERFACES: Mapping[str, Callable[[Scenario], Interface]] = MappingProxyType({"flat": Flat, "rays": Rays})


def make_interface(name: str, scenario: Scenario) -> Interface:
    """Interface by name.

    Raises:
        ValueError: Unknown; the message lists those that exist.
    """
    return pick(INTERFACES, name, "interface")(scenario)
