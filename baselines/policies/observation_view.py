"""Observations of a team as arrays by name: what every policy, scripted or learned, starts from."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from envs.rendezvous_v0 import Field
from wifipgo.errors import require

Rows = Float[np.ndarray, "robots numbers"]


def flat_rows(observations: Mapping[str, Any]) -> Rows:
    """Flat observations, one row an agent.

    Raises:
        ValueError: They are dicts; policies read the flat form.
    """
    rows = list(observations.values())
    flat = not any(isinstance(row, Mapping) for row in rows)
    require(flat, "observations", "flat arrays (observation='flat') for a policy", "dicts")
    return np.stack(rows)


class View(NamedTuple):
    """Flat observations of all live agents, one row each, and their layout."""

    rows: Rows
    fields: Mapping[str, Field]

    @classmethod
    def of(
        cls, observations: Mapping[str, Float[np.ndarray, " numbers"]], fields: Mapping[str, Field]
    ) -> "View":
        """Stack the observations of one step."""
        return cls(flat_rows(observations), fields)

    def own(self, name: str) -> Float[np.ndarray, "robots size"]:
        """A block of the robots themselves, e.g. ``err`` or ``heading``."""
        return self.rows[:, self.fields[f"own/{name}"].where]

    @property
    def lidar(self) -> Float[np.ndarray, "robots rays"]:
        """Free distance in lidar ranges, counter-clockwise from ahead."""
        return self.rows[:, self.fields["lidar"].where]

    @property
    def survey(self) -> Float[np.ndarray, "robots squares"]:
        """What each robot knows of the room: chance that a square is in place, 0 where not seen."""
        return self.rows[:, self.fields["survey"].where]

    def slot(self, name: str) -> Float[np.ndarray, "robots slots size"]:
        """A block of every slot, e.g. ``calls_me`` or ``profile``."""
        blocks = [
            self.rows[:, f.where]
            for key, f in self.fields.items()
            if key.endswith(f"/{name}") and "slot" in key
        ]
        return np.stack(blocks, axis=1)
