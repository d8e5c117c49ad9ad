"""The paper as a library: world, radio and graph, joined by one loop.

The names below are the face: a scenario, its loop, and the errors of what comes out. Each wing has a
face of its own (`wifipgo.world`, `wifipgo.radio`, `wifipgo.graph`); everything else is found in the
module that it belongs to. What a name needs is loaded when it is asked for.
"""

from typing import TYPE_CHECKING

import wifipgo.command.early_interrupts  # noqa: F401 (first: what follows may take long to load)
from wifipgo.command.own_packages import explain_shadows
from wifipgo.former_names import answer_to_former_names
from wifipgo.lazy_face import face

if TYPE_CHECKING:
    from wifipgo.data import example_data
    from wifipgo.errors import BadInputError, NumericalError
    from wifipgo.graph.edges import Edges
    from wifipgo.graph.metrics import ate_rot, ate_trans, residual_error
    from wifipgo.graph.solvers import solve
    from wifipgo.loop import advance, start
    from wifipgo.scenarios import SCENARIOS, Scenario, scenario_named
    from wifipgo.state import Belief, Commands, Tick, Truth
    from wifipgo.streams import Streams

    __version__: str

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
    "example_data",
    "residual_error",
    "scenario_named",
    "solve",
    "start",
]

answer_to_former_names()
explain_shadows()
if not TYPE_CHECKING:
    __getattr__, __dir__ = face(
        __name__,
        {
            "SCENARIOS": "scenarios",
            "BadInputError": "errors",
            "Belief": "state",
            "Commands": "state",
            "Edges": "graph.edges",
            "NumericalError": "errors",
            "Scenario": "scenarios",
            "Streams": "streams",
            "Tick": "state",
            "Truth": "state",
            "__version__": "version",
            "advance": "loop",
            "ate_rot": "graph.metrics",
            "ate_trans": "graph.metrics",
            "example_data": "data",
            "residual_error": "graph.metrics",
            "scenario_named": "scenarios",
            "solve": "graph.solvers",
            "start": "loop",
        },
    )
