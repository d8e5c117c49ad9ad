"""Worlds that adapters to frameworks are tried on: past the ends of episodes, in a few steps."""

from typing import Any

KINDS: dict[str, dict[str, Any]] = {
    "small": {"scenario": "paper-sim-2", "size_m": 4.0, "n_steps": 4},
    "ends of their own": {"scenario": "paper-sim-2", "size_m": 4.0, "max_measurements": 3},
    "choices": {"scenario": "paper-hw-2-obstacles", "n_steps": 3, "actions": "discrete"},
}
