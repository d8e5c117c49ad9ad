"""Scenarios in which the radio decides: as hard as recordings, and harder. All of it is ours.

Values and what they were chosen by: ``docs/channel.md``, "As hard as the recordings".
"""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from wifipgo.radio.channel.impairments import ImpairmentConfig
from wifipgo.radio.channel.rates import LinkConfig
from wifipgo.scenarios.paper import PAPER_HW_2
from wifipgo.scenarios.scenario import Scenario
from wifipgo.world.layout import ArenaConfig

_REAL_RADIO = replace(
    PAPER_HW_2.radio, max_order=2, diffraction=True, front_to_back_db=3.0, antenna_coupling=0.04
)
_REAL_IMPAIRMENTS = ImpairmentConfig(
    packet_loss=0.1,
    diffuse_ratio=0.7,
    diffuse_power_of="obstructed",
    diffuse_spread_rad=0.09,
    esnr_sigma_db=2.0,
    n_bodies=3,
)
_CABINET_M = ((0.0, 8.5), (0.4, 8.5), (0.4, 11.0), (0.0, 11.0))
_STEEL_M = 0.003

RADIO_REAL_2 = replace(
    PAPER_HW_2,
    name="radio-real-2",
    source=(
        "Rules, noise and room of paper-hw-2. Ours: a radio whose errors of direction are as large as those "
        "of recordings; walls of concrete, a cabinet of steel, lost packets, three people who walk about."
    ),
    radio=_REAL_RADIO,
    impairments=_REAL_IMPAIRMENTS,
    arena=ArenaConfig(
        obstacles_m=(_CABINET_M,),
        obstacle_material="metal",
        obstacle_thickness_m=_STEEL_M,
        lidar_sigma_m=0.03,
    ),
)
RADIO_REAL_2_OBSTACLES = replace(
    RADIO_REAL_2,
    name="radio-real-2-obstacles",
    source=(
        "Rules and noise of paper-hw-2, radio of radio-real-2. Ours: four boxes of wood, brick, plasterboard "
        "and steel, which bend and scatter."
    ),
    arena=ArenaConfig(
        n_obstacles=4,
        obstacle_max_m=2.0,
        obstacle_materials=("wood", "brick", "plasterboard", "metal"),
        obstacle_thicknesses_m=(0.03, 0.05, 0.025, _STEEL_M),
        lidar_sigma_m=0.03,
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
        "Rules, noise and room of paper-hw-2. Ours: twelve boxes of steel, two reflections, bent paths: "
        "behind a box the strongest path leads elsewhere, and Algorithm 1 may not arrive."
    ),
    radio=replace(PAPER_HW_2.radio, max_order=2, diffraction=True),
    arena=ArenaConfig(n_obstacles=12, obstacle_material="metal", obstacle_thickness_m=_STEEL_M),
)

LINK_BINDS = replace(
    PAPER_HW_2,
    name="link-binds",
    source=(
        "Rules and noise of paper-hw-2. Ours: with each pose goes an image of 640 x 480 pixels, which takes "
        "bytes over rate, a second of each iteration; robots see each other 8 m off, and at -20 dBm 39 Mb/s "
        "reach 3 m: q says how near they come before they exchange (Eq. 1)."
    ),
    sensing=replace(PAPER_HW_2.sensing, sensor_range_m=8.0),
    radio=replace(PAPER_HW_2.radio, tx_power_dbm=-20.0),
    link=LinkConfig(exchange_s=1.0, image_bytes=640 * 480 * 3),
)

RADIO: Mapping[str, Scenario] = MappingProxyType(
    {
        scenario.name: scenario
        for scenario in (RADIO_REAL_2, RADIO_REAL_2_OBSTACLES, RADIO_REAL_10, RADIO_HARD, LINK_BINDS)
    }
)
