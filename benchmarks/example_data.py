"""Writes the data that ship with the package, the same to the byte each time.

Run: ``python -m benchmarks.example_data [FOLDER]``. Recordings of receivers that move in simulated rooms
(`benchmarks.simulated_rooms`), as a pack of links and as the raw logs of one run; and the pose graph of a
team of which some measurements are wrong. All of it is drawn from fixed seeds.
"""

import json
import sys
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import tyro
from jaxtyping import Float

from benchmarks.simulated_rooms import BOXES, TIMING_S, WALLS, Room, draw_link, one_way_channel, reported
from wifipgo import se2
from wifipgo.command.command_line import exit_code, say
from wifipgo.data import CSI, GRAPH, PACK, RUN, example_data
from wifipgo.files.atomic_files import write_text
from wifipgo.graph.files.g2o import write_g2o
from wifipgo.graph.posegraph import PoseGraph, pose_graph
from wifipgo.radio.propagation.paths import surfaces_of
from wifipgo.radio.recordings.intel5300 import HOST_STAMPED, CsiLog, encode_csi_log, payload_bytes
from wifipgo.radio.recordings.wsr_dataset import MACS, TRUTH_FILE
from wifipgo.radio.recordings.wsr_packs import PACK_CHANNEL

BLOCKED = (False, False, False, False, True, True)  # links of the pack: of line of sight, or behind something
EVERY = 3  # of the simulated packets, to keep the files small

STAMP, START_S = "2026-01-01_000000", 1_767_225_600.0
SIZE_M, AT_M, HEIGHT_M = (8.0, 6.0), np.array([2.2, 3.4]), 0.2
BOXES_M = np.array([[3.2, 1.2, 4.4, 2.0], [5.6, 3.9, 6.4, 5.0]])
SPOTS_M = {"tx2": (6.8, 2.9), "tx3": (1.0, 5.2), "tx4": (5.5, 0.8)}  # tx4 is behind a box
N_PACKETS, PERIOD_S, REST_S, MOVE_S = 140, 0.03, 0.3, 3.6
RADIUS_M, CAPTURE_S = 0.31, 0.02

N_ROBOTS, N_POSES, WRONG_SHARE = 4, 60, 0.15
SIGMA = np.array([0.05, 0.05, np.deg2rad(1.0)])  # of every measurement: m, m, rad
SEES_M, N_CLOSURES = 4.0, 120


def write_pack(path: Path) -> None:
    """Links in rooms of their own, paired and cut to the motion."""
    arrays: dict[str, Any] = {}
    about = []
    for k, blocked in enumerate(BLOCKED):
        rng = np.random.default_rng([15, k])
        room, channel = draw_link(rng, blocked=blocked)
        for letter, timing_s in zip("fr", TIMING_S, strict=True):
            arrays[f"{letter}{k}"] = parts_of(reported(channel, timing_s, rng)[::EVERY])
        path_m = np.column_stack([room.position_m, np.full(len(room.position_m), HEIGHT_M)])[::EVERY]
        arrays[f"p{k}"] = (path_m - path_m[0]).astype(np.float32)
        kind = "behind_an_obstacle" if blocked else "line_of_sight"
        bearing_deg = round(float(np.rad2deg(room.truth_rad)), 6)
        told = {"set": kind, "loc": f"room {k}", "stamp": STAMP, "tx": "tx2", "bearing_mean": bearing_deg}
        about.append(told)
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez(path, meta=np.array(json.dumps(about)), **arrays)


def parts_of(csi: np.ndarray) -> np.ndarray:
    """Real and imaginary parts, as the card reports them."""
    return np.stack([csi.real, csi.imag], axis=-1).astype(np.int8)


