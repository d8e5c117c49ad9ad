"""Items are put together without one lost, twice, too many at once or with another kind."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from hypothesis import given
from hypothesis import strategies as st

from baselines.evaluation.batches import Batch, batched, worlds_at_once
from baselines.evaluation.executors import Executor
from baselines.evaluation.jobs import run_all
from wifipgo.scenarios import Scenario, scenario_named

ROOM = scenario_named("paper-hw-2")


class Item(NamedTuple):
    """One of several of its kind."""

    number: int
    kind: str
    broken: Sequence[int] = ()

    scenario: Scenario = ROOM
    path: Path = Path()

    @property
    def label(self) -> str:
        """Its number."""
        return f"item {self.number}"

    def compute_all(self, items: Sequence[Any]) -> list[int]:
        """Their numbers, unless one is broken."""
        if any(item.number in self.broken for item in items):
            raise ValueError("broken")
        return [item.number for item in items]

    def keep(self, result: int) -> None:
        """Take note that its own result came."""
        assert result == self.number
        KEPT.append(result)


class Loner(NamedTuple):
    """Work that nothing goes with."""

    number: int


KEPT: list[int] = []
KINDS = st.lists(st.sampled_from(["a", "b", "alone"]), max_size=40)


@given(KINDS, st.integers(0, 7), st.integers(1, 9))
def test_everything_is_in_one_batch(kinds: list[str], worlds: int, slots: int) -> None:
    items = [Loner(k) if kind == "alone" else Item(k, kind) for k, kind in enumerate(kinds)]
    batches = batched(items, worlds=worlds, slots=slots)
    numbers = [[item.number for item in batch.items] for batch in batches]
    assert sorted(number for part in numbers for number in part) == list(range(len(items)))
    assert numbers == sorted(map(sorted, numbers))  # in the order of their first items
    most = min(worlds or 64, -(-len(items) // slots))
    for batch in batches:
        of = {kinds[item.number] for item in batch.items}
        assert len(of) == 1
        assert len(batch.items) <= (1 if of == {"alone"} else most)


@given(st.integers(1, 30), st.sets(st.integers(0, 29), max_size=3), st.integers(0, 9))
def test_what_raises_is_found_and_the_rest_kept(n: int, broken: set[int], worlds: int) -> None:
    KEPT.clear()
    n_done: list[int] = []
    items = [Item(k, "a", tuple(broken)) for k in range(n)]
    failures = run_all(items, executor=Executor(name="serial", worlds=worlds), on_done=n_done.append)
    mine = {number for number in broken if number < n}
    assert {failure.label for failure in failures} == {f"item {number}" for number in mine}
    assert sorted(KEPT) == sorted(set(range(n)) - mine)
    assert sum(n_done) == n


def test_large_teams_have_fewer_worlds() -> None:
    sizes = [worlds_at_once(scenario_named("paper-sim-2", n_robots=n)) for n in (2, 6, 7, 50, 300)]
    assert sizes == [64, 64, 57, 8, 1]
    assert worlds_at_once(ROOM, 5) == 5
    assert Batch((Item(4, "a"), Item(5, "a"))).label == "item 4 and 1 more"
