"""What happens in every world of a batch, iteration by iteration, as arrays over all of them."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int, Shaped

from envs.rendezvous_v0 import RendezvousVectorEnv
from wifipgo.rendezvous import NOBODY
from wifipgo.state import Tick, World
from wifipgo.world.layout import Layout

Steps = Mapping[str, Shaped[np.ndarray, "iterations robots"]]
_OF_INFOS = {
    "err": "err",
    "ate_trans": "ate_trans_truth",
    "ate_rot": "ate_rot_truth",
    "mapped_share": "mapped_share_truth",
    "coverage": "coverage_truth",
    "bumps": "bumps_truth",
    "distance_m": "distance_m_truth",
}
# Columns of steps.parquet, in this order.
_COLUMNS = (
    *("err", "ate_trans", "ate_rot", "x_true_m", "y_true_m", "yaw_true_rad"),
    *("x_estimate_m", "y_estimate_m", "yaw_estimate_rad", "mapped_share", "coverage", "met", "calling"),
    *("bumps", "distance_m"),
)


class Now(NamedTuple):
    """Where everybody is and who calls, in all worlds; poses as believed at this time."""

    true: Float[np.ndarray, "worlds robots 3"]
    believed: Float[np.ndarray, "worlds robots 3"]
    calling: Bool[np.ndarray, "worlds robots"]

    @classmethod
    def of(cls, env: RendezvousVectorEnv) -> "Now":
        """As the worlds stand."""
        world, (truth, belief) = _together(env)
        true, believed = truth.poses[:, -1], belief.paths.estimate[:, -1]
        calling = belief.team.calls.callee != NOBODY
        return cls(*map(world.rows.by_world, (true, believed, calling)))


class End(NamedTuple):
    """One world when it ended.

    Attributes:
        reference: True trajectories.
        estimate: As the robots believe them.
        bytes_sent: Over all links.
        airtime_s: Of messages of a back-end that sends any.
        layout: Walls and obstacles.
    """

    reference: Float[np.ndarray, "robots times 3"]
    estimate: Float[np.ndarray, "robots times 3"]
    bytes_sent: int
    airtime_s: float
    layout: Layout

    @classmethod
    def of(cls, env: RendezvousVectorEnv, k: int) -> "End":
        """As world ``k`` stands."""
        world, (truth, belief) = _together(env)
        true, believed = (world.rows.by_world(x)[k].copy() for x in (truth.poses, belief.paths.estimate))
        team = belief.team
        sent, airtime_s = int(team.bytes_sent[k]), float(team.airtime_s[k])
        return cls(true, believed, sent, airtime_s, world.layouts[k])


def _together(env: RendezvousVectorEnv) -> tuple[World, Tick]:
    """All worlds as one: they began together."""
    (cohort,) = env.cohorts
    return cohort.episode.world, cohort.episode.tick


class Recording:
    """Every robot of every world after each iteration, and who met where.

    Attributes:
        n_done: Iterations of each world.
    """

    def __init__(self, n_worlds: int, n_steps: int) -> None:
        """Begin, with room for so many iterations."""
        self.n_done = np.zeros(n_worlds, dtype=np.int64)
        self._n_steps, self._t = n_steps, 0
        self._columns: dict[str, np.ndarray] = {}
        self._met: list[Float[np.ndarray, "meetings 4"]] = []

    def add(self, now: Now, infos: Mapping[str, np.ndarray], live: Bool[np.ndarray, " worlds"]) -> None:
        """Take down an iteration; ``live`` are the worlds that were not over before it."""
        met = infos["met"]
        row = {name: infos[key] for name, key in _OF_INFOS.items()}
        row |= dict(zip(("x_true_m", "y_true_m", "yaw_true_rad"), np.moveaxis(now.true, -1, 0), strict=True))
        believed = ("x_estimate_m", "y_estimate_m", "yaw_estimate_rad")
        row |= dict(zip(believed, np.moveaxis(now.believed, -1, 0), strict=True))
        row |= {"met": np.asarray(met.any(axis=2)), "calling": now.calling}
        for name in _COLUMNS:
            self._column(name, row[name])[:, self._t] = row[name]
        self._t += 1
        self.n_done += live
        self._met.append(_meetings(met & live[:, None, None], now.true, self._t))

    def _column(self, name: str, like: np.ndarray) -> Shaped[np.ndarray, "worlds iterations robots"]:
        """Room for a column of all iterations, of the kind of the first."""
        if name not in self._columns:
            shape = (len(like), self._n_steps, like.shape[1])
            self._columns[name] = np.zeros(shape, dtype=like.dtype)
        return self._columns[name]

    def steps(self, world: int) -> Steps:
        """All iterations of one world."""
        n = self.n_done[world]
        return {name: self._columns[name][world, :n].copy() for name in _COLUMNS}

    def meetings(self, world: int) -> Float[np.ndarray, "meetings 3"]:
        """Iteration, x and y (m) of the middle of each group of one world that met."""
        found = np.concatenate([np.zeros((0, 4)), *self._met])
        return found[found[:, 0] == world, 1:]


def _meetings(
    met: Bool[np.ndarray, "worlds robots robots"], true: Float[np.ndarray, "worlds robots 3"], t: int
) -> Float[np.ndarray, "meetings 4"]:
    """World, iteration and true middle of each group: its robots all met each other."""
    world, robot = np.nonzero(met.any(axis=2))
    first = np.minimum(met[world, robot].argmax(axis=1), robot)  # of its group
    groups, group = np.unique(np.stack([world, first], axis=1), axis=0, return_inverse=True)
    middle = [_mean_of(group.ravel(), true[world, robot, axis], len(groups)) for axis in (0, 1)]
    return np.stack([groups[:, 0], np.full(len(groups), float(t)), *middle], axis=1)


def _mean_of(
    group: Int[np.ndarray, " members"], values: Float[np.ndarray, " members"], n_groups: int
) -> Float[np.ndarray, " groups"]:
    size = np.bincount(group, minlength=n_groups)
    return np.bincount(group, weights=values, minlength=n_groups) / size