def write_run(folder: Path) -> None:
    """Logs of a receiver and three transmitters, motion capture and survey of one room."""
    folder.mkdir(parents=True, exist_ok=True)
    received = []
    for k, (name, spot_m) in enumerate(SPOTS_M.items()):
        rng = np.random.default_rng([16, k])
        time_s = START_S + rng.uniform(0.0, 0.004) + PERIOD_S * np.arange(N_PACKETS)
        channel = one_way_channel(room_of(np.array(spot_m), time_s), rng)
        turn_rad = rng.uniform(-np.pi, np.pi, (N_PACKETS, 1))  # of oscillators that are not locked
        forward = reported(channel * np.exp(1j * turn_rad), TIMING_S[0], rng)
        reverse = reported(channel * np.exp(-1j * turn_rad), TIMING_S[1], rng)
        received.append(log_of(forward, MACS[name], time_s))
        answered = log_of(reverse, MACS["rx"], time_s + 17.0)  # by a clock of its own
        (folder / f"csi_{name}_{STAMP}.dat").write_bytes(encode_csi_log(answered))
    header, csi = (np.concatenate(parts) for parts in zip(*(log[:2] for log in received), strict=True))
    order = np.argsort(CsiLog(header, csi).time_s, kind="stable")
    (folder / f"csi_rx_{STAMP}.dat").write_bytes(encode_csi_log(CsiLog(header[order], csi[order])))
    write_text(folder / f"rx_trajectory_{STAMP}_.csv", _motion_capture())
    write_text(folder / TRUTH_FILE, json.dumps(_survey(), indent=1) + "\n")


def room_of(spot_m: Float[np.ndarray, "2"], time_s: Float[np.ndarray, " packets"]) -> Room:
    """The room, with a transmitter and where the receiver is at some times."""
    x, y = SIZE_M
    corners_m = np.array([[0.0, 0.0], [x, 0.0], [x, y], [0.0, y]])
    boxes_m = [np.array([[a, b], [c, b], [c, d], [a, d]]) for a, b, c, d in BOXES_M.tolist()]
    surfaces = surfaces_of(
        np.stack([corners_m, np.roll(corners_m, -1, axis=0)], axis=1),
        boxes_m,
        carrier_hz=5.0e9 + 5.0e6 * PACK_CHANNEL,
        wall=WALLS,
        obstacle=BOXES[:2],
    )
    return Room(np.array(SIZE_M), BOXES_M, surfaces, spot_m, position_at(time_s))


def position_at(time_s: Float[np.ndarray, " times"]) -> Float[np.ndarray, "times 2"]:
    """Half a circle, at rest before and after; map frame, m."""
    turned_rad = np.pi * np.clip((time_s - START_S - REST_S) / MOVE_S, 0.0, 1.0)
    return AT_M + RADIUS_M * np.stack([np.sin(turned_rad), -np.cos(turned_rad)], axis=1)


def log_of(antenna_a: np.ndarray, sender_mac: str, time_s: np.ndarray) -> CsiLog:
    """A host-stamped log of a card that listens with antenna A only."""
    header = np.zeros(len(antenna_a), HOST_STAMPED)
    header["n_rx"], header["n_tx"], header["noise_dbm"] = 1, 1, -127
    header["payload_bytes"] = payload_bytes(1)
    header["host_s"], header["host_us"] = time_s.astype(int), (time_s % 1.0 * 1e6).astype(int)
    header["sender"] = np.frombuffer(bytes.fromhex(sender_mac.replace(":", "")), np.uint8)
    header["frame_count"] = np.arange(len(antenna_a))
    return CsiLog(header, antenna_a.astype(np.complex64)[:, :, None, None])


def _motion_capture() -> str:
    """Seconds, nanoseconds to add, x, y, z."""
    time_s = START_S + np.arange(-0.2, N_PACKETS * PERIOD_S + 0.2, CAPTURE_S)
    lines = [
        f"{t:.3f},0,{x:.5f},{y:.5f},{HEIGHT_M},"
        for t, (x, y) in zip(time_s, position_at(time_s), strict=True)
    ]
    return "\n".join(lines) + "\n"


def _survey() -> dict[str, object]:
    spots = {name: {"position": {"x": x, "y": y, "z": HEIGHT_M}} for name, (x, y) in SPOTS_M.items()}
    about = {"channel": PACK_CHANNEL, "true_rx_position": "simulated room", "true_tx_positions": spots}
    return {name: {"value": value} for name, value in about.items()}


