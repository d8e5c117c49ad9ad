"""Observations of teams as arrays by name: what every policy, scripted or learned, starts from."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int, Shaped

from envs.rendezvous_v0 import layout
from wifipgo.errors import require
from wifipgo.scenarios import Scenario

Rows = Float[np.ndarray, "rows numbers"]
_FIRST_SLOT = "slot0/"


def flat_rows(observations: Mapping[str, Any]) -> Rows:
    """Flat observations, one row an agent.

    Raises:
        ValueError: They are dicts; policies read the flat form.
    """
    rows = list(observations.values())
    flat = not any(isinstance(row, Mapping) for row in rows)
    require(flat, "observations", "flat arrays (observation='flat') for a policy", "dicts")
    return np.stack(rows)


class Columns(NamedTuple):
    """Where the blocks of a flat observation are.

    Attributes:
        robot: Those of the robot itself, by name.
        slot: Those of a neighbour, within the numbers of its slot.
        n_robot: Numbers of the robot itself; those of the slots follow, slot after slot.
        n_slots: Slots.
    """

    robot: Mapping[str, slice]
    slot: Mapping[str, slice]
    n_robot: int
    n_slots: int

    @classmethod
    def of(cls, scenario: Scenario) -> "Columns":
        """Those of a scenario's observations."""
        fields = layout(scenario)
        first = [field for field in fields if field.name.startswith(_FIRST_SLOT)]
        begin = first[0].start
        slot = {
            field.name.removeprefix(_FIRST_SLOT): slice(field.start - begin, field.where.stop - begin)
            for field in first
        }
        robot = {field.name: field.where for field in fields if field.start < begin}
        return cls(robot, slot, begin, scenario.n_slots)

    @property
    def n_numbers(self) -> int:
        """Numbers of an observation."""
        return self.n_robot + self.n_slots * max(where.stop for where in self.slot.values())


class View(NamedTuple):
    """Flat observations of the teams of all worlds, one row a robot; what it gives are views, not copies.

    Attributes:
        rows: The observations, world after world.
        columns: Where the blocks are.
        n_robots: Robots of each team.
        begins: Rows whose episode begins now; None: no row's does.
    """

    rows: Rows
    columns: Columns
    n_robots: int
    begins: Bool[np.ndarray, " rows"] | None = None

    def own(self, name: str) -> Float[np.ndarray, "rows size"]:
        """A block of the robots themselves, e.g. ``err`` or ``heading``."""
        return self.rows[:, self.columns.robot[f"own/{name}"]]

    @property
    def lidar(self) -> Float[np.ndarray, "rows rays"]:
        """Free distance in lidar ranges, counter-clockwise from ahead."""
        return self.rows[:, self.columns.robot["lidar"]]

    @property
    def survey(self) -> Float[np.ndarray, "rows squares"]:
        """What each robot knows of the room: chance that a square is in place, 0 where not seen."""
        return self.rows[:, self.columns.robot["survey"]]

    def slot(self, name: str) -> Float[np.ndarray, "rows slots size"]:
        """A block of every slot, e.g. ``calls_me`` or ``profile``."""
        slots = self.rows[:, self.columns.n_robot :].reshape(len(self.rows), self.columns.n_slots, -1)
        return slots[:, :, self.columns.slot[name]]

    @property
    def peers(self) -> Int[np.ndarray, " rows"]:
        """Number of each robot in its own team."""
        return np.arange(len(self.rows)) % self.n_robots

    def kept(
        self, state: Shaped[np.ndarray, "rows ..."] | None, first: float | int, shape: tuple[int, ...] = ()
    ) -> Shaped[np.ndarray, "rows ..."]:
        """What was kept of each row from the step before, and a first value where an episode begins.

        Args:
            state: What was kept; may be changed.
            first: The first value.
            shape: Of the state of one row.
        """
        if state is None or len(state) != len(self.rows):
            return np.full((len(self.rows), *shape), first)
        if self.begins is not None:
            state[self.begins] = first
        return state
