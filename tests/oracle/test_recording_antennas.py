"""Who heard what: records written bit by bit, whose streams come from known antennas of the card."""

import itertools
import json
import struct
from pathlib import Path

import numpy as np
import pytest
from support.synthetic_run import STAMP, write_run

from wifipgo.errors import BadInputError
from wifipgo.radio.aoa.moving_aperture import ApertureConfig
from wifipgo.radio.recordings.intel5300 import (
    HOST_STAMPED,
    STOCK,
    CsiLog,
    decode_csi_log,
    encode_csi_log,
    read_csi_log,
)
from wifipgo.radio.recordings.recorded_link import bearing
from wifipgo.radio.recordings.report import print_report
from wifipgo.radio.recordings.wsr_dataset import read_links

COARSE = ApertureConfig(n_azimuths=180, elevations_rad=(0.0, 0.2), curvatures_per_m=(0.0, 0.3))
RX, TX = f"csi_rx_{STAMP}.dat", f"csi_tx2_{STAMP}.dat"
VALUE = {"A": 11 - 3j, "B": -50 + 7j, "C": 90 + 101j}
# Streams in the order in which the card hands them over: every choice of antennas in every order.
ORDERS = ["".join(order) for n in (1, 2, 3) for order in itertools.permutations("ABC", n)]


def sel_of(order: str, rest: int = 0) -> int:
    """The card's byte: antenna of stream k in bits 2k and 2k + 1, and whatever above the last stream."""
    named = sum("ABC".index(antenna) << 2 * k for k, antenna in enumerate(order))
    return named | (rest << 2 * len(order)) & 0xFF


def record(order: str, *, stamped: bool, rest: int = 0, sel: int | None = None) -> bytes:
    """One record of 30 equal subcarriers."""
    bits = "".join(
        "000"
        + "".join(f"{int(part) & 0xFF:08b}"[::-1] for a in order for part in (VALUE[a].real, VALUE[a].imag))
        for _ in range(30)
    )
    bits += "0" * (-len(bits) % 8)
    body = bytes(int(bits[k : k + 8][::-1], 2) for k in range(0, len(bits), 8))
    byte = sel_of(order, rest) if sel is None else sel
    head = struct.pack("<IHHBBBBBbBBHH", 5, 1, 0, len(order), 1, 40, 41, 42, -90, 30, byte, len(body), 0x101)
    head += struct.pack("<II6sI", 1, 2, b"sender", 3) if stamped else b""
    return struct.pack(">HB", 1 + len(head) + len(body), 0xBB) + head + body


@pytest.mark.parametrize("stamped", [False, True])
@pytest.mark.parametrize("rest", [0, 3])
def test_columns_are_antennas_in_every_mixture(stamped: bool, rest: int) -> None:
    raw = b"".join(record(order, stamped=stamped, rest=rest) for order in ORDERS)
    log = decode_csi_log(raw, source="log")
    assert log.header.dtype == (HOST_STAMPED if stamped else STOCK)
    assert log.csi.shape == (len(ORDERS), 30, 3, 1)
    for k, order in enumerate(ORDERS):
        for column, antenna in enumerate("ABC"):
            assert (log.csi[k, :, column, 0] == (VALUE[antenna] if antenna in order else 0)).all()
            assert log.heard[k, column] == (antenna in order)
    assert encode_csi_log(log) == raw


@pytest.mark.parametrize("order", ORDERS)
def test_a_log_of_one_kind_has_the_same_columns(order: str) -> None:
    csi = decode_csi_log(record(order, stamped=False), source="log").csi[0, 0, :, 0]
    assert csi.tolist() == [VALUE[a] if a in order else 0 for a in "ABC"[: 1 + max(map("ABC".index, order))]]


@pytest.mark.parametrize(
    ("order", "sel"), [("A", 3), ("AB", 0), ("AB", 0b0111), ("ABC", 0), ("ABC", 0b110100)]
)
def test_streams_of_no_known_antenna_are_zeros(order: str, sel: int) -> None:
    """An antenna named twice, or a fourth one: nothing says who heard what."""
    log = decode_csi_log(record(order, stamped=True, sel=sel) + record("C", stamped=True), source="log")
    assert not log.heard[0].any()
    assert not log.csi[0].any()
    assert log.csi[1, 0, :, 0].tolist() == [0, 0, VALUE["C"]]


