"""Any path can be named in a policy's spec, and lists split where another policy begins."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from baselines.policies import POLICIES
from baselines.policies.specs import split_list, split_spec
from wifipgo.coerce import settings
from wifipgo.command.overrides import joined
from wifipgo.errors import BadInputError

PATHS = [
    "/x/2026-01-02T12:30:00/policy.npz",
    "/x/lr=1e-3,seed=0/policy.npz",
    r"C:\runs\best run\policy.npz",
    "D:/runs, old/policy.npz",
    "/o'brien/policy.npz",
]


@pytest.mark.parametrize("path", PATHS)
def test_a_path_needs_no_quotes(path: str) -> None:
    first, second = f"ppo:path={path}", f"ppo:path={path}:greedy=True"
    assert split_spec(first) == ("ppo", {"path": path})
    assert split_spec(second) == ("ppo", {"path": path, "greedy": True})
    specs = ("active:err_threshold=1", first, "random", second)
    assert split_list(", ".join(specs), POLICIES) == specs


@given(st.text("abc:=,/ ", min_size=1).map(lambda text: f"'{text}'"))
def test_in_quotes_a_value_may_hold_anything(quoted: str) -> None:
    spec = f"ppo:path={quoted}:greedy=False"
    assert split_list(f"random,{spec},active", POLICIES) == ("random", spec, "active")
    assert split_spec(spec) == ("ppo", {"path": quoted[1:-1], "greedy": False})


def test_names_that_are_not_known_stay_apart() -> None:
    assert split_list("acitve,random,", POLICIES) == ("acitve", "random")
    with pytest.raises(BadInputError, match="KEY=VALUE, got 'junk'"):
        split_spec("active:err_threshold=0.5:junk")


def test_an_option_given_twice_counts_twice() -> None:
    words = ["--set", "a=1", "b=2", "--seed", "3", "--set=c=4", "room", "--set", "d=5"]
    assert joined(words) == ["--seed", "3", "room", "--set", "a=1", "b=2", "c=4", "d=5"]
    assert settings(["a=1", "b=x", "a=1"]) == {"a": 1, "b": "x"}
    with pytest.raises(BadInputError, match=r"setting a must be given once.*got 2"):
        settings(["a=1", "a=2"])
