"""Files of paths that another ray tracer found.

Formats: ``wifi-paths-2d/1``, paths in a room where nothing passes through walls or boxes;
``wifi-paths-2d/2``, the same with paths that bend at an edge; ``wifi-wedge-2d/1``, two faces that meet
at an edge in open space; ``wifi-slab-2d/1``, lines of sight through a single thin wall. Materials are
those of the file.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int

from wifipgo.errors import BadInputError, pick, require
from wifipgo.files.text_files import read_json
from wifipgo.radio.propagation.materials import (
    CARRIER_LIMITS_HZ,
    MATERIALS,
    SPEED_OF_LIGHT_M_S,
    Material,
    Slab,
)
from wifipgo.radio.propagation.paths import DIFFRACTED, Surfaces, surfaces_of

_CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
# Link, order, delay, azimuths at receiver and transmitter, gain.
_Row = tuple[int, int, float, float, float, complex]
# Faces of a wedge, whose other ends are left out.
_FACE_M = 60.0


class PathList(NamedTuple):
    """Paths of many links in one list; columns as in `Paths`."""

    link: Int[np.ndarray, " paths"]
    order: Int[np.ndarray, " paths"]  # `DIFFRACTED` over an edge
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
    diffraction: bool
    known: PathList


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


def _room(content: Mapping[str, Any]) -> Iterator[Reference]:
    """A room with boxes in ``wifi-paths-2d/1`` or ``/2``."""
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
        (link, _order(path), path["delay_s"], path["azimuth_rx_rad"], path["azimuth_tx_rad"], _gain(path))
        for link, pair in enumerate(pairs)
        for path in pair["paths"]
        if path["order"] <= max_order
    ]
    tx_m, rx_m = (
        np.array([pair[end] for pair in pairs], dtype=float).reshape(-1, 2) for end in ("tx_m", "rx_m")
    )
    diffraction = bool(content.get("max_diffractions", 0))
    known = _path_list(rows)
    yield Reference(surfaces, tx_m, rx_m, content["carrier_hz"], max_order, False, diffraction, known)


def _order(path: Mapping[str, Any]) -> int:
    """Number of reflections, or that there is a diffraction instead."""
    return DIFFRACTED if path.get("kind") == "diffraction" else path["order"]


def _wedges(content: Mapping[str, Any]) -> Iterator[Reference]:
    """Every case of ``wifi-wedge-2d/1``; of delays and directions the file says nothing but the geometry."""
    carrier_hz, edge_m = content["carrier_hz"], np.array(content["wedge"]["edge_m"], dtype=float)
    for case in content["cases"]:
        slab, tx_m = _slab(case, content), np.array(case["tx_m"], dtype=float)
        surfaces = Surfaces(
            ends_m=np.array([edge_m + _FACE_M * _face(case[name]) for name in ("face_0", "face_n")]),
            permittivity=np.full(2, slab.permittivity(carrier_hz)),
            thickness_m=np.full(2, slab.thickness_m),
            n_walls=0,
        )
        rx_m = np.array([position["rx_m"] for position in case["positions"]], dtype=float).reshape(-1, 2)
        rows = [
            row
            for link, position in enumerate(case["positions"])
            for row in _wedge_paths(link, position, case, tx_m - edge_m, rx_m[link] - edge_m)
        ]
        tx_m = np.tile(tx_m, (len(rx_m), 1))
        yield Reference(surfaces, tx_m, rx_m, carrier_hz, 1, False, True, _path_list(rows))


def _face(face: Mapping[str, Any]) -> Float[np.ndarray, "2 2"]:
    """Ends of a face, one of them at the edge, with its front on the right."""
    away = np.array(face["direction_from_edge"], dtype=float)
    begins = away[1] * face["normal"][0] - away[0] * face["normal"][1] > 0.0
    return np.array([0.0 * away, away] if begins else [away, 0.0 * away])


def _wedge_paths(
    link: int, position: Mapping[str, Any], case: Mapping[str, Any], tx_m: np.ndarray, rx_m: np.ndarray
) -> Iterator[_Row]:
    """Those of one receiver that the file has; places from the edge."""
    ways_m = {
        "gain_los": (0, rx_m - tx_m, tx_m - rx_m),
        "gain_diffracted": (DIFFRACTED, -tx_m, -rx_m),
    }
    for name in ("face_0", "face_n"):
        normal = np.array(case[name]["normal"], dtype=float)
        image_tx_m, image_rx_m = (at_m - 2.0 * (at_m @ normal) * normal for at_m in (tx_m, rx_m))
        ways_m[f"gain_reflected_{name}"] = (1, image_rx_m - tx_m, image_tx_m - rx_m)
    for key, (order, leaves_m, arrives_m) in ways_m.items():
        if position[key] is not None:
            length_m = np.hypot(*leaves_m) + (np.hypot(*arrives_m) if order == DIFFRACTED else 0.0)
            arrives_rad, leaves_rad = (float(np.arctan2(*way_m[::-1])) for way_m in (arrives_m, leaves_m))
            gain = _finite(complex(*position[key]), key)
            yield link, order, length_m / SPEED_OF_LIGHT_M_S, arrives_rad, leaves_rad, gain


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
        yield Reference(surfaces, tx_m, rx_m, carrier_hz, 0, True, False, _path_list([row]))


_READERS = {
    "wifi-paths-2d/1": _room,
    "wifi-paths-2d/2": _room,
    "wifi-slab-2d/1": _walls,
    "wifi-wedge-2d/1": _wedges,
}


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
    return _finite(complex(path[f"{key}_re"], path[f"{key}_im"]), key)


def _finite(gain: complex, key: str) -> complex:
    require(gain != 0.0 and np.isfinite(gain), key, "finite and not 0", gain)
    return gain


def _path_list(rows: Sequence[_Row]) -> PathList:
    """Columns of known paths."""
    columns = list(zip(*rows, strict=True)) or [()] * 6
    link, order = (np.array(column, dtype=int) for column in columns[:2])
    known = bool(np.isin(order, (0, 1, 2, DIFFRACTED)).all())
    require(known, "order", "0, 1 or 2", order.tolist())
    delay_s, arrives, leaves = (np.array(column, dtype=float) for column in columns[2:5])
    finite = np.isfinite(delay_s).all() and np.isfinite(arrives).all() and np.isfinite(leaves).all()
    require(finite, "delay_s and azimuths", "finite", columns[2:5])
    return PathList(link, order, delay_s, arrives, leaves, np.array(columns[5], dtype=complex))
