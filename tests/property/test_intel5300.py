"""Intel 5300 logs: what is written is read back, and a damaged log is refused."""

from pathlib import Path

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given
from hypothesis.extra import numpy as hnp

from wifipgo.errors import RecordingError
from wifipgo.radio.recordings.intel5300 import (
    BLOCK_BYTES,
    HOST_STAMPED,
    LAYOUTS,
    N_SUBCARRIERS,
    STOCK,
    CsiLog,
    decode_csi_log,
    encode_csi_log,
    pack_payload,
    payload_bytes,
    read_csi_log,
    unpack_payload,
)

SELECTIONS = {1: (0,), 2: (0b0100, 0b0001), 3: (0b100100, 0b011000, 0b000110)}  # permutations of the antennas
layouts = pytest.mark.parametrize("layout", LAYOUTS, ids=["stock", "host-stamped"])


def log_of(layout: np.dtype, *, seed: int, shapes: list[tuple[int, int]]) -> CsiLog:
    """A log with one record for each (rx, tx) shape and random contents."""
    rng = np.random.default_rng(seed)
    header = rng.integers(0, 256, (len(shapes), layout.itemsize), np.uint8).view(layout)[:, 0]
    csi = np.zeros((len(shapes), N_SUBCARRIERS, *np.max(shapes, axis=0)), np.complex64)
    for k, (n_rx, n_tx) in enumerate(shapes):
        parts = rng.integers(-128, 128, (2, N_SUBCARRIERS, n_rx, n_tx))
        csi[k, :, :n_rx, :n_tx] = parts[0] + 1j * parts[1]
        header["n_rx"][k], header["n_tx"][k] = n_rx, n_tx
        header["payload_bytes"][k] = payload_bytes(n_rx * n_tx)
        header["antenna_sel"][k] = rng.choice(SELECTIONS[n_rx])
    return CsiLog(header, csi)


@given(
    layout=st.sampled_from(LAYOUTS),
    seed=st.integers(0, 2**32 - 1),
    shapes=st.lists(st.tuples(st.integers(1, 3), st.integers(1, 3)), min_size=1, max_size=6),
)
def test_what_is_written_is_read_back(layout: np.dtype, seed: int, shapes: list[tuple[int, int]]) -> None:
    log = log_of(layout, seed=seed, shapes=shapes)
    raw = encode_csi_log(log)
    read = decode_csi_log(raw, source="log")
    assert read.header.dtype == layout
    assert read.end_byte == len(raw)
    np.testing.assert_array_equal(read.header, log.header)
    np.testing.assert_array_equal(read.csi, log.csi)


@given(
    st.integers(1, 9).flatmap(
        lambda streams: hnp.arrays(np.int8, st.tuples(*map(st.just, (2, N_SUBCARRIERS, streams, 2))))
    )
)
def test_payload_follows_the_bit_string(parts: np.ndarray) -> None:
    """Each part as the format's description finds it: byte o, shift r of its bit index."""
    payload = pack_payload(parts)
    n_streams = parts.shape[2]
    assert payload.shape[1] == payload_bytes(n_streams)
    np.testing.assert_array_equal(unpack_payload(payload, n_streams=n_streams), parts)
    padded, index = [*payload[0].tolist(), 0], 0
    for subcarrier in range(N_SUBCARRIERS):
        index += 3
        for part in range(2 * n_streams):
            byte, shift = index >> 3, index & 7
            value = (padded[byte] >> shift | padded[byte + 1] << (8 - shift)) & 255
            assert value == int(parts[0, subcarrier].ravel()[part]) & 255
            index += 8


@given(layout=st.sampled_from(LAYOUTS), cut=st.floats(0.0, 1.0, exclude_max=True))
def test_a_cut_log_is_refused_or_ends_after_a_record(layout: np.dtype, cut: float) -> None:
    log = log_of(layout, seed=7, shapes=[(3, 1)] * 4)
    raw = encode_csi_log(log)
    n_bytes, record = int(cut * len(raw)), len(raw) // 4
    if n_bytes >= record and n_bytes % record == 0:
        assert len(decode_csi_log(raw[:n_bytes], source="log").header) == n_bytes // record
        return
    with pytest.raises(RecordingError, match="expected") as caught:
        decode_csi_log(raw[:n_bytes], source="log")
    assert caught.value.offset == n_bytes // record * record


