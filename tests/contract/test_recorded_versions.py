"""Records name the version of the code that ran, not that of an installation beside it."""

from importlib import metadata

import pytest

from baselines.evaluation import plan
from train import _versions as training
from wifipgo.version import version


def test_a_checkout_is_not_recorded_as_an_older_installation(monkeypatch: pytest.MonkeyPatch) -> None:
    found = metadata.version
    monkeypatch.setattr(metadata, "version", lambda name: "0.0.1" if name == "wifipgo" else found(name))
    assert plan.versions()["wifipgo"] == version() == training.versions()["wifipgo"] != "0.0.1"
