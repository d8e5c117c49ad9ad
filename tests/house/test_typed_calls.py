"""A test run refuses what is not as a signature says: types, shapes, and shapes that do not agree."""

from dataclasses import dataclass

import numpy as np
import pytest
from jaxtyping import Float
from support.typed_calls import checked_thing

from wifipgo.radio.aoa.estimators import AoaConfig
from wifipgo.se2 import compose

Rows = Float[np.ndarray, "robots 3"]
TWO, THREE = np.zeros((2, 3)), np.zeros((3, 3))


@checked_thing
def pick(a: Rows, b: Rows, answer: object = None) -> Float[np.ndarray, "robots"]:
    return a[:, 0] if answer is None else answer  # type: ignore[return-value]


@checked_thing
@dataclass(frozen=True, slots=True)
class Pair:
    """Two tables of as many rows."""

    a: Rows
    b: Rows


def test_what_agrees_passes() -> None:
    assert pick(TWO, TWO).shape == (2,)
    assert pick(THREE, b=THREE).shape == (3,)
    assert Pair(TWO, TWO).b is TWO


@pytest.mark.parametrize(
    ("a", "b", "answer"),
    [
        (TWO, THREE, None),
        (TWO, TWO.astype(int), None),
        (TWO, TWO[:, :2], None),
        (TWO, [[0.0] * 3] * 2, None),
        (TWO, TWO, THREE[:, 0]),
        (TWO, TWO, "nothing"),
    ],
)
def test_what_does_not_agree_is_refused(a: Rows, b: Rows, answer: object) -> None:
    with pytest.raises(TypeError):
        pick(a, b, answer)
    if answer is None:
        with pytest.raises(TypeError):
            Pair(a, b)


def test_a_refusal_leaves_the_next_call_alone() -> None:
    with pytest.raises(TypeError):
        pick(TWO, THREE)
    assert pick(THREE, THREE).shape == (3,)


def test_the_project_is_checked_so() -> None:
    """Functions, methods, properties and dataclasses, of a package as it is imported."""
    with pytest.raises(TypeError, match="violates type hint"):
        compose(TWO, TWO[:, :2])
    with pytest.raises(TypeError, match="violates type hint"):
        AoaConfig(antenna_gap_m="wide")  # type: ignore[arg-type]