@layouts
def test_every_cut_inside_a_record_is_refused(layout: np.dtype) -> None:
    raw = encode_csi_log(log_of(layout, seed=3, shapes=[(3, 1)] * 2))
    for n_bytes in range(1, len(raw) // 2):
        with pytest.raises(RecordingError, match="to the end of the file"):
            decode_csi_log(raw[: len(raw) // 2 + n_bytes], source="log")


@layouts
def test_a_record_cut_at_the_loggers_block_is_dropped(layout: np.dtype) -> None:
    """A logger that is stopped leaves whole blocks, and most often a part of a record in the last."""
    raw = encode_csi_log(log_of(layout, seed=5, shapes=[(3, 1)] * 20))
    record = len(raw) // 20
    read = decode_csi_log(raw[:BLOCK_BYTES], source="log")
    assert len(read.header) == BLOCK_BYTES // record
    assert read.end_byte == BLOCK_BYTES // record * record


@layouts
def test_zeros_after_the_records_are_padding(layout: np.dtype) -> None:
    raw = encode_csi_log(log_of(layout, seed=5, shapes=[(3, 1)] * 5))
    assert len(decode_csi_log(raw.ljust(BLOCK_BYTES, b"\0"), source="log").header) == 5
    with pytest.raises(RecordingError, match="zero padding") as caught:
        decode_csi_log(raw + bytes(10) + b"x", source="log")
    assert caught.value.offset == len(raw) + 10


def test_frame_payload_records_are_skipped() -> None:
    raw = encode_csi_log(log_of(STOCK, seed=5, shapes=[(3, 1)] * 2))
    beside = (5).to_bytes(2, "big") + b"\xc1abcd"
    assert len(decode_csi_log(beside + raw + beside, source="log").header) == 2


@pytest.mark.parametrize(
    ("raw", "offset", "message"),
    [
        (b"", 0, "a CSI record"),
        (bytes(BLOCK_BYTES), 0, "a CSI record"),
        (b"\x89PNG\r\n\x1a\n" + bytes(50), 0, "a whole record"),
        (b"\x00\x05hello", 2, "code 187"),
        (b"\x00\x05\xbbhey!", 3, "20 bytes or more"),
        (b"\x00\x15\xbb" + bytes(20), 3, "1 to 3 antennas"),
    ],
)
def test_other_formats_are_refused(raw: bytes, offset: int, message: str) -> None:
    with pytest.raises(RecordingError, match=message) as caught:
        decode_csi_log(raw, source="log")
    assert caught.value.offset == offset


def test_layouts_do_not_mix() -> None:
    shapes = [(3, 1)]
    mixed = [encode_csi_log(log_of(layout, seed=1, shapes=shapes)) for layout in LAYOUTS]
    with pytest.raises(RecordingError, match="one layout") as caught:
        decode_csi_log(b"".join(mixed), source="log")
    assert caught.value.offset == len(mixed[0]) + 3


def test_a_false_payload_length_is_refused() -> None:
    log = log_of(HOST_STAMPED, seed=1, shapes=[(3, 1)] * 2)
    log.header["payload_bytes"][1] = 191
    with pytest.raises(RecordingError, match="payload length"):
        decode_csi_log(encode_csi_log(log), source="log")


def test_the_error_names_the_file(tmp_path: Path) -> None:
    path = tmp_path / "csi_rx.dat"
    path.write_bytes(encode_csi_log(log_of(HOST_STAMPED, seed=1, shapes=[(3, 1)]))[:-1])
    with pytest.raises(
        RecordingError, match=r"csi_rx\.dat: at byte 0: expected a whole record \(233 bytes\)"
    ):
        read_csi_log(path)


def test_only_whole_numbers_are_written() -> None:
    log = log_of(STOCK, seed=1, shapes=[(3, 1)])
    for value in (0.5, 128.0, -129.0):
        log.csi[0, 0, 0, 0] = value
        with pytest.raises(ValueError, match="whole numbers"):
            encode_csi_log(log)
