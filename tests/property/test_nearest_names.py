"""A misspelt name is told the one that was meant, beside the list of all; never a guess between two."""

import pickle
from collections.abc import Iterable

import pytest

from baselines.policies import POLICIES
from envs.rendezvous_v0 import REWARDS
from wifipgo.command.front import SUBCOMMANDS
from wifipgo.errors import UnknownNameError, nearest, pick
from wifipgo.scenarios import SCENARIOS, field_owners

TABLES: dict[str, Iterable[str]] = {
    "commands": SUBCOMMANDS,
    "fields": field_owners(),
    "policies": POLICIES,
    "rewards": REWARDS,
    "scenarios": SCENARIOS,
}


def misspelt(name: str) -> set[str]:
    """A name without its third letter, with two exchanged, with one twice, and in capitals."""
    return {name[:2] + name[3:], name[0] + name[2] + name[1] + name[3:], name[:3] + name[2:], name.upper()}


@pytest.mark.parametrize("table", TABLES)
def test_one_slip_is_told_the_name(table: str) -> None:
    known = list(TABLES[table])
    for name in known:
        for wrong in misspelt(name) - set(known):
            assert len(name) < 5 or nearest(wrong, known) == name, wrong


@pytest.mark.parametrize(
    ("wrong", "known"),
    [
        ("robot_2", ["robot_0", "robot_1"]),  # as near to one as to the other
        ("sonar", ["flat", "rays"]),
        ("", ["flat"]),
        ("flat", []),
        (0, ["robot_0"]),
        (["flat"], ["flat"]),
    ],
)
def test_nothing_is_guessed(wrong: object, known: list[str]) -> None:
    assert nearest(wrong, known) == ""
    assert "did you mean" not in str(UnknownNameError("name", wrong, known))


def test_the_hint_follows_the_list_and_travels() -> None:
    with pytest.raises(UnknownNameError) as refusal:
        pick(dict.fromkeys(["active", "random"]), "activ", "policy")
    said = "unknown policy 'activ'; known: active, random; did you mean 'active'?"
    assert str(refusal.value) == str(pickle.loads(pickle.dumps(refusal.value))) == said


def test_long_names_cost_little() -> None:
    """What a file may hold is cut before it is compared: this would take minutes."""
    assert nearest("x" * 1_000_000, ["y" * 1_000_000, "flat"]) == ""
