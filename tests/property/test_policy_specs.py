"""Any path can be named in a policy's spec, and lists split where another policy begins."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from baselines.policies import POLICIES
from baselines.policies.registry import recorded_specs, specs_of
from baselines.policies.specs import Spec, parse_spec, split_list
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
    assert parse_spec(first).parameters == {"path": path}
    assert parse_spec(second).parameters == {"path": path, "greedy": True}
    specs = ("active:err_threshold=1", first, "random", second)
    assert split_list(", ".join(specs), POLICIES) == specs


@given(st.text("abc:=,/ ", min_size=1).map(lambda text: f"'{text}'"))
def test_in_quotes_a_value_may_hold_anything(quoted: str) -> None:
    spec = f"ppo:path={quoted}:greedy=False"
    assert split_list(f"random,{spec},active", POLICIES) == ("random", spec, "active")
    assert parse_spec(spec).parameters == {"path": quoted[1:-1], "greedy": False}


def test_names_that_are_not_known_stay_apart() -> None:
    assert split_list("acitve,random,", POLICIES) == ("acitve", "random")
    with pytest.raises(BadInputError, match="KEY=VALUE, got 'junk'"):
        _ = parse_spec("active:err_threshold=0.5:junk", POLICIES).parameters


def test_an_option_given_twice_counts_twice() -> None:
    words = ["--set", "a=1", "b=2", "--seed", "3", "--set=c=4", "room", "--set", "d=5"]
    assert joined(words) == ["--seed", "3", "room", "--set", "a=1", "b=2", "c=4", "d=5"]
    assert settings(["a=1", "b=x", "a=1"]) == {"a": 1, "b": "x"}
    with pytest.raises(BadInputError, match=r"setting a must be given once.*got 2"):
        settings(["a=1", "a=2"])


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("active", Spec("", "", "active", ())),
        ("fast=active:err_threshold=0.5", Spec("fast", "", "active", ("err_threshold=0.5",))),
        ("'a, b:c'=random", Spec("a, b:c", "", "random", ())),
        ("my.module:Policy", Spec("", "my.module", "Policy", ())),
        ("module:Policy:a=1:b=x", Spec("", "module", "Policy", ("a=1", "b=x"))),
        ("mine=runs/lr=1,s=0/own.py:Policy", Spec("mine", "runs/lr=1,s=0/own.py", "Policy", ())),
        ("/x/12:30:00/own.py:Policy:gain=2", Spec("", "/x/12:30:00/own.py", "Policy", ("gain=2",))),
        (r"D:\my runs\own.py:Policy", Spec("", r"D:\my runs\own.py", "Policy", ())),
        ("'it is.py/a=b, c.py':Policy", Spec("", "it is.py/a=b, c.py", "Policy", ())),
        ("own.py", Spec("", "own.py", "", ())),
        ("active:Policy", Spec("", "", "active", ("Policy",))),
    ],
)
def test_every_form_is_read_and_written(text: str, parts: Spec) -> None:
    assert parse_spec(text, POLICIES) == parts
    assert parse_spec(parts.labelled, POLICIES) == parts


NAMES = st.text("ab1=:, ./-'\"\\", min_size=1).filter(lambda name: name.strip("./ ") != "")


@given(st.lists(NAMES, min_size=1, max_size=3))
def test_a_record_names_the_same_files_from_everywhere(names: list[str]) -> None:
    """Whatever signs a path has, what is written of it is read as the same file, in a list too."""
    specs = tuple(Spec(f"p{k}", f"/x/{name}.py", "Policy", ()) for k, name in enumerate(names))
    texts = [spec.labelled for spec in specs]
    assert recorded_specs(texts) == specs
    assert split_list(",".join(texts), POLICIES) == tuple(texts)
    trained = specs_of([f"p{k}=ppo:path={f'/x/{name}.npz'!r}" for k, name in enumerate(names)])
    again = split_list(",".join(spec.labelled for spec in trained), POLICIES)
    assert [parse_spec(text, POLICIES) for text in again] == list(trained)


def test_labels_are_as_short_as_they_can_be_apart() -> None:
    own = "a/own.py:P,b/own.py:P,other.py:P"
    found = specs_of(f"active,active:err_threshold=0.5,{own},x=random,ppo:path=r/p.npz")
    assert [spec.label for spec in found] == [
        *("active", "active:err_threshold=0.5", "a/own.py:P", "b/own.py:P", "other.py:P", "x"),
        "ppo:path=p.npz",
    ]


@pytest.mark.parametrize("twice", ["random,random", "a=random,a=active", "active=random,active"])
def test_a_label_stands_for_one_policy(twice: str) -> None:
    with pytest.raises(BadInputError, match="all different, or each with a label"):
        specs_of(twice)
