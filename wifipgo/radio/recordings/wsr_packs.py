"""Packs of the WSR toolbox's recordings: links in one ``.npz``, paired and cut to the motion."""

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Complex, Shaped

from wifipgo.errors import BadInputError, RecordingError, require
from wifipgo.files.npz_files import read_npz
from wifipgo.files.text_files import parsed_json
from wifipgo.radio.recordings._wsr_files import entry, number
from wifipgo.radio.recordings.intel5300 import CSI_CODE, N_SUBCARRIERS, read_csi_log, summary
from wifipgo.radio.recordings.recorded_link import Link, check_enough, wavelength_m

PACK_CHANNEL = 108  # packs do not name their Wi-Fi channel; all known ones were recorded on this one
_DEGREES = {"low": -360.0, "high": 360.0}
_LARGEST = 1e6  # far more than a report of signed bytes or a position in a room


def read_pack(path: str | Path) -> list[Link]:
    """Links of a pack: keys ``meta`` (JSON) and, for link n, ``f{n}``, ``r{n}`` and ``p{n}``."""
    path = Path(path)
    if not zipfile.is_zipfile(path):
        raise _no_pack(path)
    arrays = read_npz(path)
    links = parsed_json(str(entry(arrays, "meta", path)), f"{path}: key 'meta'")
    if not isinstance(links, list):
        raise BadInputError(f"{path}: key 'meta' is not a list of links")
    return [_packed_link(arrays, n, about, path) for n, about in enumerate(links)]


def _no_pack(path: Path) -> BadInputError:
    """What to say of a file that is no pack: of a log, what it holds, or at which byte it is damaged."""
    with path.open("rb") as file:
        begins = file.read(3)
    if path.suffix == ".npz" or begins[2:] != bytes([CSI_CODE]):
        return RecordingError(
            str(path), 0, "a whole .npz pack or a CSI log", "a file that is neither, or is cut"
        )
    holds = summary(read_csi_log(path))
    return BadInputError(
        f"{path}: expected the folder of a run (logs of both ends, motion capture, survey), got {holds}"
    )


def _packed_link(arrays: dict[str, np.ndarray], n: int, about: Any, path: Path) -> Link:
    """Link n of a pack."""
    forward, reverse, displacement_m = (entry(arrays, f"{letter}{n}", path) for letter in "frp")
    n_packets = len(displacement_m)
    if not forward.shape == reverse.shape == (n_packets, N_SUBCARRIERS, 2) or n_packets < 2:
        raise BadInputError(f"{path}: shapes of f{n} {forward.shape}, r{n} {reverse.shape}, p{n} do not fit")
    _check_numbers({f"f{n}": forward, f"r{n}": reverse, f"p{n}": displacement_m}, path)
    heard = forward.any(axis=(1, 2)) & reverse.any(axis=(1, 2))
    check_enough(heard, np.ones(n_packets, dtype=bool), f"{path}: antennas of link {n}")
    others_deg = entry({"toolbox_azimuths": []} | about, "toolbox_azimuths", path)
    require(isinstance(others_deg, list), f"{path}: key 'toolbox_azimuths'", "a list", others_deg)
    peaks_deg = {f"toolbox_azimuths[{k}]": value for k, value in enumerate(others_deg)}
    return Link(
        set_name=str(entry(about, "set", path)),
        place=str(entry(about, "loc", path)),
        stamp=str(entry(about, "stamp", path)),
        transmitter=str(entry(about, "tx", path)),
        forward=_complex(forward[heard]),
        reverse=_complex(reverse[heard]),
        displacement_m=displacement_m[heard].astype(float),
        wavelength_m=wavelength_m(PACK_CHANNEL),
        truth_rad=float(np.deg2rad(number(about, "bearing_mean", path, **_DEGREES))),
        toolbox_rad=tuple(float(np.deg2rad(number(peaks_deg, k, path, **_DEGREES))) for k in peaks_deg),
        n_left_out=int(np.count_nonzero(~heard)),
    )


def _check_numbers(arrays: dict[str, np.ndarray], path: Path) -> None:
    """Refuse arrays of a pack that hold no numbers, or some that nothing measures."""
    for name, array in arrays.items():
        numbers = array.dtype.kind in "iuf" and bool((np.abs(array.astype(float)) <= _LARGEST).all())
        require(numbers, f"{path}: {name}", f"finite numbers of at most {_LARGEST:g}", array)


def _complex(
    parts: Shaped[np.ndarray, "packets subcarriers 2"],
) -> Complex[np.ndarray, "packets subcarriers"]:
    """Complex numbers from real and imaginary parts."""
    return parts[..., 0].astype(np.complex64) + 1j * parts[..., 1].astype(np.complex64)
