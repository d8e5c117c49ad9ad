"""Image method in the plane: where a ray between two points can be reflected once or twice.

Length and incidence follow from the height of both ends of a link over a face and their positions along it.
The line of sight counts as a face whose images are the points themselves. Where a ray goes (`course_of`) is
only worked out where it is asked for.

In the working arrays the first axis is the end of the link (0 transmitter, 1 receiver), the
second the coordinate; links or rays come last, which is what makes them fast.
"""

import functools
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.radio.propagation.face_pairs import FacePairs
from wifipgo.radio.propagation.link_ends import Points
from wifipgo.radio.propagation.scenes import Scenes

# Pairs of faces times links looked at in one go: working arrays of 256 kB stay in the cache.
_BLOCK = 1 << 15


class Ends(NamedTuple):
    """Both ends of some links.

    Attributes:
        tx: Transmitters.
        rx: Receivers, in the same scenes.
        gap_m: From each transmitter to its receiver.
    """

    tx: Points
    rx: Points
    gap_m: Float[np.ndarray, "2 links"]

    @classmethod
    def of(cls, tx: Points, rx: Points) -> "Ends":
        """Links between these points."""
        return cls(tx, rx, rx.at_m - tx.at_m)

    @property
    def n_links(self) -> int:
        """How many."""
        return self.gap_m.shape[1]


class Rays(NamedTuple):
    """Candidate paths of equally many bounces in one flat list, by face and then by link.

    Attributes:
        link: Link that each belongs to.
        face: Lines of the scene that it bounces off, from the transmitter on; 0 is the line of sight.
        cos_incidence: Of the angle between ray and normal at each hit.
        length_m: Length of the whole path.
    """

    link: Int[np.ndarray, " rays"]
    face: Int[np.ndarray, "bounces rays"]
    cos_incidence: Float[np.ndarray, "bounces rays"]
    length_m: Float[np.ndarray, " rays"]

    def only(self, kept: Int[np.ndarray, " kept"]) -> "Rays":
        """Some of the rays."""
        return Rays(*(column.take(kept, axis=-1) for column in self))


class Course(NamedTuple):
    """Where rays go.

    Attributes:
        legs_m: Direction of each leg, as long as the whole path. The first is the way from the
            transmitter to the image of the receiver, the last that from the receiver to the
            image of the transmitter.
        hit_m: Where it meets each face; halfway on the line of sight.
    """

    legs_m: Float[np.ndarray, "legs 2 rays"]
    hit_m: Float[np.ndarray, "bounces 2 rays"]


def single_bounces(ends: Ends, scenes: Scenes, *, reflect: bool) -> Rays:
    """Every line of sight and, if wanted, every single reflection that exists if nothing stands in the way.

    A face reflects when both ends are in front of it and the straight line from one end
    to the image of the other passes between the ends of the face. Lines of sight come first.
    """
    n_lines = scenes.n_lines if reflect else 1
    tx_up, rx_up = ends.tx.height_m[:n_lines], ends.rx.height_m[:n_lines]
    tx_along, rx_along = ends.tx.along_m[:n_lines], ends.rx.along_m[:n_lines]
    both_up_m = tx_up + rx_up
    weighted = tx_along * rx_up + rx_along * tx_up  # position of the hit, times both_up_m
    length_m = scenes.by_world(scenes.length_m[:n_lines], ends.tx.world)
    exists = (weighted >= 0.0) & (weighted < length_m * both_up_m) & (np.minimum(tx_up, rx_up) > 0.0)
    square_m2, n_links = ends.gap_m[0] ** 2 + ends.gap_m[1] ** 2, ends.n_links
    if exists.all():
        link, face = every_ray(n_lines, n_links)
        longer_m2 = tx_up * rx_up
        longer_m2[0] = 0.0
        longer_m2 *= 4.0
        longer_m2 += square_m2
        path_m, both_up_m = np.sqrt(longer_m2).ravel(), both_up_m.ravel()
    else:
        face, place = np.repeat(np.arange(n_lines), np.count_nonzero(exists, axis=1)), np.flatnonzero(exists)
        link, both_up_m = place - face * n_links, both_up_m.ravel().take(place)
        longer_m2 = tx_up.ravel().take(place) * rx_up.ravel().take(place)
        longer_m2[:n_links] = 0.0
        longer_m2 *= 4.0
        longer_m2 += square_m2.take(link)
        path_m = np.sqrt(longer_m2)
    return Rays(link, face[None], (both_up_m / path_m)[None], path_m)


@functools.lru_cache(maxsize=16)
def every_ray(n_lines: int, n_links: int) -> tuple[Int[np.ndarray, " rays"], Int[np.ndarray, " rays"]]:
    """Link and line of each ray where every line reflects every link."""
    link, face = np.tile(np.arange(n_links), n_lines), np.repeat(np.arange(n_lines), n_links)
    for array in (link, face):
        array.setflags(write=False)
    return link, face


