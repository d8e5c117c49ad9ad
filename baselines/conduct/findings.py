"""A policy beside a rule: figures of both in the same worlds, and their differences."""

from collections.abc import Mapping
from typing import NamedTuple

import pandas as pd

from baselines.conduct.conduct import Conduct, mean_curves
from baselines.conduct.measures import MEASURES, Figures
from baselines.evaluation.intervals import Estimate, mean_of
from baselines.suite.definition import Suite


class Findings(NamedTuple):
    """What was played.

    Attributes:
        suite: Scenarios and worlds.
        policy: Label of the policy that is looked at.
        rule: Label of what it is compared with.
        ablations: Labels of the policy without something.
        texts: How a command line names the rule and the policy.
        conduct: By scenario, then by label.
    """

    suite: Suite
    policy: str
    rule: str
    ablations: tuple[str, ...]
    texts: tuple[str, str]
    conduct: Mapping[str, Mapping[str, Conduct]]

    @property
    def scenarios(self) -> tuple[str, ...]:
        """Short names."""
        return tuple(self.conduct)

    @property
    def labels(self) -> tuple[str, ...]:
        """All that played: the rule, the policy, its ablations, then the others."""
        first = (self.rule, self.policy, *self.ablations)
        others = (label for label in self.conduct[self.scenarios[0]] if label not in first)
        return (*first, *others)

    def figures(self, scenario: str, label: str, measure: str) -> Figures:
        """A measure in every world."""
        return MEASURES[measure].of(self.conduct[scenario][label])

    def difference(self, scenario: str, measure: str, label: str, reference: str) -> Estimate:
        """Mean of what one has more than another in the same worlds."""
        one, other = (self.figures(scenario, who, measure) for who in (label, reference))
        return mean_of(one - other)

    def record(self) -> dict[str, object]:
        """Mean of every measure, and differences to the rule, as plain JSON values."""
        return {
            scenario: {
                label: {
                    measure: {
                        "mean": _plain(mean_of(self.figures(scenario, label, measure))),
                        "less_rule": _plain(self.difference(scenario, measure, label, self.rule)),
                    }
                    for measure in MEASURES
                }
                for label in self.labels
            }
            for scenario in self.scenarios
        }


def curves_of(findings: Findings) -> pd.DataFrame:
    """Means over worlds and robots, a row for each scenario, policy and iteration."""
    frames = {
        (scenario, label): pd.DataFrame(mean_curves(conduct)).rename(index=lambda k: k + 1)
        for scenario, by_label in findings.conduct.items()
        for label, conduct in by_label.items()
    }
    return pd.concat(frames, names=["scenario", "policy", "iteration"]).reset_index()


def decided(found: Estimate) -> bool:
    """Whether an interval holds no zero."""
    return found.low is not None and found.high is not None and found.low * found.high > 0.0


def _plain(found: Estimate) -> list[float | None]:
    return [found.value, found.low, found.high]
