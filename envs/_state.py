"""The state of the team as a centralised critic sees it: the truth among it, all of it bounded.

Each entry is scaled as in the observation, so a network needs no statistics of its own.
"""

import numpy as np
from gymnasium import spaces
from jaxtyping import Float

from wifipgo.radio.channel.bands import band_of
from wifipgo.scenarios import Scenario
from wifipgo.state import Tick

# Of a robot, in this order: x, y of the true pose (size_m), cosine and sine of its yaw; the same of the
# estimate; Err (err_threshold). An entry beyond its bound is cut to it.
_LOW = np.array([-1.0, -1.0, -1.0, -1.0, -1.0, -1.0, -1.0, -1.0, 0.0])
_HIGH = np.array([2.0, 2.0, 1.0, 1.0, 2.0, 2.0, 1.0, 1.0, 10.0])


def state_space(n_robots: int) -> spaces.Box:
    """Nine numbers a robot, then the rates of all links as shares of the top rate."""
    low, high = (
        np.concatenate([np.tile(limits, n_robots), np.full(n_robots**2, rate)], dtype=np.float32)
        for limits, rate in ((_LOW, 0.0), (_HIGH, 1.0))
    )
    return spaces.Box(low, high, dtype=np.float32)


def state(tick: Tick, scenario: Scenario) -> Float[np.ndarray, "worlds numbers"]:
    """Of each world robot by robot, then all link rates, row by row; float32."""
    truth, belief, size_m = tick.truth, tick.belief, scenario.arena.size_m
    own = [*_pose(truth.poses[:, -1], size_m), *_pose(belief.paths.estimate[:, -1], size_m)]
    err = belief.err / scenario.rendezvous.err_threshold
    robots = np.minimum(np.maximum(np.stack([*own, err], axis=1), _LOW), _HIGH)
    rates = belief.radio.rate_mbit_s / band_of(scenario.radio.bandwidth_hz).top_rate_mbit_s
    each = (part.reshape(-1, scenario.n_robots * part.shape[1]) for part in (robots, rates))
    return np.concatenate(list(each), axis=1, dtype=np.float32, casting="same_kind")


def _pose(pose: Float[np.ndarray, "robots 3"], size_m: float) -> Float[np.ndarray, "4 robots"]:
    return np.stack([pose[:, 0] / size_m, pose[:, 1] / size_m, np.cos(pose[:, 2]), np.sin(pose[:, 2])])
