"""How a network meets the environment: what it is shown of an observation, and what its answers mean.

Each interface is three pure functions on rows, `remembered`, `shown` and `commands`, the same in training and
on a robot.  ``flat`` shows the observation as it is and answers with the action itself.  ``rays`` is made so
that little has to be learned: see `baselines.policies.learned.ray_interface`.  ``trail`` is ``rays`` with a
memory of the robot's own way: see `baselines.policies.learned.trail_interface`.
"""

import re
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Shaped

from baselines.policies.learned.ray_interface import Begins, Rays
from baselines.policies.learned.trail_interface import Trails
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
        reads: Blocks that it reads; empty: all that the network was trained on.
        scale: Lengths, in space and time, that it takes from the scenario; scenarios with others are
            translated otherwise.
    """

    n_shown: int
    n_choices: tuple[int, ...]
    reads: tuple[str, ...]
    scale: tuple[float, ...]

    def remembered(self, rows: Rows, memory: Any, begins: Begins = None) -> Any:
        """What robots keep of their episode, with what they observe now; a named tuple of arrays, or None.

        It begins anew where observations are the first of an episode, and where ``begins`` says so.
        ``memory`` is left as it was.
        """

    def shown(self, rows: Rows, memory: Any = None) -> Shown:
        """What the network sees, float32, of observations and of what was remembered with them."""

    def commands(self, answers: Answers, rows: Rows) -> Actions:
        """Actions that the answers mean to robots that observe ``rows``."""

    def answers(self, actions: Actions) -> Answers:
        """Answers that come closest to actions: what a network would have to say to imitate them."""


class Flat:
    """The observation as it is; the answer is the action.

    Args:
        scenario: Whose observations are shown.
        blocks: Names of those that are shown, in this order; without them all.
    """

    n_choices: tuple[int, ...] = ()
    reads: tuple[str, ...] = ()
    scale: tuple[float, ...] = ()

    def __init__(self, scenario: Scenario, blocks: Sequence[str] = ()) -> None:
        """Find the columns of the blocks."""
        where = {field.name: np.r_[field.where] for field in layout(scenario)}
        columns = [pick(where, name, "block of the observation") for name in blocks or where]
        self._columns = np.concatenate(columns)
        self.n_shown = len(self._columns)

    def remembered(self, rows: Rows, memory: Any, begins: Begins = None) -> Any:
        """Nothing."""
        return None

    def shown(self, rows: Rows, memory: Any = None) -> Shown:
        """Those blocks, one after the other."""
        return rows[:, self._columns].astype(np.float32, copy=False)

    def commands(self, answers: Answers, rows: Rows) -> Actions:
        """The answer, within bounds."""
        return np.clip(answers, -1.0, 1.0).astype(np.float32, copy=False)

    def answers(self, actions: Actions) -> Answers:
        """The action."""
        return np.clip(actions, -1.0, 1.0).astype(np.float32, copy=False)


INTERFACES: Mapping[str, type[Flat | Rays]] = MappingProxyType({"flat": Flat, "rays": Rays, "trail": Trails})
# Interfaces that choose among directions: their network is that of `train._rays_policy`.
DIRECTIONS: Mapping[str, type[Rays]] = MappingProxyType({"rays": Rays, "trail": Trails})


def make_interface(name: str, scenario: Scenario, blocks: Sequence[str] = ()) -> Interface:
    """Interface by name.

    Args:
        name: In `INTERFACES`.
        scenario: Whose observations it translates.
        blocks: Those that a network was trained on, in order; for one that is yet to be trained, all.

    Raises:
        ValueError: Unknown; the message lists those that exist.
    """
    kind = pick(INTERFACES, name, "interface")
    return Flat(scenario, blocks) if kind is Flat else kind(scenario)


def names_read(name: str, trained: Sequence[str], scenario: Scenario) -> Sequence[str]:
    """Blocks that a network reads, by its interface's name and the blocks that it was trained on.

    One that is shown everything is shown every slot: a scenario with more of them is another input.
    """
    present = [field.name for field in layout(scenario)]
    slots = [n for n in present if n not in trained and re.sub(r"^slot\d+/", "slot0/", n) in trained]
    return pick(INTERFACES, name, "interface").reads or [*trained, *slots]


def layout_read(name: str, scenario: Scenario) -> list[tuple[str, int]]:
    """Name and size of each block that a network with this interface is trained on."""
    reads = pick(INTERFACES, name, "interface").reads
    return [(field.name, field.size) for field in layout(scenario) if not reads or field.name in reads]
