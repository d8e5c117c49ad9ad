"""Pairs of robots of each world, and the paths between them."""

import functools
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int, Shaped

from wifipgo.radio.propagation.diffuse_scattering import Diffuse, with_diffuse
from wifipgo.radio.propagation.edge_rays import edge_views
from wifipgo.radio.propagation.image_method import Ends
from wifipgo.radio.propagation.link_ends import Points, check_apart, checked_points
from wifipgo.radio.propagation.materials import SPEED_OF_LIGHT_M_S
from wifipgo.radio.propagation.passing_bodies import behind_bodies
from wifipgo.radio.propagation.paths import Paths, Traced, columns_of, paths_of, traced
from wifipgo.radio.propagation.ray_gains import Medium
from wifipgo.rows import Rows


class Pairs(NamedTuple):
    """Pairs of each world, and where they are in a table ``(rows, peers)``.

    Attributes:
        low: Row of the lower robot.
        high: Row of the higher robot of the same world.
        place: Flat places of each pair in the table: seen from the lower, and from the higher.
    """

    low: Int[np.ndarray, " pairs"]
    high: Int[np.ndarray, " pairs"]
    place: Int[np.ndarray, "2 pairs"]

    @classmethod
    def of(cls, low: Int[np.ndarray, " pairs"], high: Int[np.ndarray, " pairs"], rows: Rows) -> "Pairs":
        """Pairs from both their rows."""
        n = rows.n_robots
        return cls(low, high, np.stack([low * n + rows.peer(high), high * n + rows.peer(low)]))

    def table(
        self, values: Shaped[np.ndarray, " pairs"], other: float, rows: Rows
    ) -> Shaped[np.ndarray, "rows peers"]:
        """Values of pairs as a symmetric table, with another value where there is no pair."""
        out = np.full((len(rows), rows.n_robots), other, dtype=values.dtype)
        out.reshape(-1)[self.place] = values
        return out


@functools.lru_cache(maxsize=8)
def all_pairs(rows: Rows) -> tuple[Pairs, Int[np.ndarray, "rows peers"]]:
    """Every pair of every world, world by world, and the table that finds them; 0 where none is."""
    first, second = np.triu_indices(rows.n_robots, 1)
    base = rows.n_robots * np.arange(rows.n_worlds)[:, None]
    pairs = Pairs.of((base + first).ravel(), (base + second).ravel(), rows)
    row = pairs.table(np.arange(len(pairs.low)), 0.0, rows)
    for array in (*pairs, row):
        array.setflags(write=False)
    return pairs, row


class Clutter(NamedTuple):
    """What the tracer does not know: scatterers, and where people are; None without."""

    diffuse: Diffuse | None
    bodies_m: Float[np.ndarray, "worlds bodies 2"] | None

    def __bool__(self) -> bool:
        """Whether there is any."""
        return self.diffuse is not None or self.bodies_m is not None


class TracedPairs:
    """Pairs in a medium. Directions of paths, which cost as much as the rest, come only where asked for."""

    def __init__(self, points: Points, pairs: Pairs, medium: Medium, clutter: Clutter) -> None:
        """Take pairs between points that were checked."""
        self.pairs, self.medium = pairs, medium
        self._points, self._clutter = points, clutter
        self._views = edge_views(points, medium) if medium.diffraction else None
        self._whole: Traced | None = None

    @classmethod
    def between(
        cls,
        p_m: Float[np.ndarray, "rows 2"],
        pairs: Pairs,
        *,
        rows: Rows,
        medium: Medium,
        clutter: Clutter,
    ) -> "TracedPairs":
        """Pairs of robots at these places."""
        world = rows.world(np.arange(len(p_m)))
        return cls(
            checked_points(p_m, world, medium.scenes, lambda k: ("p_m", f"robot {k}")), pairs, medium, clutter
        )

    def columns(
        self, block: slice
    ) -> tuple[Complex[np.ndarray, "paths block"], Float[np.ndarray, "paths block"]]:
        """Gain and delay of the paths of some pairs, paths first."""
        if self._clutter:
            paths = self._among_clutter(self._traced(block))
            return paths.gain.T, paths.delay_s.T
        found = self._traced(block)
        if found.ends.n_links == len(self.pairs.low):
            self._whole = found
        gain, length_m = columns_of(found)
        return gain, length_m * (1.0 / SPEED_OF_LIGHT_M_S)

    @functools.cached_property
    def paths(self) -> Paths:
        """Paths of all pairs, one row each."""
        return self._among_clutter(self._whole or self._traced(slice(None)))

    def some(self, chosen: Int[np.ndarray, " links"]) -> Paths:
        """Paths of some pairs, each of which may be asked for more than once."""
        once, place = np.unique(chosen, return_inverse=True)
        return self._among_clutter(self._traced(once)).only(place)

    def _traced(self, chosen: slice | Int[np.ndarray, " some"]) -> Traced:
        low, high = self.pairs.low[chosen], self.pairs.high[chosen]
        ends = Ends.of(self._points.some(low), self._points.some(high))
        check_apart(ends.gap_m, ends.tx.at_m, lambda k: ("p_m", f"robots {low[k]} and {high[k]}"))
        views = self._views
        return traced(ends, self.medium, None if views is None else (views.some(low), views.some(high)))

    def _among_clutter(self, found: Traced) -> Paths:
        """Rays as rows, with what comes over scatterers, and without what people stop."""
        paths, ends = paths_of(found, self.medium), found.ends
        (diffuse, bodies_m), carrier_hz = self._clutter, self.medium.carrier_hz
        tx_m, rx_m, world = ends.tx.at_m.T, ends.rx.at_m.T, ends.tx.world
        if diffuse is not None:
            # Sums over paths go on by eights, so what follows the padding is added alike in any company.
            paths = with_diffuse(paths.padded(8), tx_m, rx_m, diffuse, carrier_hz=carrier_hz, world=world)
        if bodies_m is not None:
            paths = behind_bodies(paths, tx_m, rx_m, bodies_m[world], carrier_hz=carrier_hz)
        return paths
