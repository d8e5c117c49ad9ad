"""Scenarios that a test can play one after the other: those of hundreds of robots have tests of their own."""

from wifipgo.scenarios import SCENARIOS

SMALL_TEAMS = [name for name, scenario in SCENARIOS.items() if scenario.n_robots <= 50]
# One of each kind: with others of two robots they share all but noise, light or length.
KINDS = ["paper-hw-2", "paper-hw-2-obstacles", "paper-sim-50", "paper-outliers"]
assert set(KINDS) <= set(SMALL_TEAMS)
