"""What stands where now, as sensors, engine and radio each look at it."""

from collections.abc import Sequence

import numpy as np

from wifipgo.radio.propagation.materials import Slab
from wifipgo.radio.propagation.paths import surfaces_of
from wifipgo.scenarios.scenario import Scenario
from wifipgo.state import Scene, Truth, World
from wifipgo.world.layout import Layout, padded


def first_scene(layouts: Sequence[Layout], scenario: Scenario) -> Scene:
    """The scene of some layouts, one a world."""
    cfg, layout = scenario.arena, layouts[0]
    faces_m = [one.faces_m for one in layouts]
    edges_m = [np.concatenate([one.walls_m, own]) for one, own in zip(layouts, faces_m, strict=True)]
    surfaces = surfaces_of(
        layout.walls_m,
        layout.obstacles_m,
        carrier_hz=scenario.radio.carrier_hz,
        wall=Slab(cfg.wall_material, cfg.wall_thickness_m),
        obstacle=Slab(cfg.obstacle_material, cfg.obstacle_thickness_m),
    )
    return Scene(padded(faces_m), padded(edges_m), surfaces)


def scene_of(world: World, truth: Truth) -> Scene:
    """The scene at a tick: that of the layout, the same object, as nothing but robots moves."""
    return world.scene
