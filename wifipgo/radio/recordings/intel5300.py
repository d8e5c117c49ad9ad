"""Byte level of Intel 5300 CSI logs: the stock layout and the host-stamped one.

A log is a sequence of records: a big-endian u16 length n, then n bytes, the first of
which is a code; 0xBB is CSI. All other integers are little-endian. The stock CSI tool
(Halperin et al., linux-80211n-csitool) puts the CSI payload at byte 20 of a body; the
WSR data set (Jadhav et al., arXiv 2109.12205) adds the host's clock, the sender's
MAC address and a frame counter at bytes 20 to 37, and the payload follows at 38. A
reader of one layout accepts the other and returns garbage, so the layout is told by
what is left of a body when its payload is taken away: 20 or 38 bytes.

Where a log may end:

- after a whole record, or at a length of 0, after which every byte must be 0;
- in the middle of a record *if the file is a multiple of 4096 bytes long*: the logger
  writes whole blocks and is stopped by a signal, so its last record is nearly always
  cut there. That record is dropped, and ``CsiLog.end_byte`` says where.

A log that ends in the middle of a record at any other size was truncated afterwards,
and reading it raises `RecordingError`.

The card listens with one to three of its antennas A, B, C, and hands their streams over in any order.
CSI has a column for each antenna, not for each stream: a packet that C alone heard is in column C.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Complex, Int, Int8, Shaped, UInt8

from wifipgo.errors import RecordingError, require

N_SUBCARRIERS = 30
BLOCK_BYTES = 4096  # unit in which a logger's output reaches the disk
CSI_CODE = 0xBB
SKIPPED_CODES = (0xC1,)  # frame payload, which the stock tool logs beside the CSI on request

_STOCK_FIELDS: list[tuple[str, str] | tuple[str, str, tuple[int]]] = [
    ("clock_us", "<u4"),  # low part of the card's 1 MHz clock
    ("bfee_count", "<u2"),
    ("reserved", "<u2"),
    ("n_rx", "u1"),
    ("n_tx", "u1"),
    ("rssi", "u1", (3,)),
    ("noise_dbm", "i1"),  # -127: not measured
    ("agc_db", "u1"),
    ("antenna_sel", "u1"),  # stream k comes from antenna (antenna_sel >> 2k) & 3
    ("payload_bytes", "<u2"),
    ("rate", "<u2"),
]
STOCK = np.dtype(_STOCK_FIELDS)
HOST_STAMPED = np.dtype(
    [*_STOCK_FIELDS, ("host_s", "<u4"), ("host_us", "<u4"), ("sender", "u1", (6,)), ("frame_count", "<u4")]
)
LAYOUTS = (STOCK, HOST_STAMPED)
ANTENNAS = "ABC"
_NONE = -1


class CsiLog(NamedTuple):
    """CSI records of one log, in file order.

    Antennas that a record did not use hold zeros, and so do all of a record that names one
    antenna twice or a fourth one: nothing says who heard what.
    """

    header: Shaped[np.ndarray, " records"]  # of dtype STOCK or HOST_STAMPED
    csi: Complex[np.ndarray, "records subcarriers rx_antennas tx_streams"]
    end_byte: int = 0

    @property
    def time_s(self) -> np.ndarray:
        """Host clock of each record, s since the epoch; host-stamped logs only."""
        return self.header["host_s"] + 1e-6 * self.header["host_us"]

    @property
    def heard(self) -> Bool[np.ndarray, "records 3"]:
        """Which of the antennas A, B, C heard each record."""
        antennas = _antennas_of_streams(self.header)
        return (antennas[:, :, None] == np.arange(len(ANTENNAS))).any(axis=1)


class _Bodies(NamedTuple):
    """Where the bodies of the CSI records lie in a file."""

    starts: Int[np.ndarray, " records"]
    lengths: Int[np.ndarray, " records"]
    end_byte: int


def read_csi_log(path: str | Path) -> CsiLog:
    """Read a log of either layout.

    Raises:
        RecordingError: At the first byte that neither layout allows.
        OSError: If the file cannot be opened.
    """
    path = Path(path)
    return decode_csi_log(path.read_bytes(), source=str(path))


def decode_csi_log(raw: bytes, *, source: str) -> CsiLog:
    """Decode the bytes of a log; ``source`` names them in errors."""
    bodies = _frames(raw, source)
    content = np.frombuffer(raw, np.uint8)
    layout = _layout(content, bodies, source)
    header = _gather(content, bodies.starts, layout.itemsize).view(layout)[:, 0]
    antennas = _antennas_of_streams(header)
    n_columns = max(1, 1 + antennas.max())
    csi = np.zeros((len(header), N_SUBCARRIERS, n_columns, header["n_tx"].max()), np.complex64)
    for n_rx, n_tx in np.unique(np.stack([header["n_rx"], header["n_tx"]], axis=1), axis=0).tolist():
        of_shape = np.flatnonzero((header["n_rx"] == n_rx) & (header["n_tx"] == n_tx))
        payload = _gather(content, bodies.starts[of_shape] + layout.itemsize, payload_bytes(n_rx * n_tx))
        parts = unpack_payload(payload, n_streams=n_rx * n_tx).astype(np.float32)
        streams = (parts[..., 0] + 1j * parts[..., 1]).reshape(-1, N_SUBCARRIERS, n_rx, n_tx)
        known = np.flatnonzero(antennas[of_shape, 0] != _NONE)
        for stream in range(n_rx):
            rows = of_shape[known]
            csi[rows, :, antennas[rows, stream], :n_tx] = streams[known, :, stream]
    return CsiLog(header, csi, bodies.end_byte)


def encode_csi_log(log: CsiLog) -> bytes:
    """Bytes of a log in the layout of its header; the inverse of `decode_csi_log`.

    Raises:
        ValueError: If real or imaginary parts are not whole numbers in -128..127.
    """
    parts = np.stack([log.csi.real, log.csi.imag], axis=-1)
    require(
        bool(np.all((parts == np.round(parts)) & (np.abs(parts + 0.5) < 128.0))),
        "csi",
        "whole numbers in -128..127",
        "others",
    )
    return b"".join(_record(head, part) for head, part in zip(log.header, parts.astype(np.int8), strict=True))


def payload_bytes(n_streams: int) -> int:
    """Length of a CSI payload: 3 bits, then 16 bits a stream, for each subcarrier; whole bytes."""
    return (N_SUBCARRIERS * (3 + 16 * n_streams) + 7) // 8


def unpack_payload(
    payload: UInt8[np.ndarray, "records bytes"], *, n_streams: int
) -> Int8[np.ndarray, "records subcarriers streams 2"]:
    """Real and imaginary parts from payloads, which are bit strings, lowest bit first."""
    bits = np.unpackbits(payload, axis=1, bitorder="little")
    fields = bits[:, : N_SUBCARRIERS * (3 + 16 * n_streams)].reshape(len(payload), N_SUBCARRIERS, -1)
    octets = fields[:, :, 3:].reshape(len(payload), N_SUBCARRIERS, n_streams, 2, 8)
    return np.packbits(octets, axis=-1, bitorder="little")[..., 0].view(np.int8)


def pack_payload(
    parts: Int8[np.ndarray, "records subcarriers streams 2"],
) -> UInt8[np.ndarray, "records bytes"]:
    """Payloads from real and imaginary parts; the inverse of `unpack_payload`."""
    bits = np.unpackbits(np.ascontiguousarray(parts).view(np.uint8)[..., None], axis=-1, bitorder="little")
    fields = bits.reshape(*parts.shape[:2], -1)
    padded = np.concatenate([np.zeros_like(fields[..., :3]), fields], axis=-1)
    return np.packbits(padded.reshape(len(parts), -1), axis=1, bitorder="little")


def _gather(
    content: UInt8[np.ndarray, " size"], starts: Shaped[np.ndarray, " records"], n_bytes: int
) -> UInt8[np.ndarray, "records bytes"]:
    """The ``n_bytes`` bytes from each start on."""
    return content[starts[:, None] + np.arange(n_bytes)]


def _frames(raw: bytes, source: str) -> _Bodies:
    """The bodies of the CSI records, in order."""
    starts, lengths, at = [], [], 0
    while at < len(raw):
        length = int.from_bytes(raw[at : at + 2], "big")
        if length == 0 and at + 2 <= len(raw):
            _check_padding(raw, at, source)
            break
        if at + 2 + max(length, 1) > len(raw):
            _check_cut(raw, at, length, source)
            break
        if raw[at + 2] == CSI_CODE:
            starts.append(at + 3)
            lengths.append(length - 1)
        elif raw[at + 2] not in SKIPPED_CODES:
            raise RecordingError(source, at + 2, f"the CSI record code {CSI_CODE}", f"code {raw[at + 2]}")
        at += 2 + length
    if not starts:
        raise RecordingError(source, 0, f"a CSI record (code {CSI_CODE})", "none in the file")
    return _Bodies(np.array(starts), np.array(lengths), at)


def _check_cut(raw: bytes, at: int, length: int, source: str) -> None:
    """A last record that is not whole is normal only at the end of a logger's block."""
    if len(raw) % BLOCK_BYTES != 0:
        wanted = f"a whole record ({2 + length} bytes)" if at + 2 <= len(raw) else "a record"
        raise RecordingError(source, at, wanted, f"{len(raw) - at} bytes to the end of the file")


