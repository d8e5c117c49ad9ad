"""Recordings of the WSR toolbox: raw runs and packs, read into links with a known bearing.

A run (Jadhav et al., arXiv 2109.12205) is a folder with the CSI log of a moving receiver,
one log for each fixed transmitter, the receiver's motion capture and the surveyed
transmitters; ``macs.json``, which is optional, has the addresses of robots that are not in
`MACS`. A pack has the same links in one file (`wifipgo.radio.recordings.wsr_packs`).

The truth of a link is the bearing from the *mean* position of the aperture to the
transmitter; the toolbox itself takes it from the first moving pose.
"""

import errno
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.errors import BadInputError, RecordingError, pick, require
from wifipgo.files.text_files import read_json
from wifipgo.radio.recordings._wsr_files import (
    CHANNELS_5_GHZ,
    Motion,
    channel_of,
    entry,
    first_file,
    read_motion,
    some_files,
    surveyed_m,
)
from wifipgo.radio.recordings.intel5300 import HOST_STAMPED, CsiLog, read_csi_log
from wifipgo.radio.recordings.recorded_link import Link, check_enough, wavelength_m
from wifipgo.radio.recordings.wsr_packs import read_pack

MACS = {
    "rx": "00:21:6a:53:89:d2",
    "tx2": "00:21:6a:3f:17:5a",
    "tx3": "00:21:6a:30:d2:3c",
    "tx4": "00:21:6a:b2:6e:fa",
}
MAX_GAP_S = 0.5  # a log that leaves out more than this of either end of the motion was cut
TRUTH_FILE = "groundtruth_positions.json"
MACS_FILE = (
    "macs.json"  # optional, beside the logs of robots that are not in `MACS`: {"rx": "00:..", "tx7": ..}
)


def read_links(path: str | Path, *, channel: int | None = None) -> list[Link]:
    """Links of a raw run, of a pack, or of all packs (without any: all runs) in a folder.

    Args:
        path: File or folder.
        channel: Wi-Fi channel of runs without a survey, which would name it.

    Raises:
        OSError: If a file is missing.
        ValueError: If a file is not what it should be; `RecordingError` says at which byte.
    """
    path = Path(path)
    links = [link for part in _parts(path, channel) for link in part]
    if not links:
        raise BadInputError(f"{path}: no links in it")
    return links


def _parts(path: Path, channel: int | None) -> Iterator[list[Link]]:
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
    yield from (read_run(run, channel=channel) for run in runs)


def read_run(folder: str | Path, *, channel: int | None = None) -> list[Link]:
    """Links of the runs in a raw folder, one for each ``csi_tx*`` log.

    Without a survey, or of a transmitter that it does not name, the truth is not known: nan.

    Args:
        folder: The run.
        channel: Wi-Fi channel where there is no survey.
    """
    folder = Path(folder)
    about = _survey(folder / TRUTH_FILE, channel)
    stamps = [log.stem.removeprefix("csi_rx_") for log in sorted(folder.glob("csi_rx_*.dat"))]
    return [link for stamp in stamps for link in _run_links(folder, stamp, about)]


def _survey(path: Path, channel: int | None) -> Any:
    """What is known of a run beside its logs; where nothing is written, its channel has to be given."""
    if path.is_file():
        return read_json(path)
    low, high = CHANNELS_5_GHZ
    rule = f"given (--channel, {low:g}..{high:g}) where there is no {path}"
    require(channel is not None and low <= channel <= high, "channel", rule, channel)
    return {"channel": {"value": channel}, "true_rx_position": {"value": "?"}}


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
    place = entry(entry(about, "true_rx_position", truth), "value", truth)
    targets = entry(about.get("true_tx_positions", {"value": {}}), "value", truth)
    macs = _macs(folder)
    for path in some_files(folder, f"csi_tx*_{stamp}.dat"):
        name = path.stem.removeprefix("csi_").removesuffix(f"_{stamp}")
        away_m = surveyed_m(targets, name, truth) - motion.position_m.mean(axis=0)
        ends = {received_path: received, path: _host_stamped(path)}
        forward, reverse, n_left_out = _heard(ends, motion, macs, name)
        yield Link(
            set_name=folder.name,
            place=str(place),
            stamp=stamp,
            transmitter=name,
            forward=received.csi[forward, :, 0, 0],
            reverse=ends[path].csi[reverse, :, 0, 0],
            displacement_m=_displacement(received.time_s[forward], motion),
            wavelength_m=wavelength_m(channel),
            truth_rad=float(np.arctan2(away_m[1], away_m[0])),
            n_left_out=n_left_out,
        )


def _heard(
    ends: dict[Path, CsiLog], motion: Motion, macs: dict[str, str], transmitter: str
) -> tuple[Int[np.ndarray, " packets"], Int[np.ndarray, " packets"], int]:
    """Records of both ends whose antenna A heard the packet during the motion, and how many are left out."""
    (path, received), (_, answered) = ends.items()
    mac = pick(macs, transmitter, "transmitter")
    forward, reverse = pair(received, answered, transmitter_mac=mac, receiver_mac=macs["rx"])
    moving = _while_moving(received.time_s[forward], motion, ends)
    kept = moving & received.heard[forward, 0] & answered.heard[reverse, 0]
    check_enough(kept, moving, f"{path}: antenna A, and that of {transmitter},")
    return forward[kept], reverse[kept], int(np.count_nonzero(moving & ~kept))


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
