"""The paper's experiments as values; what is ours in each is said in its source."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from wifipgo.graph.config import GraphConfig
from wifipgo.radio.aoa.estimators import AoaConfig
from wifipgo.radio.channel.csi import RadioConfig
from wifipgo.scenarios.scenario import Scenario
from wifipgo.world.layout import ArenaConfig
from wifipgo.world.sensing import SensingConfig

PAPER_HW_2 = Scenario(
    name="paper-hw-2",
    source=(
        "Paper Sec. 7.2: 2 robots, 50 iterations, 0.2 m and 5 deg, antennas 22 cm apart. Sec. 7.1.2 for the "
        "threshold of 10, step of 2 and sensor range of 2.2. Ours: room of 20 x 20, transmit power, q, kappa."
    ),
    sensing=SensingConfig(sigma_t_m=0.2, sigma_r_rad=float(np.deg2rad(5.0))),
    radio=RadioConfig(tx_power_dbm=-12.0),
)
PAPER_HW_2_OBSTACLES = replace(
    PAPER_HW_2,
    name="paper-hw-2-obstacles",
    source=PAPER_HW_2.source + " Four obstacles as in Sec. 7.2.2; their size, place and material are ours.",
    arena=ArenaConfig(n_obstacles=4),
)
_DARK = " Low light as in Fig. 9: cameras see nothing."
PAPER_HW_2_DARK = replace(
    PAPER_HW_2, name="paper-hw-2-dark", source=PAPER_HW_2.source + _DARK, visual_range_m=0.0
)
PAPER_HW_2_OBSTACLES_DARK = replace(
    PAPER_HW_2_OBSTACLES,
    name="paper-hw-2-obstacles-dark",
    source=PAPER_HW_2_OBSTACLES.source + _DARK,
    visual_range_m=0.0,
)
PAPER_HW_2_HETERO = replace(
    PAPER_HW_2,
    name="paper-hw-2-hetero",
    source=PAPER_HW_2.source + " Heterogeneous noise as in the caption of Fig. 7; the factors are ours.",
    sensing=replace(PAPER_HW_2.sensing, noise_scale=(1.0 / 3.0, 3.0)),
)
PAPER_SIM_2 = replace(
    PAPER_HW_2,
    name="paper-sim-2",
    source="The noise of Sec. 7.1.2 (0.1 m, 3 deg) with two robots. Ours: as in paper-hw-2.",
    sensing=SensingConfig(),
)
PAPER_SIM_50 = Scenario(
    name="paper-sim-50",
    source=(
        "Paper Sec. 7.1.2: 50 robots, 50 iterations, 0.1 m and 3 deg, threshold 10, step 2, sensor range "
        "2.2. Ours: room of 60 x 60, transmit power, q, kappa, 3 slots, 32 packets a turn."
    ),
    n_robots=50,
    n_slots=3,
    arena=ArenaConfig(size_m=60.0),
    radio=RadioConfig(tx_power_dbm=-4.0),
    turn=AoaConfig(n_positions=32),
)
PAPER_SIM_200 = replace(
    PAPER_SIM_50,
    name="paper-sim-200",
    source="paper-sim-50 with 200 robots in a room of the same density, 120 x 120. Ours.",
    n_robots=200,
    arena=ArenaConfig(size_m=120.0),
)
PAPER_SIM_1000 = replace(
    PAPER_SIM_50,
    name="paper-sim-1000",
    source="paper-sim-50 with 1000 robots in a room of the same density, 268 x 268. Ours.",
    n_robots=1000,
    arena=ArenaConfig(size_m=268.0),
)
PAPER_OUTLIERS = replace(
    PAPER_HW_2,
    name="paper-outliers",
    source=(
        "Paper Sec. 7.3: outliers of 2 to 3 sigma, until 9 relative poses, AOA gate of 7.2 deg. Ours: one in "
        "three is an outlier; the rest as in paper-hw-2."
    ),
    max_measurements=9,
    sensing=replace(PAPER_HW_2.sensing, outlier_share=1.0 / 3.0),
    graph=GraphConfig(outliers="paper"),
)

PAPER: Mapping[str, Scenario] = MappingProxyType(
    {
        scenario.name: scenario
        for scenario in (
            PAPER_HW_2,
            PAPER_HW_2_OBSTACLES,
            PAPER_HW_2_DARK,
            PAPER_HW_2_OBSTACLES_DARK,
            PAPER_HW_2_HETERO,
            PAPER_SIM_2,
            PAPER_SIM_50,
            PAPER_SIM_200,
            PAPER_SIM_1000,
            PAPER_OUTLIERS,
        )
    }
)