def _check_padding(raw: bytes, at: int, source: str) -> None:
    """Zeros after the records are padding; anything else after a length of 0 is damage."""
    left = raw[at:].lstrip(b"\0")
    if left:
        raise RecordingError(
            source, len(raw) - len(left), "zero padding to the end of the file", f"byte {left[0]}"
        )


def _layout(content: UInt8[np.ndarray, " size"], bodies: _Bodies, source: str) -> np.dtype:
    """Layout that every record has, or an error at the first record that departs from it."""
    _refuse(bodies, bodies.lengths < STOCK.itemsize, f"a CSI body of {STOCK.itemsize} bytes or more", source)
    stock = _gather(content, bodies.starts, STOCK.itemsize).view(STOCK)[:, 0]
    n_rx, n_tx = stock["n_rx"].astype(int), stock["n_tx"].astype(int)
    outside = (np.minimum(n_rx, n_tx) < 1) | (np.maximum(n_rx, n_tx) > 3)
    _refuse(bodies, outside, "1 to 3 antennas at both ends (body bytes 8 and 9)", source)
    wanted = (N_SUBCARRIERS * (3 + 16 * n_rx * n_tx) + 7) // 8
    off = stock["payload_bytes"] != wanted
    _refuse(bodies, off, "the payload length of 30 subcarriers (body bytes 16 and 17)", source)
    left = bodies.lengths - wanted
    sizes = [layout.itemsize for layout in LAYOUTS]
    _refuse(
        bodies, ~np.isin(left, sizes), f"{sizes[0]} or {sizes[1]} header bytes before the payload", source
    )
    _refuse(bodies, left != left[0], "one layout in the whole file", source)
    return LAYOUTS[sizes.index(int(left[0]))]


