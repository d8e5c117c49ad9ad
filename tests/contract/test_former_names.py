"""Former names answer for one version: each warns once and is the thing that it is now."""

import importlib
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from wifipgo.former_names import FORMER, LEFT

ROOT = Path(__file__).parents[2]
GONE = [name for name in FORMER if not (ROOT / (name.replace(".", "/") + ".py")).exists()]


@pytest.mark.parametrize("former", GONE)
def test_a_former_module_is_the_module_that_it_is_now(former: str) -> None:
    sys.modules.pop(former, None)
    with pytest.warns(DeprecationWarning, match=f"{former} is now {FORMER[former]}"):
        module = importlib.import_module(former)
    assert module is importlib.import_module(FORMER[former])
    spec = module.__spec__
    assert spec is not None
    assert spec.name == FORMER[former]


@pytest.mark.parametrize("face", LEFT)
def test_names_that_left_a_face_are_what_they_are_now(face: str) -> None:
    for name, now in LEFT[face].items():
        with pytest.warns(DeprecationWarning, match=f"{face}.{name} is now {now}"):
            found = getattr(importlib.import_module(face), name)
        module, _, name_now = now.partition(":")
        assert found is getattr(importlib.import_module(module), name_now)


def test_names_that_left_are_not_there() -> None:
    for face, names in LEFT.items():
        assert not set(names) & set(vars(importlib.import_module(face))), face


def test_other_names_do_not_exist() -> None:
    wifipgo = importlib.import_module("wifipgo")
    with pytest.raises(AttributeError, match="'wifipgo' has no attribute 'nothing'"):
        _ = wifipgo.nothing
    assert find_spec("wifipgo.nothing") is None
