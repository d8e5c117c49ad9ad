"""Worlds of a batch by when they began: each cohort shares a clock."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float32, Int

from envs._episode import Episode
from envs._state import state
from wifipgo.loop.one_world import one_tick, one_world
from wifipgo.state import Tick, World

REPLACED = -1  # number of a world that has begun anew elsewhere


class Cohort(NamedTuple):
    """Worlds that began together.

    Attributes:
        worlds: Number in the batch of each; -1 of one that has begun anew elsewhere since.
        episode: Where they stand. Those that are over are played on with the others, unseen.
        ended: Where worlds stood when they ended before the others, by number in the batch.
    """

    worlds: Int[np.ndarray, " some"]
    episode: Episode
    ended: dict[int, Tick] = {}  # noqa: RUF012 (never written to)

    def among(self, mask: Bool[np.ndarray, " worlds"]) -> Int[np.ndarray, " among"]:
        """Places of those of its worlds for which a mask of the batch holds."""
        there: np.ndarray = (self.worlds != REPLACED) & mask[self.worlds]
        return there.nonzero()[0]

    def advanced(self, now: Episode, over: Bool[np.ndarray, " worlds"]) -> "Cohort":
        """The cohort after a step that ended some of its worlds, by place; what they came to stays."""
        if over.all() or not over.any():
            return self._replace(episode=now)
        new = [k for k in over.nonzero()[0].tolist() if self.worlds[k] not in {REPLACED, *self.ended}]
        if not new:
            return self._replace(episode=now)
        last = {int(self.worlds[k]): one_tick(now.tick, k, now.rows) for k in new}
        return self._replace(episode=now, ended=self.ended | last)

    def tick_of(self, world: int) -> Tick:
        """Tick of one of its worlds as a batch of one, that of its end if it is over."""
        if world in self.ended:
            return self.ended[world]
        return one_tick(self.episode.tick, self._place(world), self.episode.rows)

    def world_of(self, world: int) -> World:
        """What stands still in one of its worlds."""
        return one_world(self.episode.world, self._place(world), self.episode.scenario)

    def _place(self, world: int) -> int:
        (place,) = np.flatnonzero(self.worlds == world).tolist()
        return int(place)

    def states(self) -> Float32[np.ndarray, "worlds numbers"]:
        """State of each of its worlds."""
        out = state(self.episode.tick, self.episode.scenario)
        for world, tick in self.ended.items():
            out[self.worlds == world] = state(tick, self.episode.scenario)
        return out


def without(cohorts: tuple[Cohort, ...], worlds: Int[np.ndarray, " some"]) -> list[Cohort]:
    """Cohorts whose worlds begin anew elsewhere; those of which nothing is left go."""
    left = [
        cohort._replace(worlds=np.where(np.isin(cohort.worlds, worlds), REPLACED, cohort.worlds))
        for cohort in cohorts
    ]
    return [cohort for cohort in left if (cohort.worlds != REPLACED).any()]
