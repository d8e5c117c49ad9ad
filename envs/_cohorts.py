"""Worlds of a batch by when they began: each cohort shares a clock."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Int

from envs._episode import Episode

REPLACED = -1  # number of a world that has begun anew elsewhere


class Cohort(NamedTuple):
    """Worlds that began together.

    Attributes:
        worlds: Number in the batch of each; -1 of one that has begun anew elsewhere since.
        episode: Where they stand. Those that are over are played on with the others, unseen.
    """

    worlds: Int[np.ndarray, " some"]
    episode: Episode

    def among(self, mask: Bool[np.ndarray, " worlds"]) -> Int[np.ndarray, " among"]:
        """Places of those of its worlds for which a mask of the batch holds."""
        there: np.ndarray = (self.worlds != REPLACED) & mask[self.worlds]
        return there.nonzero()[0]


def without(cohorts: tuple[Cohort, ...], worlds: Int[np.ndarray, " some"]) -> list[Cohort]:
    """Cohorts whose worlds begin anew elsewhere; those of which nothing is left go."""
    left = [
        Cohort(np.where(np.isin(cohort.worlds, worlds), REPLACED, cohort.worlds), cohort.episode)
        for cohort in cohorts
    ]
    return [cohort for cohort in left if (cohort.worlds != REPLACED).any()]
