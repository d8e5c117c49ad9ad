"""What stands where now, as sensors, engine and radio each look at it."""

from collections.abc import Sequence

import numpy as np

from wifipgo.radio.propagation.materials import Slab
from wifipgo.radio.propagation.scenes import Scenes
from wifipgo.radio.propagation.surfaces import Surfaces, surfaces_of
from wifipgo.scenarios.scenario import Scenario
from wifipgo.state import Scene, Truth, World
from wifipgo.world.layout import ArenaConfig, Layout, padded


def first_scene(layouts: Sequence[Layout], scenario: Scenario) -> Scene:
    """The scene of some layouts, one a world."""
    faces_m = [one.faces_m for one in layouts]
    edges_m = [np.concatenate([one.walls_m, own]) for one, own in zip(layouts, faces_m, strict=True)]
    return Scene(padded(faces_m), padded(edges_m), scenes_of(layouts, scenario))


def scenes_of(layouts: Sequence[Layout], scenario: Scenario) -> Surfaces | Scenes:
    """The layouts of several worlds as the radio sees them: one scene for all where they are alike."""
    if all(_alike(layout, layouts[0]) for layout in layouts[1:]):
        return _surfaces_of(layouts[0], scenario)
    return Scenes.of([_surfaces_of(layout, scenario) for layout in layouts])


def _surfaces_of(layout: Layout, scenario: Scenario) -> Surfaces:
    """A layout as the radio sees it."""
    cfg = scenario.arena
    return surfaces_of(
        layout.walls_m,
        layout.obstacles_m,
        carrier_hz=scenario.radio.carrier_hz,
        wall=Slab(cfg.wall_material, cfg.wall_thickness_m),
        obstacle=_obstacle_slabs(len(layout.obstacles_m), cfg),
    )


def _obstacle_slabs(count: int, cfg: ArenaConfig) -> Slab | list[Slab]:
    """What obstacles are made of: one slab for all, or the materials in turn."""
    if not cfg.obstacle_materials:
        return Slab(cfg.obstacle_material, cfg.obstacle_thickness_m)
    materials = cfg.obstacle_materials
    thickness_m = cfg.obstacle_thicknesses_m or (cfg.obstacle_thickness_m,) * len(materials)
    slabs = [Slab(*both) for both in zip(materials, thickness_m, strict=True)]
    return [slabs[k % len(slabs)] for k in range(count)]


def _alike(a: Layout, b: Layout) -> bool:
    """Whether the same stands in two rooms."""
    if len(a.obstacles_m) != len(b.obstacles_m) or not np.array_equal(a.walls_m, b.walls_m):
        return False
    return all(np.array_equal(*corners) for corners in zip(a.obstacles_m, b.obstacles_m, strict=True))


def scene_of(world: World, truth: Truth) -> Scene:
    """The scene at a tick: that of the layout, the same object, as nothing but robots moves."""
    return world.scene
