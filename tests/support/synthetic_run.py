"""A raw run as the WSR toolbox would record it, from a channel of one path in closed form."""

import json
from pathlib import Path

import numpy as np
import pytest

from wifipgo.radio.recordings.__main__ import main
from wifipgo.radio.recordings.intel5300 import (
    HOST_STAMPED,
    N_SUBCARRIERS,
    CsiLog,
    encode_csi_log,
    payload_bytes,
)
from wifipgo.radio.recordings.recorded_link import wavelength_m
from wifipgo.radio.recordings.wsr_dataset import MACS

STAMP = "2021-06-27_202550"
SPOTS_M = {"tx2": (-2.4, 2.6, 0.7), "tx3": (2.5, -2.6, 0.5), "tx4": (-3.7, -1.5, 0.3)}
RX, TX3 = f"csi_rx_{STAMP}.dat", f"csi_tx3_{STAMP}.dat"
TRAJECTORY, TRUTH = f"rx_trajectory_{STAMP}_.csv", "groundtruth_positions.json"
CHANNEL = 108
START_S = 1_624_839_912.0
SUBCARRIER_STEP_HZ = 625e3
N_PACKETS = 600
PERIOD_S = 0.012
REST_S, MOVE_S = 1.0, 5.0


def position_at(time_s: np.ndarray) -> np.ndarray:
    """Half a circle of 0.6 m from 1 s to 6 s, at rest before and after; map frame, m."""
    turned_rad = np.pi * np.clip((time_s - START_S - REST_S) / MOVE_S, 0.0, 1.0)
    return np.stack([0.3 * np.sin(turned_rad), -0.3 * np.cos(turned_rad), np.full_like(time_s, 0.2)], axis=1)


def write_run(folder: Path, *, transmitters_m: dict[str, tuple[float, float, float]], seed: int) -> None:
    """Write the logs of a receiver and its transmitters, the motion capture and the survey."""
    rng = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    received = []
    for name, target_m in transmitters_m.items():
        time_s = START_S + rng.uniform(0.0, 0.004) + PERIOD_S * np.arange(N_PACKETS)
        forward, reverse = two_way_csi(time_s, np.array(target_m), rng)
        received.append(log_of(forward, MACS[name], time_s))
        answered = log_of(reverse, MACS["rx"], time_s + 17.0)  # a clock of its own
        (folder / f"csi_{name}_{STAMP}.dat").write_bytes(encode_csi_log(answered))
    both = CsiLog(
        np.concatenate([log.header for log in received]), np.concatenate([log.csi for log in received])
    )
    order = np.argsort(both.time_s, kind="stable")
    (folder / f"csi_rx_{STAMP}.dat").write_bytes(encode_csi_log(CsiLog(both.header[order], both.csi[order])))
    capture_s = START_S + np.arange(0.0, 8.0, 0.004)
    rows = np.column_stack([capture_s, np.zeros_like(capture_s), position_at(capture_s)])
    lines = [",".join(f"{value:.6f}" for value in row) + "," for row in rows.tolist()]
    (folder / f"rx_trajectory_{STAMP}_.csv").write_text("\n".join(lines) + "\n", "utf-8")
    survey = {
        name: {"position": dict(zip("xyz", spot, strict=True))} for name, spot in transmitters_m.items()
    }
    about = {"channel": CHANNEL, "true_rx_position": 1, "true_tx_positions": survey}
    truth = {name: {"value": value} for name, value in about.items()}
    (folder / "groundtruth_positions.json").write_text(json.dumps(truth), "utf-8")


def two_way_csi(
    time_s: np.ndarray, target_m: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Forward and reverse channel of one path, with oscillator phases, symbol timing and rounding."""
    way_m = np.linalg.norm(target_m - position_at(time_s), axis=1)[:, None]
    from_middle_hz = SUBCARRIER_STEP_HZ * (np.arange(N_SUBCARRIERS) - 14.5)
    per_m = 2.0 * np.pi * (1.0 / wavelength_m(CHANNEL) + from_middle_hz / 3.0e8)
    offset_rad = rng.uniform(-np.pi, np.pi, (len(time_s), 1))
    timing_s = rng.normal(0.0, 30e-9, (2, len(time_s), 1))
    noise = rng.normal(0.0, 3.0, (2, 2, len(time_s), N_SUBCARRIERS))
    path_rad = -per_m * way_m - 2.0 * np.pi * from_middle_hz * timing_s
    csi = 40.0 * np.exp(1j * (path_rad + np.stack([offset_rad, -offset_rad]))) + noise[0] + 1j * noise[1]
    rounded = np.clip(csi.real.round(), -128, 127) + 1j * np.clip(csi.imag.round(), -128, 127)
    forward, reverse = rounded.astype(np.complex64)
    return forward, reverse


def log_of(antenna_a: np.ndarray, sender_mac: str, time_s: np.ndarray) -> CsiLog:
    """A host-stamped log of three antennas, of which only A is connected."""
    header = np.zeros(len(antenna_a), HOST_STAMPED)
    header["n_rx"], header["n_tx"], header["antenna_sel"] = 3, 1, 36
    header["payload_bytes"] = payload_bytes(3)
    header["host_s"], header["host_us"] = time_s.astype(int), (time_s % 1.0 * 1e6).astype(int)
    header["sender"] = np.frombuffer(bytes.fromhex(sender_mac.replace(":", "")), np.uint8)
    header["frame_count"] = np.arange(len(antenna_a))
    csi = np.zeros((*antenna_a.shape, 3, 1), np.complex64)
    csi[:, :, 0, 0] = antenna_a
    return CsiLog(header, csi)


def refusal(path: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """The one line on stderr with which the command ends."""
    assert main([str(path), "--out", str(path.parent / "pictures")]) == 2
    line = capsys.readouterr().err
    assert line.count("\n") == 1
    return line
