"""The scene of a layout: each obstacle is of its own material, in turn."""

import numpy as np
import pytest

from wifipgo.errors import BadInputError
from wifipgo.loop.scene import first_scene
from wifipgo.radio.propagation.paths import Paths, trace_paths
from wifipgo.scenarios import scenario_named
from wifipgo.world.placing import random_layout

BOXES = tuple(((x, 4.0), (x + 1.0, 4.0), (x + 1.0, 5.0), (x, 5.0)) for x in (2.0, 8.0, 14.0))
ACROSS = np.array([[x + 0.5, 2.0] for x in (2.0, 8.0, 14.0)])


def straight_through(**changes: object) -> Paths:
    """The line of sight through each of the three boxes."""
    scenario = scenario_named("paper-hw-2", obstacles_m=BOXES, starts=((1, 1, 0), (1, 8, 0)), **changes)
    layout = random_layout(2, scenario.arena, rng=np.random.default_rng(0))
    scene = first_scene([layout], scenario)
    return trace_paths(
        ACROSS,
        ACROSS + np.array([0.0, 5.0]),
        scene.surfaces,
        carrier_hz=scenario.radio.carrier_hz,
        max_order=0,
    )


def test_obstacles_are_of_the_materials_in_turn() -> None:
    """Through the k-th of them as through one of a room in which all are so; the third is as the first."""
    mixed = straight_through(obstacle_materials=("brick", "wood"), obstacle_thicknesses_m=(0.1, 0.02))
    brick = straight_through(obstacle_material="brick", obstacle_thickness_m=0.1)
    wood = straight_through(obstacle_material="wood", obstacle_thickness_m=0.02)
    assert mixed.gain[1, 0] == wood.gain[1, 0] != brick.gain[1, 0]
    np.testing.assert_array_equal(mixed.gain[[0, 2]], brick.gain[[0, 2]])
    one_thickness = straight_through(obstacle_materials=("wood",), obstacle_thickness_m=0.02)
    np.testing.assert_array_equal(one_thickness.gain, wood.gain)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"obstacle_materials": ("wood", "cheese")}, r"ArenaConfig.obstacle_materials\[1\] 'cheese'"),
        ({"obstacle_thicknesses_m": (0.1,)}, "obstacle_thicknesses_m must be empty or as long as"),
        ({"obstacle_materials": ("wood",), "obstacle_thicknesses_m": (0.0,)}, "must be all in 1e-06..10"),
        ({"diffuse_power_of": "air"}, "unknown diffuse_power_of 'air'"),
    ],
)
def test_what_is_no_material_is_refused(changes: dict[str, object], named: str) -> None:
    with pytest.raises(BadInputError, match=named):
        scenario_named("paper-hw-2", **changes)
