"""All scenarios that have names: the paper's, and those in which the radio decides."""

from collections.abc import Mapping
from types import MappingProxyType

from wifipgo.scenarios.paper import PAPER
from wifipgo.scenarios.radio import RADIO
from wifipgo.scenarios.scenario import Scenario

SCENARIOS: Mapping[str, Scenario] = MappingProxyType({**PAPER, **RADIO})
