"""A policy that is told the truth, as an upper bound for others; its name says so."""

from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from baselines.policies.motions import Uniform
from baselines.policies.observation_view import View
from baselines.policies.rendezvous import Callers
from baselines.policies.steering import step_towards
from baselines.policies.triggers import err_above
from wifipgo.scenarios import Scenario


@runtime_checkable
class Oracle(Protocol):
    """What a policy must have to be shown the truth; whoever runs it does so before each `act`.

    One that drives the teams of many worlds is shown the poses of all, ``(worlds, robots, 3)``.
    """

    def see_truth(self, poses: Float[np.ndarray, "*worlds robots 3"]) -> None:
        """Take note of the true poses."""


class OracleBearing(Callers):
    """The paper's policy, but the called robot knows the true direction of its caller instead of hearing it.

    Args:
        scenario: Gives the layout of the observations.
        err_threshold: Threshold of Algorithm 2 in units of the scenario's.
    """

    def __init__(self, scenario: Scenario, *, err_threshold: float = 1.0) -> None:
        """Compose."""
        self._poses: np.ndarray | None = None
        super().__init__(scenario, Uniform(), err_above(err_threshold))
        self._sensor_steps = 0.5 * scenario.sensing.sensor_range_m / scenario.arena.step_m
        self._step_m = scenario.arena.step_m

    def see_truth(self, poses: Float[np.ndarray, "*worlds robots 3"]) -> None:
        """Take note of the true poses of one team, or of the teams of all worlds."""
        self._poses = poses.reshape(-1, *poses.shape[-2:])

    def _come(self, view: View, slot: np.ndarray, comes: np.ndarray, free_steps: np.ndarray) -> np.ndarray:
        """Straight to the nearest robot, which is the caller where there are two, until well in range."""
        if self._poses is None:
            raise RuntimeError("an oracle must be shown the truth before it acts: see_truth()")
        poses, n = self._poses, self._poses.shape[1]
        gap_m = poses[:, None, :, :2] - poses[:, :, None, :2]
        away_m = np.hypot(gap_m[..., 0], gap_m[..., 1]) + np.diag(np.full(n, np.inf))
        world, robot = np.indices(away_m.shape[:2])
        towards_m = gap_m[world, robot, away_m.argmin(axis=2)].reshape(-1, 2)
        bearing = np.arctan2(towards_m[:, 1], towards_m[:, 0]) - poses[..., 2].ravel()
        length = np.clip(away_m.min(axis=2).ravel() / self._step_m - self._sensor_steps, 0.0, 1.0)
        return step_towards(np.angle(np.exp(1j * bearing)), length, free_steps, np.zeros(len(length)))[0]