def heard_by(path: Path, orders: list[str]) -> None:
    """Write a log again as if the antennas of ``orders``, in turn, had heard its packets.

    B and C stand elsewhere, so what they hear has another phase at every packet.
    """
    log = read_csi_log(path)
    header, csi = log.header.copy(), log.csi.copy()
    turned = np.exp(0.02j * np.arange(len(header)))[:, None, None]
    csi[:, :, 1:] = np.round(csi[:, :, :1, :] * turned[..., None])
    csi = np.clip(csi.real, -128, 127) + 1j * np.clip(csi.imag, -128, 127)
    parts = []
    for k in range(len(header)):
        order = orders[k % len(orders)]
        header["n_rx"][k], header["antenna_sel"][k] = len(order), sel_of(order)
        header["payload_bytes"][k] = (30 * (3 + 16 * len(order)) + 7) // 8
        parts.append(encode_csi_log(CsiLog(header[k : k + 1], csi[k : k + 1].astype(np.complex64))))
    path.write_bytes(b"".join(parts))


@pytest.mark.parametrize(("log", "orders"), [(RX, ["ABC", "C"]), (RX, ORDERS), (TX, ["CA", "BC", "B"])])
def test_packets_that_antenna_a_did_not_hear_are_left_out_and_counted(
    log: str, orders: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_run(tmp_path / "run", transmitters_m={"tx2": (-2.4, 2.6, 0.7)}, seed=1)
    (whole,) = read_links(tmp_path / "run")
    heard_by(tmp_path / "run" / log, orders)
    (link,) = read_links(tmp_path / "run")
    without_a = sum("A" not in order for order in orders) / len(orders)
    assert whole.n_left_out == 0
    assert len(link.forward) + link.n_left_out == len(whole.forward)
    assert link.n_left_out == pytest.approx(without_a * len(whole.forward), abs=len(orders))
    assert link.forward.any(axis=1).all()
    found = bearing(link, COARSE)
    assert abs(np.rad2deg(found.azimuth_rad - link.truth_rad)) < 2.0
    print_report([link], [found], title="run")
    said = capsys.readouterr().out
    assert "left out" in said
    assert f" {link.n_left_out} " in said
    print_report([whole], [found], title="run")
    assert "left out" not in capsys.readouterr().out


def test_a_run_that_antenna_a_did_not_hear_is_refused(tmp_path: Path) -> None:
    write_run(tmp_path / "run", transmitters_m={"tx2": (-2.4, 2.6, 0.7)}, seed=1)
    heard_by(tmp_path / "run" / RX, ["C", "BC"])
    with pytest.raises(BadInputError, match=r"antenna A, and that of tx2, must hear two .*, got 0 of 4"):
        read_links(tmp_path / "run")


def test_empty_packets_of_a_pack_are_left_out_and_counted(tmp_path: Path) -> None:
    write_run(tmp_path / "run", transmitters_m={"tx2": (-2.4, 2.6, 0.7)}, seed=1)
    (raw,) = read_links(tmp_path / "run")
    about = {"set": "S", "loc": 1, "stamp": STAMP, "tx": "tx2", "bearing_mean": 0.0}
    parts = [np.stack([h.real, h.imag], axis=-1).astype(np.int8) for h in (raw.forward, raw.reverse)]
    parts[0][::5], parts[1][1::5] = 0, 0
    np.savez(
        tmp_path / "p.npz",
        f0=parts[0],
        r0=parts[1],
        p0=raw.displacement_m,
        meta=np.array(json.dumps([about])),
    )
    (packed,) = read_links(tmp_path / "p.npz")
    assert packed.n_left_out == len(raw.forward) - len(packed.forward)
    np.testing.assert_array_equal(packed.forward[:3], raw.forward[2:5])
