"""The paper as a library: world, radio and graph, joined by one loop.

The names below are the face: a scenario, its loop, and the errors of what comes out. Each wing has a
face of its own (`wifipgo.world`, `wifipgo.radio`, `wifipgo.graph`); everything else is found in the
module that it belongs to.
"""

from typing import TYPE_CHECKING

import wifipgo.command.early_interrupts  # noqa: F401 (first: what follows takes long to load)
from wifipgo.errors import BadInputError, NumericalError
from wifipgo.former_names import answer_to_former_names, of_face
from wifipgo.graph.edges import Edges
from wifipgo.graph.metrics import ate_rot, ate_trans, residual_error
from wifipgo.graph.solvers import solve
from wifipgo.loop import advance, start
from wifipgo.scenarios import SCENARIOS, Scenario, scenario_named
from wifipgo.state import Belief, Commands, Tick, Truth
from wifipgo.streams import Streams
from wifipgo.version import version

__all__ = [
    "SCENARIOS",
    "BadInputError",
    "Belief",
    "Commands",
    "Edges",
    "NumericalError",
    "Scenario",
    "Streams",
    "Tick",
    "Truth",
    "advance",
    "ate_rot",
    "ate_trans",
    "residual_error",
    "scenario_named",
    "solve",
    "start",
]

__version__ = version()

answer_to_former_names()
if not TYPE_CHECKING:
    __getattr__ = of_face(__name__)
