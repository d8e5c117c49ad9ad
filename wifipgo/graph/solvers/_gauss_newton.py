"""Gauss-Newton on squares, whoever makes the steps."""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import Protocol, TypeVar, runtime_checkable

SLACK, ROUNDING = 1e-9, 1e-13  # of squares, absolute and relative: within 1e-4 sigmas, all poses together
NEAR = 1.0  # fall of the error below which the factors serve again, while each step's fall is
SHRINKING = 0.1  # of the last one's at most
MAX_STEPS = 20  # of Gauss-Newton; where it is of use it needs 2 to 8


class SingularError(RuntimeError):
    """Normal equations without a solution; gtsam's own failure is a RuntimeError too."""


@runtime_checkable
class At(Protocol):
    """Some poses, and half the chi-square there."""

    @property
    def error(self) -> float:
        """Half a chi-square."""


Place = TypeVar("Place", bound=At)
Factors = TypeVar("Factors")
# From a place to the next: by the factors of the system there, or by those of one nearby that are given.
Step = Callable[[Place, Factors | None], tuple[Place, Factors]]


@dataclass(slots=True)
class Descent:
    """What a search decides after each of its steps.

    Near the optimum one factorisation serves several steps. Falls shrink at least geometrically there, so
    the search ends when the next one would be below the tolerance, without a step to see it.

    Attributes:
        steps: Taken so far.
        reuses: Whether the factors of the last step serve the next one.
        ended: Whether there is no next one.
        settled: Whether it ended at the bottom.
        last_fall: Of the error.
        slack: Fall of the error that counts as none.
        near: Fall of the error below which the factors may serve again.
        most: Steps at most.
        by_model: A fall that differs from what the linear model foresaw by no more ends the search too: what
            is left to gain is a share of the difference.
    """

    steps: int = 0
    reuses: bool = False
    ended: bool = False
    settled: bool = False
    last_fall: float = 0.0
    slack: float = SLACK
    near: float = NEAR
    most: int = MAX_STEPS
    by_model: float = 0.0

    def judge(self, before: float, after: float, foreseen: float = inf) -> bool:
        """Take note of a step from one error to another; whether to go there."""
        self.steps += 1
        fall, slack = before - after, self.slack + ROUNDING * before
        if not self.reuses and not fall >= -slack:  # downhill, yet not down; or not a number
            self.ended = True
            return False
        shrinking = abs(fall) / self.last_fall if self.last_fall > 0.0 else 1.0
        self.settled = abs(fall) * min(1.0, shrinking) <= slack
        self.settled |= abs(fall - foreseen) < self.by_model
        self.ended = self.settled or self.steps == self.most
        self.reuses = 0.0 < fall < self.near and (not self.reuses or shrinking < SHRINKING)
        self.last_fall = fall
        return fall > 0.0

    def again(self) -> "Descent":
        """A new search by the same rules."""
        return Descent(slack=self.slack, near=self.near, most=self.most, by_model=self.by_model)

    def give_up(self) -> None:
        """Take note of a step that could not be made: the system is singular to working precision."""
        self.steps += 1
        self.ended = True


def descend(step: Step[Place, Factors], start: Place) -> tuple[Place, Descent]:
    """Gauss-Newton while the error falls.

    Returns:
        The lowest place found, and how the search ended.
    """
    at, factors, search = start, None, Descent()
    while not search.ended:
        try:
            stepped, factors = step(at, factors if search.reuses else None)
        except RuntimeError:
            search.give_up()
            break
        at = stepped if search.judge(at.error, stepped.error) else at
    return at, search
