"""Results of a suite in rows: a policy a row, the best first."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from baselines.evaluation.intervals import Estimate, mean_of
from baselines.suite.aggregate import draws, interquartile_mean, probability_of_improvement
from baselines.suite.definition import anchors_of
from baselines.suite.results import Results
from wifipgo.errors import pick, require

LEAST_WORLDS = 10  # of which an interval says something
_REFERENCES = ("team_plan", "active")  # the best rule known, and the paper's


class Standing(NamedTuple):
    """A policy in a suite.

    Attributes:
        label: Its name.
        iqm: Interquartile mean of the normalised scores.
        improvement: Probability of improvement over the reference; None for itself.
        above: Scenarios in which it is better than the reference, by the interval of the paired difference.
        below: Scenarios in which it is worse.
        scores: Mapped share by scenario.
        normalised: Mean normalised score by scenario.
    """

    label: str
    iqm: Estimate
    improvement: Estimate | None
    above: int
    below: int
    scores: Mapping[str, Estimate]
    normalised: Mapping[str, float]


def reference_of(labels: Sequence[str], asked: str = "") -> str:
    """Policy that the others are compared with: the one asked for, else the best rule known that is there.

    Raises:
        BadInputError: It is not among them; lists those that are.
    """
    if asked:
        pick(dict.fromkeys(labels), asked, "reference")
        return asked
    return next((label for label in _REFERENCES if label in labels), labels[0])


def standings_of(results: Results, reference: str) -> list[Standing]:
    """Every policy, the highest interquartile mean first.

    Raises:
        BadInputError: There are fewer worlds than a table needs, or no scenario that all have played.
    """
    require(results.worlds >= LEAST_WORLDS, "worlds", f">= {LEAST_WORLDS} for a table", results.worlds)
    rule = "played by every policy, one or more"
    require(
        len(results.scenarios) > 0, "scenarios", rule, {k: list(e.scores) for k, e in results.entries.items()}
    )
    drawn = draws(len(results.scenarios), results.worlds)
    against = results.scores(reference)
    found = []
    for label in results.entries:
        scores = results.scores(label)
        normal = normalised(scores, results)
        chance = None if label == reference else probability_of_improvement(scores, against, drawn)
        above, below = _decided(scores - against)
        by_name = dict(zip(results.scenarios, map(mean_of, scores), strict=True))
        means = dict(zip(results.scenarios, normal.mean(axis=1).tolist(), strict=True))
        iqm = interquartile_mean(normal, drawn)
        found.append(Standing(label, iqm, chance, above, below, by_name, means))
    return sorted(found, key=lambda one: one.iqm.value or 0.0, reverse=True)


def decided_between(results: Results, label: str, other: str) -> tuple[int, int]:
    """In how many scenarios a policy is above another, and below, by the interval of their difference."""
    return _decided(results.scores(label) - results.scores(other))


def normalised(
    scores: Float[np.ndarray, "scenarios worlds"], results: Results
) -> Float[np.ndarray, "scenarios worlds"]:
    """Scores on a scale on which a random walk has 0 and near-perfect localisation 1 in each scenario."""
    floor, ceiling = (
        np.array([anchor[name] for name in results.scenarios])[:, None]
        for anchor in anchors_of(results.suite)
    )
    return np.asarray((scores - floor) / (ceiling - floor))


def _decided(differences: Float[np.ndarray, "scenarios worlds"]) -> tuple[int, int]:
    """In how many scenarios the interval of a paired difference is above zero, and below."""
    found = [mean_of(one) for one in differences]
    above = sum(one.low is not None and one.low > 0.0 for one in found)
    return above, sum(one.high is not None and one.high < 0.0 for one in found)
