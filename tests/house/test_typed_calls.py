"""A test run refuses what is not as a signature says: types, shapes, and shapes that do not agree."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from jaxtyping import AnnotationError, Bool, Float, Int, Real
from jaxtyping._storage import pop_shape_memo, push_shape_memo
from support.typed_calls import checked_thing, is_of, plain, slowly

from wifipgo.radio.aoa.estimators import AoaConfig
from wifipgo.se2 import compose

KINDS = [
    kind[np.ndarray, text]
    for kind in (Bool, Float, Int, Real)
    for text in ("", "3", "n", "n 3", "n n", "_ n", "*n", "n *n 3", "... 3", "*#n", "#n 3", "n n+1")
]
THINGS = [
    np.zeros(shape, dtype)
    for shape in ((), (3,), (2, 3), (3, 3), (1, 3), (3, 4))
    for dtype in (bool, np.int8, np.float32, np.float64, complex, "U1")
]

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


@pytest.mark.parametrize("other", [Float[np.ndarray, "*#n"], Float[np.ndarray, "n 3"]])
@pytest.mark.parametrize("kind", KINDS)
def test_a_look_finds_what_jaxtyping_finds(kind: type, other: type) -> None:
    """For one thing after another in a call, whether or not the lengths remembered agree."""

    def found(look: Callable[[type, object], bool]) -> list[tuple[bool, bool] | None]:
        def answer(thing: object) -> tuple[bool, bool] | None:
            try:
                return look(kind, thing), look(other, thing)
            except AnnotationError:  # a sum of lengths that nothing has
                return None

        push_shape_memo({})
        answers = [answer(thing) for thing in [*THINGS, *reversed(THINGS), None, [1.0]]]
        pop_shape_memo()
        return answers

    assert found(is_of) == found(slowly)


def test_most_shapes_are_plain() -> None:
    assert sum(plain(kind) is not None for kind in KINDS) == 9 * 4


def test_the_project_is_checked_so() -> None:
    """Functions, methods, properties and dataclasses, of a package as it is imported."""
    with pytest.raises(TypeError, match="violates type hint"):
        compose(TWO, TWO[:, :2])
    with pytest.raises(TypeError, match="violates type hint"):
        AoaConfig(antenna_gap_m="wide")  # type: ignore[arg-type]
