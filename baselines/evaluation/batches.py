"""Items that are computed together: episodes of one policy in one scenario, as many worlds at once as pay."""

from collections.abc import Hashable, Sequence
from typing import Any, NamedTuple, Protocol, runtime_checkable

from wifipgo.scenarios import Scenario

# More worlds at once save no time per world; more robots only take memory.
MOST_WORLDS, MOST_ROBOTS = 64, 400


@runtime_checkable
class Together(Protocol):
    """An item that is one world of a batch."""

    @property
    def scenario(self) -> Scenario:
        """What is played."""

    @property
    def kind(self) -> Hashable:
        """Items of one kind may be computed together."""

    def compute_all(self, items: Sequence[Any]) -> Sequence[Any]:
        """The results of several items of this kind, each as if it had been computed alone."""


class Batch(NamedTuple):
    """Items of one kind that are one piece of work; each result has its own file still."""

    items: tuple[Any, ...]

    @property
    def label(self) -> str:
        """Its first item, and how many follow."""
        more = f" and {len(self.items) - 1} more" if len(self.items) > 1 else ""
        return f"{self.items[0].label}{more}"

    def compute(self) -> Sequence[Any]:
        """All results, in order."""
        if isinstance(self.items[0], Together):
            return self.items[0].compute_all(self.items)
        return [item.compute() for item in self.items]

    def keep(self, results: Sequence[Any]) -> None:
        """Write each to its file."""
        for item, result in zip(self.items, results, strict=True):
            item.keep(result)

    def halves(self) -> list["Batch"]:
        """The same in two parts."""
        middle = len(self.items) // 2
        return [Batch(self.items[:middle]), Batch(self.items[middle:])]


def worlds_at_once(scenario: Scenario, asked: int = 0) -> int:
    """Worlds of a batch: as many as asked for, else 64, fewer where teams are large."""
    return asked or max(1, min(MOST_WORLDS, MOST_ROBOTS // scenario.n_robots))


def batched(items: Sequence[Any], *, worlds: int, slots: int) -> list[Batch]:
    """Put items together, so that there is work for every slot; a batch stands where its first item stood.

    Args:
        items: In the order in which they are to be done.
        worlds: Most of one batch; 0: by the size of the team.
        slots: Batches that are computed at once.
    """
    share = -(-len(items) // slots)
    kinds: dict[Hashable, list[int]] = {}
    for place, item in enumerate(items):
        kinds.setdefault(item.kind if isinstance(item, Together) else place, []).append(place)
    parts = [
        part for places in kinds.values() for part in _even(places, _most(items[places[0]], worlds, share))
    ]
    return [Batch(tuple(items[place] for place in part)) for part in sorted(parts)]


def _most(item: Any, worlds: int, share: int) -> int:
    return min(worlds_at_once(item.scenario, worlds), share) if isinstance(item, Together) else 1


def _even(places: list[int], most: int) -> list[list[int]]:
    """Parts of about the same size, none larger than allowed."""
    n_parts = -(-len(places) // most)
    size = -(-len(places) // n_parts)
    return [places[begin : begin + size] for begin in range(0, len(places), size)]
