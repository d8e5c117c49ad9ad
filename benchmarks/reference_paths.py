"""Paths that another ray tracer found, read from files and compared with ours one to one.

Two formats: ``wifi-paths-2d/1``, paths in a room where nothing passes through walls or boxes,
and ``wifi-slab-2d/1``, lines of sight through a single thin wall. Materials are those of the file.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import linear_sum_assignment

from wifipgo.errors import BadInputError, pick, require
from wifipgo.files.text_files import read_json
from wifipgo.radio.propagation.materials import CARRIER_LIMITS_HZ, MATERIALS, Material, Slab
from wifipgo.radio.propagation.paths import Paths, Surfaces, surfaces_of, trace_paths
from wifipgo.se2 import wrap_angle

# Paths of equal order that differ by more than this are never the same one. A hundred times
# what is asked of ours, so that a wrong delay shows as a deviation and not only as a miss.
_SAME_DELAY_S = 1e-9
_SAME_AZIMUTH_RAD = np.deg2rad(1.0)
_CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


class PathList(NamedTuple):
    """Paths of many links in one list; columns as in `Paths`."""

    link: Int[np.ndarray, " paths"]
    order: Int[np.ndarray, " paths"]
    delay_s: Float[np.ndarray, " paths"]
    azimuth_rx_rad: Float[np.ndarray, " paths"]
    azimuth_tx_rad: Float[np.ndarray, " paths"]
    gain: np.ndarray


class Reference(NamedTuple):
    """A scene with links, and the paths that the other tracer found."""

    surfaces: Surfaces
    tx_m: Float[np.ndarray, "links 2"]
    rx_m: Float[np.ndarray, "links 2"]
    carrier_hz: float
    max_order: int
    penetration: bool
    known: PathList


class Agreement(NamedTuple):
    """Our paths beside known ones.

    Attributes:
        n_links: Links compared.
        known: Known paths of order 0, 1 and 2.
        ours: Our paths of order 0, 1 and 2.
        deviations: Ours minus known of every pair of paths taken as the same: azimuth at the
            receiver and at the transmitter (deg), delay (ns), gain (dB) and phase (deg).
    """

    n_links: int
    known: Int[np.ndarray, "3"]
    ours: Int[np.ndarray, "3"]
    deviations: Float[np.ndarray, "matched 5"]

    @property
    def matched(self) -> int:
        """Paths that are in both."""
        return len(self.deviations)

    @property
    def missed(self) -> int:
        """Known paths that are not among ours."""
        return int(self.known.sum()) - self.matched

    @property
    def extra(self) -> int:
        """Our paths that are not known."""
        return int(self.ours.sum()) - self.matched


def read_references(path: Path) -> list[Reference]:
    """Scenes of one file: one room, or one wall per case.

    Raises:
        ValueError: If the file is not what it should be; the message begins with its name.
    """
    content = read_json(path)
    try:
        return list(pick(_READERS, content["format"], "format")(content))
    except (ValueError, KeyError, TypeError, IndexError) as error:
        said = f"{error.args[0]!r} is missing" if isinstance(error, KeyError) else str(error)
        raise BadInputError(f"{path.name}: {said}") from error


def traced(reference: Reference) -> Paths:
    """Our paths of every link."""
    return trace_paths(
        reference.tx_m,
        reference.rx_m,
        reference.surfaces,
        carrier_hz=reference.carrier_hz,
        max_order=reference.max_order,
        penetration=reference.penetration,
    )


def compare(references: Sequence[Reference]) -> Agreement:
    """Trace the links of all scenes and match our paths with the known ones, each with at most one."""
    return joined([_compared(reference) for reference in references])


def joined(parts: Sequence[Agreement]) -> Agreement:
    """Several comparisons as one."""
    return Agreement(
        sum(part.n_links for part in parts),
        np.sum([part.known for part in parts], axis=0),
        np.sum([part.ours for part in parts], axis=0),
        np.concatenate([part.deviations for part in parts]),
    )


def _compared(reference: Reference) -> Agreement:
    paths, known = traced(reference), reference.known
    link, column = np.nonzero(paths.order >= 0)
    ours = PathList(
        link,
        paths.order[link, column],
        paths.delay_s[link, column],
        paths.azimuth_rx_rad[link, column],
        paths.azimuth_tx_rad[link, column],
        paths.gain[link, column],
    )
    pairs = [_matched(ours, known, link) for link in range(len(paths.order))]
    ours_row, known_row = np.concatenate([np.empty((2, 0), dtype=int), *pairs], axis=1)
    return Agreement(
        len(paths.order),
        np.bincount(known.order, minlength=3),
        np.bincount(ours.order, minlength=3),
        _deviations(
            PathList(*(values[ours_row] for values in ours)),
            PathList(*(values[known_row] for values in known)),
        ),
    )


def _matched(ours: PathList, known: PathList, link: int) -> Int[np.ndarray, "2 matched"]:
    """Rows of paths of one link that are the same: least sum of deviations among those allowed."""
    own, other = np.flatnonzero(ours.link == link), np.flatnonzero(known.link == link)
    delay = np.abs(ours.delay_s[own, None] - known.delay_s[other]) / _SAME_DELAY_S
    azimuth = np.abs(wrap_angle(ours.azimuth_rx_rad[own, None] - known.azimuth_rx_rad[other]))
    azimuth /= _SAME_AZIMUTH_RAD
    allowed = (delay < 1.0) & (azimuth < 1.0) & (ours.order[own, None] == known.order[other])
    row, column = linear_sum_assignment(np.where(allowed, delay + azimuth, 1e6))
    same = allowed[row, column]
    return np.stack([own[row[same]], other[column[same]]])


def _deviations(ours: PathList, known: PathList) -> Float[np.ndarray, "paths 5"]:
    """See `Agreement.deviations`."""
    ratio = ours.gain / known.gain
    return np.stack(
        [
            np.rad2deg(wrap_angle(ours.azimuth_rx_rad - known.azimuth_rx_rad)),
            np.rad2deg(wrap_angle(ours.azimuth_tx_rad - known.azimuth_tx_rad)),
            1e9 * (ours.delay_s - known.delay_s),
            20.0 * np.log10(np.abs(ratio)),
            np.angle(ratio, deg=True),
        ],
        axis=1,
    )


def _room(content: Mapping[str, Any]) -> Iterator[Reference]:
    """A room with boxes in ``wifi-paths-2d/1``."""
    walls, boxes, pairs = content["room"]["walls"], content["boxes"], content["pairs"]
    surfaces = surfaces_of(
        np.array([[wall["from_m"], wall["to_m"]] for wall in walls], dtype=float).reshape(-1, 2, 2),
        [np.array(box["centre_m"]) + np.array(box["half_extents_m"]) * _CORNERS for box in boxes],
        carrier_hz=content["carrier_hz"],
        wall=[_slab(wall, content) for wall in walls],
        obstacle=[_slab(box, content) for box in boxes],
    )
    max_order = min(int(content["max_order"]), 2)
    rows = [
        (link, path["order"], path["delay_s"], path["azimuth_rx_rad"], path["azimuth_tx_rad"], _gain(path))
        for link, pair in enumerate(pairs)
        for path in pair["paths"]
        if path["order"] <= max_order
    ]
    tx_m, rx_m = (
        np.array([pair[end] for pair in pairs], dtype=float).reshape(-1, 2) for end in ("tx_m", "rx_m")
    )
    yield Reference(surfaces, tx_m, rx_m, content["carrier_hz"], max_order, False, _path_list(rows))


def _walls(content: Mapping[str, Any]) -> Iterator[Reference]:
    """Every case of ``wifi-slab-2d/1``: a line of sight through one face, which bends no ray."""
    carrier_hz, wall = content["carrier_hz"], content["wall"]
    for case in content["cases"]:
        slab = _slab(case, content)
        surfaces = Surfaces(
            ends_m=np.array([[wall["from_m"], wall["to_m"]]], dtype=float),
            permittivity=np.array([slab.permittivity(carrier_hz)]),
            thickness_m=np.array([slab.thickness_m], dtype=float),
            n_walls=0,
        )
        tx_m, rx_m = np.array([case["tx_m"]], dtype=float), np.array([case["rx_m"]], dtype=float)
        arrives, leaves = np.arctan2(*(tx_m - rx_m)[0, ::-1]), np.arctan2(*(rx_m - tx_m)[0, ::-1])
        row = (0, 0, case["delay_s"], arrives, leaves, _gain(case, "gain_through_wall"))
        yield Reference(surfaces, tx_m, rx_m, carrier_hz, 0, True, _path_list([row]))


_READERS = {"wifi-paths-2d/1": _room, "wifi-slab-2d/1": _walls}


def _slab(place: Mapping[str, Any], content: Mapping[str, Any]) -> Slab:
    """Slab of a wall, box or case, of the material that the file describes or, failing that, of our table."""
    name, carrier_hz = place["material"], float(content["carrier_hz"])
    constants = content.get("materials", {}).get(name)
    material = pick(MATERIALS, name, "material") if constants is None else None
    if constants is not None:
        lowest_hz, highest_hz = CARRIER_LIMITS_HZ
        within = lowest_hz <= carrier_hz <= highest_hz
        require(within, "carrier_hz", f"in {lowest_hz:g}..{highest_hz:g}", carrier_hz)
        a, b, c, d = (float(constants[key]) for key in "abcd")
        material = Material(a, b, c, d, lowest_hz=carrier_hz, highest_hz=carrier_hz)
    return Slab(material or name, float(place["thickness_m"]))


def _gain(path: Mapping[str, Any], key: str = "gain") -> complex:
    gain = complex(path[f"{key}_re"], path[f"{key}_im"])
    require(gain != 0.0 and np.isfinite(gain), key, "finite and not 0", gain)
    return gain


def _path_list(rows: Sequence[tuple[int, int, float, float, float, complex]]) -> PathList:
    """Columns of known paths."""
    columns = list(zip(*rows, strict=True)) or [()] * 6
    link, order = (np.array(column, dtype=int) for column in columns[:2])
    require(bool(((order >= 0) & (order <= 2)).all()), "order", "0, 1 or 2", order.tolist())
    delay_s, arrives, leaves = (np.array(column, dtype=float) for column in columns[2:5])
    finite = np.isfinite(delay_s).all() and np.isfinite(arrives).all() and np.isfinite(leaves).all()
    require(finite, "delay_s and azimuths", "finite", columns[2:5])
    return PathList(link, order, delay_s, arrives, leaves, np.array(columns[5], dtype=complex))
