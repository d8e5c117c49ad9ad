"""The paper as a library: world, radio and graph, joined by one loop.

The names below are the face; everything else is found in the module that it belongs to.
"""

from wifipgo.errors import RecordingError, UnknownNameError
from wifipgo.graph import Edges, ate_rot, ate_trans, residual_error, solve
from wifipgo.loop import advance, start
from wifipgo.radio.aoa import AoaConfig, bartlett_profiles, find_peaks
from wifipgo.radio.propagation.paths import surfaces_of, trace_paths
from wifipgo.scenarios import SCENARIOS, Scenario, scenario_named
from wifipgo.state import Belief, Commands, Tick, Truth
from wifipgo.streams import Streams

__all__ = [
    "SCENARIOS",
    "AoaConfig",
    "Belief",
    "Commands",
    "Edges",
    "RecordingError",
    "Scenario",
    "Streams",
    "Tick",
    "Truth",
    "UnknownNameError",
    "advance",
    "ate_rot",
    "ate_trans",
    "bartlett_profiles",
    "find_peaks",
    "residual_error",
    "scenario_named",
    "solve",
    "start",
    "surfaces_of",
    "trace_paths",
]
