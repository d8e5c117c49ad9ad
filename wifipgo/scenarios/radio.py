"""Scenarios in which the radio decides: as hard as recordings, and harder. All of it is ours.

Values and what they were chosen by: ``docs/channel.md``, "As hard as the recordings".
"""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from wifipgo.radio.channel.impairments import ImpairmentConfig
from wifipgo.scenarios.paper import PAPER_HW_2
from wifipgo.scenarios.scenario import Scenario
from wifipgo.world.layout import ArenaConfig

_REAL_RADIO = replace(PAPER_HW_2.radio, max_order=2, diffraction=True)
_REAL_IMPAIRMENTS = ImpairmentConfig(
    packet_loss=0.1, diffuse_ratio=0.55, diffuse_power_of="obstructed", diffuse_spread_rad=0.08
)
# Furniture, partitions of bricks and of plasterboard, a cabinet of steel sheet.
_FURNITURE = ("wood", "brick", "plasterboard", "metal")
_FURNITURE_M = (0.03, 0.05, 0.025, 0.003)

RADIO_REAL_2 = replace(
    PAPER_HW_2,
    name="radio-real-2",
    source=(
        "Rules, noise and room of paper-hw-2. Ours: a radio whose errors of direction are as large as those "
        "of recordings; walls of concrete, two reflections, lost packets."
    ),
    radio=_REAL_RADIO,
    impairments=_REAL_IMPAIRMENTS,
)
RADIO_REAL_2_OBSTACLES = replace(
    RADIO_REAL_2,
    name="radio-real-2-obstacles",
    source=RADIO_REAL_2.source
    + " Four boxes of wood, brick, plasterboard and steel, bent and scattered paths.",
    arena=ArenaConfig(
        n_obstacles=4,
        obstacle_max_m=2.0,
        obstacle_materials=_FURNITURE,
        obstacle_thicknesses_m=_FURNITURE_M,
    ),
)
RADIO_REAL_10 = replace(
    RADIO_REAL_2_OBSTACLES,
    name="radio-real-10",
    source=RADIO_REAL_2_OBSTACLES.source + " Ten robots, three slots.",
    n_robots=10,
    n_slots=3,
)
RADIO_HARD = replace(
    PAPER_HW_2,
    name="radio-hard",
    source=(
        "Rules, noise and room of paper-hw-2. Ours: eight boxes of steel sheet, two reflections, bent paths: "
        "behind a box the strongest path leads elsewhere, and Algorithm 1 may not arrive."
    ),
    radio=_REAL_RADIO,
    arena=ArenaConfig(n_obstacles=8, obstacle_material="metal", obstacle_thickness_m=0.003),
)

RADIO: Mapping[str, Scenario] = MappingProxyType(
    {
        scenario.name: scenario
        for scenario in (RADIO_REAL_2, RADIO_REAL_2_OBSTACLES, RADIO_REAL_10, RADIO_HARD)
    }
)