def _refuse(bodies: _Bodies, bad: Bool[np.ndarray, " records"], expected: str, source: str) -> None:
    """Raise at the first body that is bad, if there is one."""
    if bad.any():
        k = int(bad.argmax())
        raise RecordingError(
            source, int(bodies.starts[k]), expected, f"a body of {bodies.lengths[k]} bytes without"
        )


def _antennas_of_streams(header: Shaped[np.ndarray, " records"]) -> Int[np.ndarray, "records 3"]:
    """Antenna of each receive stream; `_NONE` past the last one, and where not each names one of its own."""
    streams = np.arange(len(ANTENNAS))
    antennas = (header["antenna_sel"][:, None].astype(np.int64) >> 2 * streams) & 3
    there = streams < header["n_rx"][:, None]
    named = there[:, :, None] & (antennas[:, :, None] == streams)  # records, streams, antennas
    sensible = (named.sum(axis=1) <= 1).all(axis=1) & (named.any(axis=2) == there).all(axis=1)
    return np.where(there & sensible[:, None], antennas, _NONE)


def _record(head: np.void, parts: Int8[np.ndarray, "subcarriers rx_antennas tx_streams 2"]) -> bytes:
    """One record: length, code, header and payload; zeros of streams that belong to no antenna."""
    n_rx, n_tx = int(head["n_rx"]), int(head["n_tx"])
    antennas = _antennas_of_streams(np.array([head]))[0, :n_rx]
    streams = np.where((antennas != _NONE)[:, None, None], parts[:, antennas, :n_tx], np.int8(0))
    body = head.tobytes() + pack_payload(streams.reshape(1, N_SUBCARRIERS, n_rx * n_tx, 2)).tobytes()
    return (1 + len(body)).to_bytes(2, "big") + bytes([CSI_CODE]) + body


def summary(log: CsiLog) -> str:
    """What a log holds, in a line: records, layout, antennas, and who sent them where it says so."""
    layout = "stock" if log.header.dtype == STOCK else "host-stamped"
    heard = ", ".join(f"{name} in {n}" for name, n in zip(ANTENNAS, log.heard.sum(axis=0), strict=True))
    text = f"a log of {len(log.header)} records, {layout} layout; antenna {heard}"
    if log.header.dtype == STOCK:
        return f"{text}; it does not name senders"
    senders, counts = np.unique(log.header["sender"], axis=0, return_counts=True)
    told = [f"{sender.tobytes().hex(':')} of {n}" for sender, n in zip(senders, counts, strict=True)]
    return f"{text}; senders {', '.join(told[:8])}{', ...' * (len(told) > 8)}"
