"""Scenarios that a test can play one after the other: those of hundreds of robots have tests of their own."""

from wifipgo.scenarios import SCENARIOS

SMALL_TEAMS = [name for name, scenario in SCENARIOS.items() if scenario.n_robots <= 50]
