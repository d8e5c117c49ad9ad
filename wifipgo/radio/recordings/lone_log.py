"""A CSI log by itself, of either layout: what its packets say, without the motion that a bearing needs."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.table import Table

from wifipgo.files.atomic_files import write_text
from wifipgo.radio.recordings.bearing_files import Value, as_csv
from wifipgo.radio.recordings.intel5300 import ANTENNAS, CSI_CODE, HOST_STAMPED, CsiLog

NOT_MEASURED = -127  # dBm, the card's word for it
_CLOCK = 2**32  # us, after which the card's clock begins again


def is_log(path: Path) -> bool:
    """Whether a file begins as a CSI log does."""
    if not path.is_file() or path.suffix == ".npz":
        return False
    with path.open("rb") as file:
        return file.read(3)[2:] == bytes([CSI_CODE])


def packet_rows(log: CsiLog) -> list[dict[str, Value]]:
    """A row a packet: when, which antennas heard it and how loudly, and what the CSI's strength is.

    RSSI are the card's, by antenna; the card orders them by stream, as it does the CSI.
    """
    head, heard = log.header, log.heard
    ticks = head["clock_us"].astype(np.int64)
    clock_us = np.cumsum(np.mod(np.diff(ticks, prepend=ticks[:1]), _CLOCK))
    strength = np.sqrt((np.abs(log.csi.astype(np.complex128)) ** 2).mean(axis=(1, 3)))
    stamped = head.dtype == HOST_STAMPED
    return [
        {
            "packet": k,
            "since_first_s": 1e-6 * float(clock_us[k]),
            "antennas": "".join(np.array(list(ANTENNAS))[heard[k]]),
            "tx_streams": int(head["n_tx"][k]),
            "noise_dbm": None if head["noise_dbm"][k] == NOT_MEASURED else int(head["noise_dbm"][k]),
            "agc_db": int(head["agc_db"][k]),
            **{
                f"csi_rms_{name}": float(strength[k, a]) if heard[k, a] else None
                for a, name in enumerate(ANTENNAS)
            },
            "sender": head["sender"][k].tobytes().hex(":") if stamped else None,
        }
        for k in range(len(head))
    ]


def write_packets(rows: Sequence[dict[str, Value]], path: Path) -> None:
    """Write a line a packet as CSV."""
    write_text(path, as_csv(rows))


def packet_table(log: CsiLog, rows: Sequence[dict[str, Value]], *, title: str) -> Table:
    """What a log holds: packets, time, antennas, who sent them."""
    table = Table(title=f"CSI log, {title}", show_header=False)
    table.add_column()
    table.add_column(justify="right")
    senders = {str(row["sender"]) for row in rows if row["sender"]}
    for name, value in {
        "layout": "host-stamped" if log.header.dtype == HOST_STAMPED else "stock",
        "packets": len(rows),
        "seconds, by the card's clock": f"{rows[-1]['since_first_s']:.3f}",
        **{f"heard by antenna {name}": n for name, n in zip(ANTENNAS, log.heard.sum(axis=0), strict=True)},
        "heard by no known antenna": int((~log.heard.any(axis=1)).sum()),
        "senders": ", ".join(sorted(senders)) or "the layout names none",
    }.items():
        table.add_row(name, str(value))
    return table
