"""Benchmarks of rendezvous: causes of calls that failed, what q decides, and refusals."""

import pytest

from benchmarks.algorithm_1 import CallsConfig, calls_of, ended
from benchmarks.where_q_binds import BindsConfig, played
from wifipgo.errors import BadInputError
from wifipgo.scenarios import scenario_named


def test_a_failed_call_has_the_cause_of_most_of_its_iterations() -> None:
    like = ["misled"] * 6 + ["slow"] * 3 + ["unheard"]
    assert ended(like, met=False) == {
        "met": False,
        "cause": "misled",
        "iterations": 10,
        "unheard": 0.1,
        "misled": 0.6,
        "slow": 0.3,
    }
    assert ended(like, met=True)["cause"] == ""


def test_ten_worlds_or_no_table() -> None:
    for config in (CallsConfig, BindsConfig):
        with pytest.raises(BadInputError, match="worlds must be >= 10"):
            config(worlds=9)


def test_a_robot_that_nobody_hears_has_only_calls_that_failed_unheard() -> None:
    deaf = scenario_named("radio-hard", tx_power_dbm=-60.0, err_threshold=1e-6, n_steps=16)
    calls = calls_of(deaf, 0)
    assert calls
    assert {call["cause"] for call in calls} == {"unheard"}


def test_with_two_robots_in_a_room_of_the_paper_q_decides_nothing() -> None:
    few, many = (played(scenario_named("paper-hw-2", q_mbit_s=q), "active", 4) for q in (6.5, 58.5))
    assert few == many
    assert few.meetings > 0
