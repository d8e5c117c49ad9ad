"""Image method in the plane: where a ray between two points can be reflected once or twice.

Reflection points, length and incidence follow from the height of both ends of a link over
a face and their positions along it (`Surfaces`). The line of sight counts as a face whose
images are the points themselves.

In the working arrays the first axis is the end of the link (0 transmitter, 1 receiver), the
second the coordinate; links or rays come last, which is what makes them fast.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from wifipgo.radio.propagation.surfaces import Surfaces

# Pairs of faces times links looked at in one go: working arrays of 256 kB stay in the cache.
_BLOCK = 1 << 15


class Rays(NamedTuple):
    """Candidate paths of equally many bounces in one flat list, sorted by link.

    Attributes:
        link: Link that each belongs to.
        face: Lines of `Surfaces` that it bounces off, from the transmitter on; 0 is the line of sight.
        legs_m: Direction of each leg, as long as the whole path. The first is the way from the
            transmitter to the image of the receiver, the last that from the receiver to the
            image of the transmitter.
        hit_m: Where it meets each face; halfway on the line of sight.
        cos_incidence: Of the angle between ray and normal at each hit.
        length_m: Length of the whole path.
    """

    link: Int[np.ndarray, " rays"]
    face: Int[np.ndarray, "bounces rays"]
    legs_m: Float[np.ndarray, "legs 2 rays"]
    hit_m: Float[np.ndarray, "bounces 2 rays"]
    cos_incidence: Float[np.ndarray, "bounces rays"]
    length_m: Float[np.ndarray, " rays"]

    def only(self, kept: Int[np.ndarray, " kept"]) -> "Rays":
        """Some of the rays."""
        return Rays(*(column.take(kept, axis=-1) for column in self))


def single_bounces(
    ends: Float[np.ndarray, "2 3 links"],
    height_m: Float[np.ndarray, "2 lines links"],
    surfaces: Surfaces,
    *,
    reflect: bool,
) -> Rays:
    """Every line of sight and, if wanted, every single reflection that exists if nothing stands in the way.

    A face reflects when both ends are in front of it and the straight line from one end
    to the image of the other passes between the ends of the face.
    """
    along_m, sum_m = surfaces.to_along @ ends, height_m[0] + height_m[1]
    weighted = along_m[0] * height_m[1] + along_m[1] * height_m[0]  # position of the hit, times sum_m
    exists = (weighted >= 0.0) & (weighted < surfaces.length_m[:, None] * sum_m)
    exists &= (height_m[0] > 0.0) & (height_m[1] > 0.0)
    exists[1:] &= reflect
    link, face = np.divmod(np.flatnonzero(exists.T), len(exists))
    up_m = height_m.reshape(2, -1).take(face * ends.shape[-1] + link, axis=1)
    both_up_m = up_m[0] + up_m[1]
    gap_m, normal = (ends[1, :2] - ends[0, :2]).take(link, axis=1), surfaces.normal.take(face, axis=1)
    legs_m = np.empty((2, 2, len(link)))
    np.subtract(gap_m, 2.0 * up_m[1] * normal, out=legs_m[0])
    np.subtract(-2.0 * up_m[0] * normal, gap_m, out=legs_m[1])
    length_m = np.sqrt(legs_m[0, 0] ** 2 + legs_m[0, 1] ** 2)
    hit_m = ends[0, :2].take(link, axis=1) + up_m[0] / both_up_m * legs_m[0]
    return Rays(link, face[None], legs_m, hit_m[None], (both_up_m / length_m)[None], length_m)


def double_bounces(
    ends: Float[np.ndarray, "2 3 links"],
    height_m: Float[np.ndarray, "2 lines links"],
    surfaces: Surfaces,
) -> Rays:
    """Every double reflection that exists if nothing stands in the way.

    Seen from each face, the far end of the link is its image in the other face; each bounce
    is then a single one, and the ray has to meet the first face before the second.
    """
    pairs, n_links = surfaces.pairs, ends.shape[-1]
    along_m = surfaces.to_along @ ends
    exists = np.empty((len(pairs.first), n_links), dtype=bool)
    step = max(1, _BLOCK // max(1, n_links))
    for begin in range(0, len(exists), step):
        block = slice(begin, begin + step)
        exists[block] = _reflected_twice(along_m, height_m, surfaces, block)
    link, pair = np.divmod(np.flatnonzero(exists.T), len(exists))
    face = np.stack([pairs.first.take(pair), pairs.second.take(pair)])
    up_m = height_m.reshape(2, -1)
    up_m = np.stack([up_m[end].take(face[end] * n_links + link) for end in (0, 1)])  # each over its own face
    normals = surfaces.normal.take(face, axis=1).swapaxes(0, 1)
    tx_m, rx_m = ends[0, :2].take(link, axis=1), ends[1, :2].take(link, axis=1)
    middle_m = rx_m - tx_m + 2.0 * (up_m[0] * normals[0] - up_m[1] * normals[1])
    climb_m = (middle_m * normals).sum(axis=1)  # up from the first face, down to the second
    first_m = middle_m - 2.0 * climb_m[0] * normals[0]
    last_m = 2.0 * climb_m[1] * normals[1] - middle_m
    length_m = np.sqrt(middle_m[0] ** 2 + middle_m[1] ** 2)
    incline_m = np.stack([climb_m[0], -climb_m[1]])
    share = up_m / incline_m
    hit_m = np.stack([tx_m + share[0] * first_m, rx_m + share[1] * last_m])
    legs_m = np.stack([first_m, middle_m, last_m])
    return Rays(link, face, legs_m, hit_m, incline_m / length_m, length_m)


def _reflected_twice(
    along_m: Float[np.ndarray, "2 lines links"],
    height_m: Float[np.ndarray, "2 lines links"],
    surfaces: Surfaces,
    block: slice,
) -> np.ndarray:
    """Which pairs of faces reflect which links, for one block of pairs."""
    pairs = surfaces.pairs
    first, second = pairs.first[block], pairs.second[block]
    near_first, near_second = height_m[0].take(first, axis=0), height_m[1].take(second, axis=0)
    tilt = pairs.tilt[block]
    far_first = height_m[1].take(first, axis=0) - tilt * near_second  # of the receiver's image in the second
    far_second = height_m[0].take(second, axis=0) - tilt * near_first
    exists = (near_first > 0.0) & (near_second > 0.0) & (far_first > 0.0) & (far_second > 0.0)
    exists &= near_first * near_second < far_first * far_second  # first face first
    for line, end, near, far, mirrored, slant in (
        (first, 0, near_first, far_first, near_second, pairs.slant_first[block]),
        (second, 1, near_second, far_second, near_first, pairs.slant_second[block]),
    ):
        far_along_m = along_m[1 - end].take(line, axis=0) - slant * mirrored
        weighted = along_m[end].take(line, axis=0) * far + far_along_m * near
        exists &= (weighted >= 0.0) & (weighted < surfaces.length_m[line, None] * (near + far))
    return exists
