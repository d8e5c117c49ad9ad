"""Recordings of the WSR toolbox: raw runs and packs, read into links with a known bearing.

A run (Jadhav et al., arXiv 2109.12205) is a folder with the CSI log of a moving receiver,
one log for each fixed transmitter, the receiver's motion capture and the surveyed
transmitters; ``macs.json``, which is optional, has the addresses of robots that are not in
`MACS`. A pack is an ``.npz`` with the same links, paired and cut to the motion.

The truth of a link is the bearing from the *mean* position of the aperture to the
transmitter; the toolbox itself takes it from the first moving pose.
"""

import errno
import re
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Complex, Float, Int, Shaped

from wifipgo.errors import BadInputError, RecordingError, pick, require
from wifipgo.npz_files import read_npz
from wifipgo.radio.propagation.materials import SPEED_OF_LIGHT_M_S
from wifipgo.radio.recordings._wsr_files import (
    Motion,
    channel_of,
    entry,
    first_file,
    number,
    read_motion,
    some_files,
    surveyed_m,
)
from wifipgo.radio.recordings.intel5300 import (
    CSI_CODE,
    HOST_STAMPED,
    N_SUBCARRIERS,
    CsiLog,
    read_csi_log,
    summary,
)
from wifipgo.text_files import parsed_json, read_json

