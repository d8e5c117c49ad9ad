"""Pictures between two iterations: robots drive there instead of jumping."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from envs.render.scene import Scene
from wifipgo.se2 import wrap_angle


def in_between(before: Scene, after: Scene, n: int) -> Iterator[Scene]:
    """Scenes on the way from one iteration to the next, none of the two included.

    Robots drive straight; what they believe moves as they will believe to have moved. All else, a
    meeting that ended or a call that is up, stays as it was: what the next iteration finds, nobody knows yet.

    Args:
        before: An iteration.
        after: The next one.
        n: How many.
    """
    true, believed = after.true[:, -1] - before.true[:, -1], _believed_step(before, after)
    for k in range(1, n + 1):
        share = k / (n + 1)
        estimate = _extended(before.estimate, share * believed)
        shift_m = (estimate[:, -1] - before.estimate[:, -1])[:, None, :2]
        yield replace(
            before,
            true=_extended(before.true, share * _wrapped(true)),
            estimate=estimate,
            rings_m=before.rings_m + shift_m,
            under_way=True,
        )


def _believed_step(before: Scene, after: Scene) -> Float[np.ndarray, "robots 3"]:
    """Step from where robots believed to be, as it will look in what they believe then, turned with them."""
    if after.estimate.shape[1] < 2:
        return np.zeros_like(before.estimate[:, -1])
    step = after.estimate[:, -1] - after.estimate[:, -2]
    turned_rad = before.estimate[:, -1, 2] - after.estimate[:, -2, 2]
    c, s = np.cos(turned_rad), np.sin(turned_rad)
    x, y = c * step[:, 0] - s * step[:, 1], s * step[:, 0] + c * step[:, 1]
    return _wrapped(np.stack([x, y, step[:, 2]], axis=1))


def _wrapped(step: Float[np.ndarray, "robots 3"]) -> Float[np.ndarray, "robots 3"]:
    """The same with the shorter turn."""
    return np.concatenate([step[:, :2], wrap_angle(step[:, 2:])], axis=1)


def _extended(
    poses: Float[np.ndarray, "robots times 3"], step: Float[np.ndarray, "robots 3"]
) -> Float[np.ndarray, "robots more 3"]:
    """Trajectories with one more pose, a step from the last."""
    return np.concatenate([poses, (poses[:, -1] + step)[:, None]], axis=1)
