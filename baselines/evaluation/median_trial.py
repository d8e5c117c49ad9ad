"""The trial to show where one stands for all: neither a lucky one nor one picked by hand."""

from typing import NamedTuple

import pandas as pd


class MedianTrial(NamedTuple):
    """The trial in the middle.

    Attributes:
        number: Of the trial.
        ranks: Place of its score among all trials of a policy, 1 the best, by policy.
        n_trials: Of each policy.
    """

    number: int
    ranks: dict[str, int]
    n_trials: int


def median_trial(episodes: pd.DataFrame) -> MedianTrial:
    """Trial nearest to the median score of every policy: its ranks are, in sum, the closest to the middle.

    With one policy it is the median; of several that are as near, the first.

    Args:
        episodes: ``episodes.parquet``: every policy met every trial.
    """
    scores = episodes.pivot_table(index="trial", columns="policy", values="mapped_share")
    ranks = scores.rank(ascending=False)  # ties share the mean of their ranks
    away = (ranks - 0.5 * (len(scores) + 1)).abs().sum(axis=1).to_numpy()
    number = int(scores.index.to_numpy()[away.argmin()])
    better = (scores > scores.loc[number]).sum()
    return MedianTrial(number, {str(of): int(count) + 1 for of, count in better.items()}, len(scores))