class Team(NamedTuple):
    """A graph, true poses of its rows, and which of its measurements are wrong."""

    graph: PoseGraph
    truth: Float[np.ndarray, "poses 3"]
    wrong: set[tuple[int, int]]  # rows of tail and head


def team_graph() -> Team:
    """Robots that go round in one hall, see places and each other again, and are sometimes wrong."""
    rng = np.random.default_rng(17)
    robot, index = np.indices((N_ROBOTS, N_POSES)).reshape(2, -1)
    truth = np.concatenate([_round_trip(k) for k in range(N_ROBOTS)])
    tail, head = _ends(truth, robot, rng)
    z = _measured(se2.between(truth[tail], truth[head]), rng)
    loops = np.arange(N_ROBOTS * (N_POSES - 1), len(tail))
    wrong = rng.choice(loops, round(WRONG_SHARE * N_CLOSURES), replace=False)
    z[wrong] = _measured(rng.uniform([-3.0, -3.0, -np.pi], [3.0, 3.0, np.pi], (len(wrong), 3)), rng)
    keys = np.stack([robot, index], axis=-1)
    graph = pose_graph(
        robot=robot,
        index=index,
        poses=_dead_reckoned(truth, z),
        tail=keys[tail],
        head=keys[head],
        z=z,
        information=np.tile(np.diag(SIGMA**-2), (len(tail), 1, 1)),
    )
    return Team(graph, truth, set(zip(tail[wrong].tolist(), head[wrong].tolist(), strict=True)))


def _round_trip(robot: int) -> Float[np.ndarray, "poses 3"]:
    """Twice round an ellipse of its own that crosses those of the others."""
    turn_rad = np.linspace(0.0, 4.0 * np.pi, N_POSES)
    middle_m = np.array([4.0 * (robot % 2), 3.0 * (robot // 2)])
    at_m = middle_m + np.stack([5.0 * np.cos(turn_rad), 3.5 * np.sin(turn_rad)], axis=1)
    yaw_rad = np.arctan2(3.5 * np.cos(turn_rad), -5.0 * np.sin(turn_rad))
    return np.column_stack([at_m, yaw_rad])


def _ends(truth: np.ndarray, robot: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Rows of odometry, then of poses that are in sight of each other and not neighbours."""
    row = np.arange(len(truth)).reshape(N_ROBOTS, N_POSES)
    first, second = np.triu_indices(len(truth), 5)
    near = np.hypot(*(truth[first] - truth[second]).T[:2]) < SEES_M
    chosen = rng.choice(np.flatnonzero(near), N_CLOSURES, replace=False)
    return (
        np.append(row[:, :-1].ravel(), first[chosen]),
        np.append(row[:, 1:].ravel(), second[chosen]),
    )


def _measured(z: Float[np.ndarray, "edges 3"], rng: np.random.Generator) -> Float[np.ndarray, "edges 3"]:
    return se2.compose(z, SIGMA * rng.standard_normal(z.shape))


def _dead_reckoned(truth: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Poses along the odometry of each robot from its true start."""
    poses = truth.reshape(N_ROBOTS, N_POSES, 3).copy()
    steps = z[: N_ROBOTS * (N_POSES - 1)].reshape(N_ROBOTS, N_POSES - 1, 3)
    for k in range(1, N_POSES):
        poses[:, k] = se2.compose(poses[:, k - 1], steps[:, k - 1])
    return poses.reshape(-1, 3)


def write_all(folder: Path) -> None:
    """Everything that ships."""
    write_pack(folder / CSI / PACK)
    write_run(folder / CSI / RUN)
    write_g2o(folder / GRAPH, team_graph().graph)


def main(
    folder: Annotated[tyro.conf.Positional[Path | None], tyro.conf.arg(metavar="FOLDER")] = None,
) -> None:
    """Write the data that ship, by default to where they ship from."""
    write_all(folder or example_data())
    say(f"written: {folder or example_data()}")


if __name__ == "__main__":
    sys.exit(exit_code(lambda: tyro.cli(main, description=__doc__)))
