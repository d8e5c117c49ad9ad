"""Robots drive, and believe what odometry says about it."""

import numpy as np
from jaxtyping import Float

from wifipgo import se2
from wifipgo.graph.covariance import propagate_covariance
from wifipgo.graph.edges import Edges
from wifipgo.loop.scene import scene_of
from wifipgo.rows import Chance
from wifipgo.scenarios.scenario import Scenario
from wifipgo.state import Paths, Truth, World
from wifipgo.world.coverage import reveal
from wifipgo.world.sensing import indices, odometry, odometry_sigmas

_NEXT = np.array([0, 1])  # from (robot, index) to the next pose


def drive(
    truth: Truth,
    waypoints: Float[np.ndarray, "rows 2"],
    *,
    world: World,
    scenario: Scenario,
    rng: Chance,
) -> tuple[Truth, Float[np.ndarray, "rows 3"]]:
    """Drive every robot to its waypoint, or as far as it gets.

    Returns:
        Truth after the drive, and what odometry says that the motion was.
    """
    before = truth.poses[:, -1]
    driven = world.arena.drive(before, waypoints)
    n_worlds = len(before) // scenario.n_robots
    motion = odometry(before, driven.poses, cfg=scenario.sensing, rng=rng, n_worlds=n_worlds)
    p_m = driven.poses[:, :2]
    after = Truth(
        poses=np.concatenate([truth.poses, driven.poses[:, None]], axis=1),
        collisions=truth.collisions + driven.bumped,
        distance_m=truth.distance_m + se2.length(p_m - before[:, :2]),
        cells=reveal(
            truth.cells, p_m, scene_of(world, truth).faces_m, range_m=scenario.sensing.sensor_range_m
        ),
    )
    return after, motion


def dead_reckon(paths: Paths, motion: Float[np.ndarray, "rows 3"], scenario: Scenario) -> tuple[Paths, Edges]:
    """Append the pose that odometry suggests, and propagate its covariance.

    Returns:
        The longer paths, and the odometry as measurements, which are in no log yet.
    """
    tail, n_worlds = indices(np.arange(len(motion)), paths.t), len(motion) // scenario.n_robots
    sigma = odometry_sigmas(scenario.sensing, motion, n_worlds=n_worlds, stated=True)
    before = paths.estimate[:, -1]
    now = se2.compose(before, motion)
    both = np.concatenate([paths.covariance[None], paths.predicted_covariance[None, :, -1]])
    covariance, predicted = propagate_covariance(both, before, now, sigma)
    longer = paths._replace(
        estimate=_appended(paths.estimate, now),
        covariance=covariance,
        covariance_history=_appended(paths.covariance_history, covariance),
        predicted_covariance=_appended(paths.predicted_covariance, predicted),
    )
    return longer, Edges.measured(tail=tail, head=tail + _NEXT, z=motion, sigma=sigma)


def _appended(history: Float[np.ndarray, "rows times *item"], now: np.ndarray) -> np.ndarray:
    return np.concatenate([history, now[:, None]], axis=1)
