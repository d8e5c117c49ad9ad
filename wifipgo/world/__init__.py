"""World wing: arena, obstacles, what robots sense of them.

A `Layout` is drawn by `random_layout`, an `Arena` drives robots in it, `scan` and `observe_robots` say
what they sense, and a `CellMap` keeps what they have seen.
"""

from wifipgo.world.arena import Arena
from wifipgo.world.coverage import CellMap, reveal
from wifipgo.world.coverage_belief import CoverageBelief
from wifipgo.world.layout import ArenaConfig, Layout, room_walls
from wifipgo.world.lidar import scan
from wifipgo.world.map_accuracy import MapAccuracy, updated_map_accuracy
from wifipgo.world.map_checks import gap_to_obstacles
from wifipgo.world.placing import random_layout
from wifipgo.world.sensing import (
    RelativePoses,
    SensingConfig,
    measure_loop_closures,
    observe_robots,
    odometry,
)

__all__ = [
    "Arena",
    "ArenaConfig",
    "CellMap",
    "CoverageBelief",
    "Layout",
    "MapAccuracy",
    "RelativePoses",
    "SensingConfig",
    "gap_to_obstacles",
    "measure_loop_closures",
    "observe_robots",
    "odometry",
    "random_layout",
    "reveal",
    "room_walls",
    "scan",
    "updated_map_accuracy",
]
