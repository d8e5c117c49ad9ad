"""Obstacles as other programs write them, names, values that nest: read as meant, or refused."""

import math

import pytest

from wifipgo.coerce import key_value
from wifipgo.scenarios import scenario_named

SQUARE = [[4.0, 4.0], [8.0, 4.0], [8.0, 8.0], [4.0, 8.0]]


@pytest.mark.parametrize(
    "ring",
    [
        [*SQUARE, SQUARE[0]],
        SQUARE[::-1],
        [*SQUARE[::-1], SQUARE[-1]],
        [SQUARE[0], SQUARE[0], *SQUARE[1:], SQUARE[-1], SQUARE[0]],
    ],
)
def test_closed_turned_and_stuttering_rings_are_the_polygon(ring: list[list[float]]) -> None:
    """As GeoJSON and Shapely write rings."""
    read = scenario_named("paper-hw-2", obstacles_m=[ring]).arena.obstacles_m[0]
    assert len(read) == 4
    assert set(read) == set(map(tuple, SQUARE))


@pytest.mark.parametrize(
    ("ring", "rule"),
    [
        ([SQUARE], "one level of brackets too many"),
        ([SQUARE[0], SQUARE[1], SQUARE[0]], "at least 3 corners"),
        (
            [[10 + 3 * math.cos(k / 200), 10 + 3 * math.sin(k / 200)] for k in range(1200)],
            "at most 1000 corners",
        ),
    ],
)
def test_rings_that_are_none_are_refused(ring: list[list[float]], rule: str) -> None:
    with pytest.raises(ValueError, match=rule):
        scenario_named("paper-hw-2", obstacles_m=[ring])


@pytest.mark.parametrize("name", ["\x1b]0;title\x07room", "a\nb", "\u202egnp", "x" * 201])
def test_names_are_printable(name: str) -> None:
    """No name moves the cursor, sets a title or turns text round."""
    with pytest.raises(ValueError, match=r"Scenario\.name must be printable"):
        scenario_named("paper-hw-2").with_overrides(name=name)


@pytest.mark.parametrize("value", ["-" * 100_000 + "1", "[" * 100_000, "(" * 5_000 + ")" * 5_000])
def test_a_setting_that_nests_too_deep_is_refused_or_a_word(value: str) -> None:
    try:
        assert key_value(f"x={value}") == ("x", value)
    except ValueError as refusal:
        assert "nests" in str(refusal)  # noqa: PT017 (which of the two depends on Python's version)
