"""Scenarios: the paper's experiments as values, and one's own from files."""

from wifipgo.errors import UnknownNameError
from wifipgo.scenarios.lookup import scenario_from, scenario_named, scenario_toml
from wifipgo.scenarios.named import SCENARIOS
from wifipgo.scenarios.scenario import Scenario, field_kinds, field_owners, part_types

__all__ = [
    "SCENARIOS",
    "Scenario",
    "UnknownNameError",
    "field_kinds",
    "field_owners",
    "part_types",
    "scenario_from",
    "scenario_named",
    "scenario_toml",
]