MACS = {
    "rx": "00:21:6a:53:89:d2",
    "tx2": "00:21:6a:3f:17:5a",
    "tx3": "00:21:6a:30:d2:3c",
    "tx4": "00:21:6a:b2:6e:fa",
}
PACK_CHANNEL = 108  # packs do not name their Wi-Fi channel; all known ones were recorded on this one
_DEGREES = {"low": -360.0, "high": 360.0}
_LARGEST = 1e6  # far more than a report of signed bytes or a position in a room
MAX_GAP_S = 0.5  # a log that leaves out more than this of either end of the motion was cut
TRUTH_FILE = "groundtruth_positions.json"
MACS_FILE = (
    "macs.json"  # optional, beside the logs of robots that are not in `MACS`: {"rx": "00:..", "tx7": ..}
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Link:
    """The packets that a fixed transmitter and a moving receiver exchanged."""

    set_name: str
    place: str
    stamp: str
    transmitter: str
    forward: Complex[np.ndarray, "packets subcarriers"]  # at the receiver, antenna A
    reverse: Complex[np.ndarray, "packets subcarriers"]  # at the transmitter, antenna A
    displacement_m: Float[np.ndarray, "packets 3"]  # of the receiver since its first move, map frame
    wavelength_m: float
    truth_rad: float  # azimuth in the map frame, from the mean aperture position
    toolbox_rad: tuple[float, ...] = ()  # the toolbox's released peaks, its top one first
    n_left_out: int = 0  # packets during the motion that antenna A did not hear at both ends


def wavelength_m(channel: int) -> float:
    """Wavelength of a 5 GHz Wi-Fi channel, m."""
    return SPEED_OF_LIGHT_M_S / (5.0e9 + 5.0e6 * channel)


def read_links(path: Path) -> list[Link]:
    """Links of a raw run, of a pack, or of all packs (without any: all runs) in a folder.

    Raises:
        OSError: If a file is missing.
        ValueError: If a file is not what it should be; `RecordingError` says at which byte.
    """
    links = [link for part in _parts(path) for link in part]
    if not links:
        raise BadInputError(f"{path}: no links in it")
    return links


def _parts(path: Path) -> Iterator[list[Link]]:
    """Links of each pack or run that a path stands for."""
    if path.is_file():
        yield read_pack(path)
        return
    if not path.is_dir():
        raise FileNotFoundError(errno.ENOENT, "no such file or folder", str(path))
    packs = [] if any(path.glob("csi_rx_*.dat")) else sorted(path.glob("*.npz"))
    levels = ("", "*/", "*/*/")  # the folder itself, of runs, of sets of runs
    runs = [] if packs else sorted({log.parent for up in levels for log in path.glob(f"{up}csi_rx_*.dat")})
    if not packs and not runs:
        missing = "no csi_rx_*.dat log and no .npz pack in this folder"
        raise FileNotFoundError(errno.ENOENT, missing, str(path))
    yield from map(read_pack, packs)
    yield from map(read_run, runs)


def read_pack(path: Path) -> list[Link]:
    """Links of a pack: keys ``meta`` (JSON) and, for link n, ``f{n}``, ``r{n}`` and ``p{n}``."""
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


def read_run(folder: Path) -> list[Link]:
    """Links of the runs in a raw folder, one for each ``csi_tx*`` log."""
    truth = first_file(folder, TRUTH_FILE)
    about = read_json(truth)
    stamps = [log.stem.removeprefix("csi_rx_") for log in sorted(folder.glob("csi_rx_*.dat"))]
    return [link for stamp in stamps for link in _run_links(folder, stamp, about)]


def pair(
    received: CsiLog, answered: CsiLog, *, transmitter_mac: str, receiver_mac: str = MACS["rx"]
) -> tuple[Int[np.ndarray, " packets"], Int[np.ndarray, " packets"]]:
    """Records of the receiver's and of a transmitter's log that belong to the same exchange.

    They carry the same frame counter; of a repeated one the first record counts. The
    transmitters' clocks are off by up to tens of seconds and are not looked at.

    Returns:
        Indices into ``received`` and into ``answered``, in order of the frame counter.
    """
    forward = np.flatnonzero(_sent_by(received, transmitter_mac))
    reverse = np.flatnonzero(_sent_by(answered, receiver_mac))
    _, i, j = np.intersect1d(
        received.header["frame_count"][forward], answered.header["frame_count"][reverse], return_indices=True
    )
    return forward[i], reverse[j]


def _run_links(folder: Path, stamp: str, about: Any) -> Iterator[Link]:
    """The links of one run."""
    truth = folder / TRUTH_FILE
    motion = read_motion(first_file(folder, f"rx_trajectory_{stamp}*.csv"))
    received_path = first_file(folder, f"csi_rx_{stamp}.dat")
    received = _host_stamped(received_path)
    channel = channel_of(about, truth)
    place, targets = (
        entry(entry(about, name, truth), "value", truth) for name in ("true_rx_position", "true_tx_positions")
    )
    macs = _macs(folder)
    for path in some_files(folder, f"csi_tx*_{stamp}.dat"):
        name = path.stem.removeprefix("csi_").removesuffix(f"_{stamp}")
        away_m = surveyed_m(targets, name, truth) - motion.position_m.mean(axis=0)
        answered = _host_stamped(path)
        forward, reverse = pair(
            received, answered, transmitter_mac=pick(macs, name, "transmitter"), receiver_mac=macs["rx"]
        )
        time_s = received.time_s[forward]
        ends = {received_path: received, path: answered}
        moving = _while_moving(time_s, motion, ends)
        kept = moving & received.heard[forward, 0] & answered.heard[reverse, 0]
        _check_enough(kept, moving, f"{received_path}: antenna A, and that of {name},")
        yield Link(
            set_name=folder.name,
            place=str(place),
            stamp=stamp,
            transmitter=name,
            forward=received.csi[forward[kept], :, 0, 0],
            reverse=answered.csi[reverse[kept], :, 0, 0],
            displacement_m=_displacement(time_s[kept], motion),
            wavelength_m=wavelength_m(channel),
            truth_rad=float(np.arctan2(away_m[1], away_m[0])),
            n_left_out=int(np.count_nonzero(moving & ~kept)),
        )


def _check_enough(
    kept: Bool[np.ndarray, " packets"], moving: Bool[np.ndarray, " packets"], field: str
) -> None:
    """Refuse what says nothing about a direction."""
    n_kept, n_moving = np.count_nonzero(kept), np.count_nonzero(moving)
    if n_kept < 2:
        rule = "must hear two packets or more while the receiver moves"
        raise BadInputError(f"{field} {rule}, got {n_kept} of {n_moving}")


def _macs(folder: Path) -> dict[str, str]:
    """Addresses of the robots of a run: those of the data set, and what its ``macs.json`` says instead."""
    path = folder / MACS_FILE
    told = read_json(path) if path.is_file() else {}
    if not isinstance(told, dict):
        raise BadInputError(f"{path}: not a table of names and MAC addresses")
    for name, mac in told.items():
        if not isinstance(mac, str) or not re.fullmatch("[0-9a-fA-F]{2}(:[0-9a-fA-F]{2}){5}", mac):
            raise BadInputError(
                f"{path}: key {name!r} must hold a MAC address like {MACS['rx']}, got {mac!r}"
            )
    return MACS | told


def _while_moving(
    time_s: Float[np.ndarray, " packets"], motion: Motion, logs: dict[Path, CsiLog]
) -> Bool[np.ndarray, " packets"]:
    """Which packets fall into the motion; refuses logs that do not cover it.

    A log that was cut at a block of the disk looks whole byte by byte: this finds it.
    """
    kept = (time_s > motion.time_s[0]) & (time_s <= motion.time_s[-1])
    seen = time_s[kept] if kept.any() else motion.time_s[:1]
    missing_s = max(seen[0] - motion.time_s[0], motion.time_s[-1] - seen[-1])
    if missing_s > MAX_GAP_S:
        received, answered = logs
        short = received if logs[received].time_s[-1] < motion.time_s[-1] - MAX_GAP_S else answered
        raise RecordingError(
            str(short),
            logs[short].end_byte,
            "packets of the whole motion",
            f"none for {missing_s:.1f} s of it",
        )
    return kept


def _displacement(time_s: Float[np.ndarray, " packets"], motion: Motion) -> Float[np.ndarray, "packets 3"]:
    """Position at each packet by linear interpolation, relative to the first moving sample, m."""
    position_m = [np.interp(time_s, motion.time_s, axis) for axis in motion.position_m.T]
    return np.stack(position_m, axis=1) - motion.position_m[0]


def _packed_link(arrays: dict[str, np.ndarray], n: int, about: Any, path: Path) -> Link:
    """Link n of a pack."""
    forward, reverse, displacement_m = (entry(arrays, f"{letter}{n}", path) for letter in "frp")
    n_packets = len(displacement_m)
    if not forward.shape == reverse.shape == (n_packets, N_SUBCARRIERS, 2) or n_packets < 2:
        raise BadInputError(f"{path}: shapes of f{n} {forward.shape}, r{n} {reverse.shape}, p{n} do not fit")
    _check_numbers({f"f{n}": forward, f"r{n}": reverse, f"p{n}": displacement_m}, path)
    heard = forward.any(axis=(1, 2)) & reverse.any(axis=(1, 2))
    _check_enough(heard, np.ones(n_packets, dtype=bool), f"{path}: antennas of link {n}")
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


def _sent_by(log: CsiLog, mac: str) -> Bool[np.ndarray, " records"]:
    """Which records a sender sent."""
    return np.all(
        log.header["sender"] == np.frombuffer(bytes.fromhex(mac.replace(":", "")), np.uint8), axis=1
    )


def _host_stamped(path: Path) -> CsiLog:
    """A log with the frame counters and senders that pairing needs."""
    log = read_csi_log(path)
    if log.header.dtype != HOST_STAMPED:
        raise RecordingError(str(path), 0, "host-stamped records", "the stock layout, which cannot be paired")
    return log
