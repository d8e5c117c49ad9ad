"""Which faces of a static scene can reflect into each other; worked out once."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

# A face has to rise above another by more than rounding to be in front of it.
_CLEAR_M = 1e-9


class FacePairs(NamedTuple):
    """Ordered pairs of faces, as lines of a scene, of which a path can meet one and then the other.

    With unit normals ``n`` and directions ``d``, mirroring in one face changes heights over
    the other and positions along it by fixed shares of the height over the mirror.

    Attributes:
        first: Line that is met first.
        second: Line that is met next.
        tilt: ``2 n_first . n_second``.
        slant_first: ``2 d_first . n_second``.
        slant_second: ``2 d_second . n_first``.
    """

    first: Int[np.ndarray, "pairs worlds"]
    second: Int[np.ndarray, "pairs worlds"]
    tilt: Float[np.ndarray, "pairs worlds"]
    slant_first: Float[np.ndarray, "pairs worlds"]
    slant_second: Float[np.ndarray, "pairs worlds"]


def face_pairs(
    ends_m: Float[np.ndarray, "faces 2 2"],
    to_along: Float[np.ndarray, "lines 3"],
    to_height: Float[np.ndarray, "lines 3"],
) -> FacePairs:
    """Pairs of which each is at least partly in front of the other."""
    points = np.concatenate([ends_m.reshape(-1, 2), np.ones((2 * len(ends_m), 1))], axis=1)
    height_m = (to_height[1:] @ points.T).reshape(len(ends_m), -1, 2).max(axis=2, initial=-np.inf)
    first, second = np.nonzero((height_m > _CLEAR_M) & (height_m.T > _CLEAR_M))
    direction, normal = to_along[1:, :2], to_height[1:, :2]

    def twice_dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return 2.0 * (a * b).sum(axis=1, keepdims=True)

    return FacePairs(
        (first + 1)[:, None],
        (second + 1)[:, None],
        tilt=twice_dot(normal[first], normal[second]),
        slant_first=twice_dot(direction[first], normal[second]),
        slant_second=twice_dot(direction[second], normal[first]),
    )
