"""Recordings of the WSR toolbox: raw runs and packs, read into links with a known bearing.

A run (Jadhav et al., arXiv 2109.12205) is a folder with the CSI log of a moving receiver,
one log for each fixed transmitter, the receiver's motion capture and the surveyed
transmitters; ``macs.json``, which is optional, has the addresses of robots that are not in
`MACS`. A pack is an ``.npz`` with the same links, paired and cut to the motion.

The truth of a link is the bearing from the *mean* position of the aperture to the
transmitter; the toolbox itself takes it from the first moving pose.
"""

import re
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Complex, Float, Int, Shaped

from wifipgo.errors import BadInputError, RecordingError, pick
from wifipgo.radio._wsr_files import Motion, entry, first_file, from_json, number, read_motion, some_files
from wifipgo.radio.intel5300 import HOST_STAMPED, N_SUBCARRIERS, CsiLog, read_csi_log
from wifipgo.radio.materials import SPEED_OF_LIGHT_M_S

MACS = {
    "rx": "00:21:6a:53:89:d2",
    "tx2": "00:21:6a:3f:17:5a",
    "tx3": "00:21:6a:30:d2:3c",
    "tx4": "00:21:6a:b2:6e:fa",
}
PACK_CHANNEL = 108  # packs do not name their Wi-Fi channel; all known ones were recorded on this one
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
        raise FileNotFoundError(f"{path}: no such file or folder")
    packs = [] if any(path.glob("csi_rx_*.dat")) else sorted(path.glob("*.npz"))
    levels = ("", "*/", "*/*/")  # the folder itself, of runs, of sets of runs
    runs = [] if packs else sorted({log.parent for up in levels for log in path.glob(f"{up}csi_rx_*.dat")})
    if not packs and not runs:
        raise FileNotFoundError(f"{path}: no csi_rx_*.dat log and no .npz pack in this folder")
    yield from map(read_pack, packs)
    yield from map(read_run, runs)


def read_pack(path: Path) -> list[Link]:
    """Links of a pack: keys ``meta`` (JSON) and, for link n, ``f{n}``, ``r{n}`` and ``p{n}``."""
    if not zipfile.is_zipfile(path):
        raise RecordingError(str(path), 0, "a whole .npz pack", "a file that is none, or is cut")
    try:
        with path.open("rb") as file, np.load(file) as pack:
            arrays = {name: pack[name] for name in pack.files}
    except (zipfile.BadZipFile, zlib.error, EOFError, ValueError) as error:
        raise RecordingError(str(path), 0, "a whole .npz pack", str(error) or "a cut file") from error
    links = from_json(str(entry(arrays, "meta", path)), path)
    if not isinstance(links, list):
        raise BadInputError(f"{path}: key 'meta' is not a list of links")
    return [_packed_link(arrays, n, about, path) for n, about in enumerate(links)]


def read_run(folder: Path) -> list[Link]:
    """Links of the runs in a raw folder, one for each ``csi_tx*`` log."""
    truth = first_file(folder, TRUTH_FILE)
    about = from_json(truth.read_text("utf-8"), truth)
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
    channel = number(entry(about, "channel", truth), "value", truth)
    place, targets = (
        entry(entry(about, name, truth), "value", truth) for name in ("true_rx_position", "true_tx_positions")
    )
    macs = _macs(folder)
    for path in some_files(folder, f"csi_tx*_{stamp}.dat"):
        name = path.stem.removeprefix("csi_").removesuffix(f"_{stamp}")
        spot = entry(entry(targets, name, truth), "position", truth)
        away_m = [number(spot, axis, truth) for axis in "xyz"] - motion.position_m.mean(axis=0)
        answered = _host_stamped(path)
        forward, reverse = pair(
            received, answered, transmitter_mac=pick(macs, name, "transmitter"), receiver_mac=macs["rx"]
        )
        time_s = received.time_s[forward]
        ends = {received_path: received, path: answered}
        kept = _while_moving(time_s, motion, ends)
        yield Link(
            set_name=folder.name,
            place=str(place),
            stamp=stamp,
            transmitter=name,
            forward=received.csi[forward[kept], :, 0, 0],
            reverse=answered.csi[reverse[kept], :, 0, 0],
            displacement_m=_displacement(time_s[kept], motion),
            wavelength_m=wavelength_m(round(channel)),
            truth_rad=float(np.arctan2(away_m[1], away_m[0])),
        )


def _macs(folder: Path) -> dict[str, str]:
    """Addresses of the robots of a run: those of the data set, and what its ``macs.json`` says instead."""
    path = folder / MACS_FILE
    told = from_json(path.read_text("utf-8"), path) if path.is_file() else {}
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
    if not np.isfinite(displacement_m).all():
        raise BadInputError(f"{path}: p{n} must hold finite numbers")
    return Link(
        set_name=str(entry(about, "set", path)),
        place=str(entry(about, "loc", path)),
        stamp=str(entry(about, "stamp", path)),
        transmitter=str(entry(about, "tx", path)),
        forward=_complex(forward),
        reverse=_complex(reverse),
        displacement_m=displacement_m.astype(float),
        wavelength_m=wavelength_m(PACK_CHANNEL),
        truth_rad=float(np.deg2rad(number(about, "bearing_mean", path))),
        toolbox_rad=tuple(np.deg2rad(about.get("toolbox_azimuths", [])).tolist()),
    )


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
