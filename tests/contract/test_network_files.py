"""A policy from a file whose layers do not fit together: refused by file and layer, before it plays."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from baselines.policies.learned.network import load_network
from baselines.policies.learned.policy import shipped
from wifipgo.errors import BadInputError


def with_notes(change: dict[str, Any]) -> Callable[[dict[str, Any]], dict[str, Any]]:
    return lambda arrays: {"notes": np.array(json.dumps(json.loads(str(arrays["notes"])) | change))}


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda a: {"ray/1/weight": a["ray/1/weight"][:, :-1]}, "shape of ray/1/weight must be"),
        (lambda a: {"whole/0/bias": a["whole/0/bias"][:-1]}, "shape of whole/0/bias must be"),
        (lambda a: {"whole/0/bias": a["whole/0/bias"] * np.nan}, "whole/0/bias must be finite"),
        (lambda a: {"ray/0/weight": a["ray/0/weight"].astype(int)}, "ray/0/weight must be of floating point"),
        (lambda a: {"ray/0/weight": a["ray/0/weight"].ravel()}, "ray/0/weight must be a matrix"),
        (lambda a: {"mean": a["mean"] + np.inf}, "mean must be finite"),
        (lambda a: {"variance": -a["variance"]}, "variance must be >= 0"),
        (lambda a: {"variance": a["variance"][:-1]}, "shape of variance must be"),
        (lambda a: {"ray/9/weight": a["ray/0/weight"]}, "layers of ray must be numbered from 0"),
        (lambda a: {"cue/0/weight": a["mean"][None], "cue/0/bias": np.zeros(1)}, "perceptrons must be"),
        (lambda a: {"extra": np.zeros(3)}, "'extra' must be named"),
        (lambda _: {"notes": np.array("[]")}, "notes must be a table"),
        (lambda _: {"notes": np.array("[" * 100_000)}, "nested too deep"),
        (with_notes({"clip": None}), "clip must be"),
        (with_notes({"clip": float("nan")}), "clip must be > 0 and finite"),
        (with_notes({"layout": 3}), "layout must be of the type"),
        (with_notes({"layout": [["lidar", "16"]]}), "layout must be names and sizes"),
        (with_notes({"scenario": 3}), "scenario must be"),
    ],
)
def test_a_network_that_does_not_fit_together_is_refused_by_layer(
    tmp_path: Path, change: Callable[[dict[str, Any]], dict[str, Any]], told: str
) -> None:
    path = tmp_path / "policy.npz"
    shipped().save(path)
    with np.load(path) as file:
        arrays = dict(file)
    np.savez(path, allow_pickle=False, **(arrays | change(arrays)))
    with pytest.raises(BadInputError, match=f"policy.npz is no trained policy.*{re.escape(told)}"):
        load_network(path)
