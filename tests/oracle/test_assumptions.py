"""Sweeps and settings as text become assumptions."""

import pytest

from baselines.reproduce._assumptions import assumptions
from wifipgo.errors import BadInputError


@pytest.mark.parametrize(
    ("changes", "sweeps", "expected"),
    [
        (["a=1", "b=x"], [], [{"a": 1, "b": "x"}]),
        ([], ["a=5,10,20"], [{"a": 5}, {"a": 10}, {"a": 20}]),
        ([], ["a=0.5, 1e3"], [{"a": 0.5}, {"a": 1000.0}]),
        ([], ["a=true,false"], [{"a": True}, {"a": False}]),
        ([], ["a=unit,information"], [{"a": "unit"}, {"a": "information"}]),
        ([], ["a=(1, 2),(3, 4)"], [{"a": (1, 2)}, {"a": (3, 4)}]),
        (
            ["b=1"],
            ["a=5,6", "c=7,8"],
            [{"b": 1, "a": 5}, {"b": 1, "a": 6}, {"b": 1, "c": 7}, {"b": 1, "c": 8}],
        ),
    ],
)
def test_values_of_every_kind(
    changes: list[str], sweeps: list[str], expected: list[dict[str, object]]
) -> None:
    found = assumptions(changes, sweeps)
    assert [dict(one.changes) for one in found] == expected
    assert len({one.label for one in found}) == len(expected)


@pytest.mark.parametrize("sweep", ["a", "a=", "a=1", "a=(1, 2)", "=1,2"])
def test_what_is_no_sweep_is_refused(sweep: str) -> None:
    with pytest.raises(BadInputError):
        assumptions([], [sweep])