def double_bounces(ends: Ends, scenes: Scenes) -> Rays:
    """Every double reflection that exists if nothing stands in the way.

    Seen from each face, the far end of the link is its image in the other face; each bounce
    is then a single one, and the ray has to meet the first face before the second.
    """
    pairs = scenes.pairs_of(ends.tx.world)
    lengths_m = scenes.by_world(scenes.length_m, ends.tx.world)
    exists = np.empty((len(pairs.first), ends.n_links), dtype=bool)
    step = max(1, _BLOCK // max(1, ends.n_links))
    for begin in range(0, len(exists), step):
        block = FacePairs(*(column[begin : begin + step] for column in pairs))
        exists[begin : begin + step] = _reflected_twice(ends, lengths_m, block)
    pair, link = np.divmod(np.flatnonzero(exists), max(1, ends.n_links))
    own = link if scenes.n_worlds > 1 else np.zeros_like(link)
    face = np.stack([pairs.first[pair, own], pairs.second[pair, own]])
    unfolded = _unfolded(link, face, ends, scenes)
    middle_m, climb_m = unfolded.middle_m, unfolded.climb_m
    length_m = np.sqrt(middle_m[0] ** 2 + middle_m[1] ** 2)
    return Rays(link, face, np.stack([climb_m[0], -climb_m[1]]) / length_m, length_m)


def course_of(rays: Rays, ends: Ends, scenes: Scenes) -> Course:
    """Legs and hits of rays with one or two bounces."""
    return (_single_course if len(rays.face) == 1 else _double_course)(rays, ends, scenes)


def _up_m(rays_link: Int[np.ndarray, " rays"], line: Int[np.ndarray, " rays"], end: Points) -> np.ndarray:
    """Height of the ends of some links over one line each."""
    return end.height_m.ravel().take(line * end.height_m.shape[1] + rays_link)


def _single_course(rays: Rays, ends: Ends, scenes: Scenes) -> Course:
    link, line = rays.link, rays.face[0]
    tx_up, rx_up = (_up_m(link, line, end) for end in (ends.tx, ends.rx))
    gap_m, tx_m = ends.gap_m.take(link, axis=1), ends.tx.at_m.take(link, axis=1)
    normal = scenes.normal_at(scenes.at(line, scenes.of_some(ends.tx.world, link)))
    legs_m = np.empty((2, 2, len(link)))
    np.subtract(gap_m, 2.0 * rx_up * normal, out=legs_m[0])
    np.subtract(-2.0 * tx_up * normal, gap_m, out=legs_m[1])
    return Course(legs_m, (tx_m + tx_up / (tx_up + rx_up) * legs_m[0])[None])


class _Unfolded(NamedTuple):
    """A ray of two bounces drawn straight: up over each face, its middle leg, and how far that climbs."""

    up_m: Float[np.ndarray, "2 rays"]
    normals: Float[np.ndarray, "2 2 rays"]
    middle_m: Float[np.ndarray, "2 rays"]
    climb_m: Float[np.ndarray, "2 rays"]  # up from the first face, down to the second


def _unfolded(
    link: Int[np.ndarray, " rays"], face: Int[np.ndarray, "2 rays"], ends: Ends, scenes: Scenes
) -> _Unfolded:
    up_m = np.stack([_up_m(link, face[0], ends.tx), _up_m(link, face[1], ends.rx)])
    normals = scenes.normal_at(scenes.at(face, scenes.of_some(ends.tx.world, link))).swapaxes(0, 1)
    middle_m = ends.gap_m.take(link, axis=1) + 2.0 * (up_m[0] * normals[0] - up_m[1] * normals[1])
    return _Unfolded(up_m, normals, middle_m, (middle_m * normals).sum(axis=1))


def _double_course(rays: Rays, ends: Ends, scenes: Scenes) -> Course:
    up_m, normals, middle_m, climb_m = _unfolded(rays.link, rays.face, ends, scenes)
    tx_m, rx_m = (end.at_m.take(rays.link, axis=1) for end in (ends.tx, ends.rx))
    first_m = middle_m - 2.0 * climb_m[0] * normals[0]
    last_m = 2.0 * climb_m[1] * normals[1] - middle_m
    share = up_m / np.stack([climb_m[0], -climb_m[1]])
    hit_m = np.stack([tx_m + share[0] * first_m, rx_m + share[1] * last_m])
    return Course(np.stack([first_m, middle_m, last_m]), hit_m)


def _reflected_twice(
    ends: Ends, length_m: Float[np.ndarray, "lines #links"], pairs: FacePairs
) -> Bool[np.ndarray, "pairs links"]:
    """Which pairs of faces reflect which links, for one block of pairs."""
    first, second = pairs.first, pairs.second
    near_first, near_second = _rows(ends.tx.height_m, first), _rows(ends.rx.height_m, second)
    far_first = _rows(ends.rx.height_m, first) - pairs.tilt * near_second  # of its image in the second
    far_second = _rows(ends.tx.height_m, second) - pairs.tilt * near_first
    exists = (near_first > 0.0) & (near_second > 0.0) & (far_first > 0.0) & (far_second > 0.0)
    exists &= near_first * near_second < far_first * far_second  # first face first
    for line, near_end, far_end, near, far, mirrored, slant in (
        (first, ends.tx, ends.rx, near_first, far_first, near_second, pairs.slant_first),
        (second, ends.rx, ends.tx, near_second, far_second, near_first, pairs.slant_second),
    ):
        far_along_m = _rows(far_end.along_m, line) - slant * mirrored
        weighted = _rows(near_end.along_m, line) * far + far_along_m * near
        exists &= (weighted >= 0.0) & (weighted < _rows(length_m, line) * (near + far))
    return exists


def _rows(
    table: Float[np.ndarray, "lines #links"], line: Int[np.ndarray, "pairs #links"]
) -> Float[np.ndarray, "pairs #links"]:
    """Rows of a table: the same for all links, or each link's own."""
    if line.shape[1] == 1:
        return table.take(line[:, 0], axis=0)
    n = line.shape[1]
    return np.broadcast_to(table, (len(table), n)).ravel().take(line * n + np.arange(n))
