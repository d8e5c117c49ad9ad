"""Faces: what a user reaches for first, about fifteen names, each with a sentence; and one version."""

import importlib
import inspect
import re
import tomllib
from importlib import metadata

import pytest
from support.project_files import ROOT

from wifipgo.version import version

FACES = ("wifipgo", "wifipgo.world", "wifipgo.radio", "wifipgo.graph")
FEWEST, MOST = 12, 18
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]

faces = pytest.mark.parametrize("face", FACES)


@faces
def test_a_face_is_small(face: str) -> None:
    names = importlib.import_module(face).__all__
    assert FEWEST <= len(names) <= MOST
    assert len(set(names)) == len(names)


@faces
def test_every_name_resolves_and_says_what_it_is(face: str) -> None:
    module = importlib.import_module(face)
    for name in module.__all__:
        thing = getattr(module, name)
        if inspect.isclass(thing) or inspect.isroutine(thing):
            first = (inspect.getdoc(thing) or "").split("\n")[0]
            assert re.fullmatch(r"[A-Z`].+[.:]", first), f"{face}.{name}: {first!r}"
            assert not first.startswith(f"{name}("), f"{face}.{name} has no docstring of its own"


@faces
def test_a_face_shows_nothing_private(face: str) -> None:
    module = importlib.import_module(face)
    assert not [name for name in module.__all__ if name.startswith("_")]
    assert module.__doc__


def test_the_version_is_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of what is installed; of the checkout where nothing is."""
    assert importlib.import_module("wifipgo").__version__ == version()
    citation = (ROOT / "CITATION.cff").read_text("utf-8")
    assert f"\nversion: {PROJECT['version']}\n" in citation
    assert f"\n## [{PROJECT['version']}]" in (ROOT / "CHANGELOG.md").read_text("utf-8")

    def missing(_: str) -> str:
        raise metadata.PackageNotFoundError

    monkeypatch.setattr(metadata, "version", missing)
    assert version() == PROJECT["version"]
