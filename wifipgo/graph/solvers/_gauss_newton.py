"""Gauss-Newton on squares, whoever makes the steps."""

from collections.abc import Callable
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


def descend(step: Step[Place, Factors], start: Place) -> tuple[Place, int, bool]:
    """Gauss-Newton while the error falls.

    Near the optimum one factorisation serves several steps. Falls shrink at least geometrically there, so
    the search ends when the next one would be below the tolerance, without a step to see it.

    Returns:
        The lowest place found, the steps taken, and whether it is the bottom.
    """
    at, factored, last_fall = start, None, 0.0
    for iteration in range(1, MAX_STEPS + 1):
        try:
            stepped, factors = step(at, factored)
        except RuntimeError:  # singular to working precision
            break
        fall, slack = at.error - stepped.error, SLACK + ROUNDING * at.error
        if factored is None and not fall >= -slack:  # downhill, yet not down; or not a number
            break
        at = stepped if fall > 0.0 else at
        shrinking = abs(fall) / last_fall if last_fall > 0.0 else 1.0
        if abs(fall) * min(1.0, shrinking) <= slack:
            return at, iteration, True
        again = 0.0 < fall < NEAR and (factored is None or shrinking < SHRINKING)
        factored, last_fall = factors if again else None, fall
    return at, iteration, False
