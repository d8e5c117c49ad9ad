"""Random boxes: those that drawing and trying them one by one gives, at a price that many boxes can pay."""

import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from envs.rendezvous_v0 import parallel_env
from wifipgo import segments
from wifipgo.world.layout import ArenaConfig
from wifipgo.world.map_checks import gap_to_obstacles
from wifipgo.world.placing import random_layout, random_obstacles
from wifipgo.world.polygons import area_m2

L_SHAPE = ((4.0, 4.0), (9.0, 4.0), (9.0, 5.0), (5.0, 5.0), (5.0, 9.0), (4.0, 9.0))
ROOMS: dict[str, dict[str, Any]] = {
    "few": {"n_obstacles": 4},
    "by share": {"obstacle_density": 0.2, "clearance_m": 0.3},
    "no passage": {"clearance_m": 0.0, "n_obstacles": 12},
    "beside a polygon and starts": {
        "obstacles_m": (L_SHAPE,),
        "obstacle_density": 0.08,
        "starts": ((1.0, 1.0, 0.0), (15.0, 15.0, 1.0)),
    },
    "slivers": {"obstacle_min_m": 0.01, "obstacle_max_m": 8.0, "n_obstacles": 6, "clearance_m": 0.3},
}


def gap_m(a: np.ndarray, b: np.ndarray) -> float:
    if segments.crossings(a, np.roll(a, -1, axis=0), segments.polygon_edges(b)).any():
        return 0.0
    return float(min(gap_to_obstacles(a, [b]).min(), gap_to_obstacles(b, [a]).min()))


def one_by_one(cfg: ArenaConfig, rng: np.random.Generator) -> list[np.ndarray]:
    """The rule as it reads: draw a box, measure its way to everything, keep it if all are wide enough."""
    kept, covered_m2, misses = [np.array(c) for c in cfg.obstacles_m], 0.0, 0
    boxes: list[np.ndarray] = []
    goal_m2, starts_m = cfg.obstacle_density * cfg.size_m**2, np.array(cfg.starts).reshape(-1, 3)[:, :2]
    while (len(boxes) < cfg.n_obstacles or covered_m2 < goal_m2) and misses < 2000:
        half = 0.5 * rng.uniform(cfg.obstacle_min_m, cfg.obstacle_max_m, 2)
        yaw = rng.uniform(0.0, 0.5 * np.pi)
        turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
        corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * half
        box = rng.uniform(0.0, cfg.size_m, 2) + corners @ turn.T
        fits = box.min() >= cfg.clearance_m and box.max() <= cfg.size_m - cfg.clearance_m
        fits = fits and gap_to_obstacles(starts_m, [box]).min(initial=np.inf) > 2.0 * cfg.robot_radius_m
        if fits and all(gap_m(box, other) >= cfg.clearance_m for other in kept):
            boxes.append(box)
            kept.append(box)
            covered_m2, misses = covered_m2 + area_m2(box), 0
        else:
            misses += 1
    factor = np.sqrt(goal_m2 / covered_m2) if goal_m2 else 1.0
    return boxes if misses == 2000 else [b.mean(axis=0) + factor * (b - b.mean(axis=0)) for b in boxes]


@pytest.mark.parametrize("room", ROOMS)
def test_boxes_are_those_of_one_try_after_the_other(room: str) -> None:
    """To rounding; the stream stands where single draws leave it, so starts are the same too."""
    cfg = ArenaConfig(**ROOMS[room])
    rng, plain = np.random.default_rng(0), np.random.default_rng(0)
    np.testing.assert_allclose(random_obstacles(cfg, rng=rng), one_by_one(cfg, plain), rtol=0.0, atol=1e-12)
    assert rng.random() == plain.random()


def test_a_full_room_refuses_after_as_many_tries_as_ever() -> None:
    """How much fitted, as found one by one for the first seed."""
    cfg = ArenaConfig(size_m=8.0, obstacle_density=0.6)
    with pytest.raises(ValueError, match=r"covered 0\.129"):
        random_obstacles(cfg, rng=np.random.default_rng(0))


def test_a_room_of_a_thousand_boxes_and_one_that_is_too_full_take_seconds() -> None:
    """All passages are kept, and the refusal says how much fitted."""
    begin = time.process_time()
    env = parallel_env("paper-hw-2", size_m=170.0, n_obstacles=1000)
    env.reset(seed=0)
    env.step({agent: np.array([0.5, 0.5, 1.0]) for agent in env.agents})
    with pytest.raises(ValueError, match=r"obstacle_density must be at most what fits .*covered 0\.1"):
        parallel_env("paper-hw-2", size_m=60.0, obstacle_density=0.3).reset(seed=0)
    assert time.process_time() - begin < 20.0
    boxes = np.array(env.world.layout.obstacles_m)
    middle_m = boxes.mean(axis=1)
    for k in range(0, 1000, 50):
        near = np.flatnonzero(np.hypot(*(middle_m - middle_m[k]).T) < 7.0)
        assert all(gap_m(boxes[k], boxes[j]) >= 1.0 for j in near if j != k)


def test_starts_among_many_boxes_are_free() -> None:
    """Every robot starts further than its own width from every box."""
    cfg = ArenaConfig(size_m=60.0, obstacle_density=0.15)
    layout = random_layout(100, cfg, rng=np.random.default_rng(4))
    assert gap_to_obstacles(layout.starts[:, :2], layout.obstacles_m).min() > 2.0 * cfg.robot_radius_m


@pytest.mark.parametrize("seed", range(3))
def test_starts_are_those_of_one_try_after_the_other(seed: int) -> None:
    cfg = ArenaConfig(size_m=9.0, n_obstacles=3, clearance_m=0.4)
    layout, plain = random_layout(25, cfg, rng=np.random.default_rng(seed)), np.random.default_rng(seed)
    boxes, kept = random_obstacles(cfg, rng=plain), np.zeros((0, 3))
    while len(kept) < 25:
        p_m, yaw = plain.uniform(0.3, 8.7, (1, 2)), plain.uniform(-np.pi, np.pi)
        apart_m = np.hypot(*(kept[:, :2] - p_m).T).min(initial=np.inf)
        if apart_m > 0.6 and gap_to_obstacles(p_m, boxes)[0] > 0.3:
            kept = np.concatenate([kept, [[*p_m[0], yaw]]])
    np.testing.assert_array_equal(layout.starts, kept)


def test_hundreds_of_boxes_and_starts_take_seconds() -> None:
    """At random, and taken over by hand, which is checked: start by start against what is near."""
    begin = time.process_time()
    layout = random_layout(400, ArenaConfig(size_m=120.0, n_obstacles=400), rng=np.random.default_rng(0))
    by_hand = ArenaConfig(
        size_m=120.0,
        obstacles_m=tuple(tuple(map(tuple, corners.tolist())) for corners in layout.obstacles_m),
        starts=tuple(map(tuple, layout.starts.tolist())),
    )
    assert time.process_time() - begin < 20.0
    np.testing.assert_array_equal(by_hand.starts, layout.starts)
    on_a_box = layout.obstacles_m[300].mean(axis=0).tolist()
    with pytest.raises(
        ValueError, match=r"starts\[1\] must be a robot's radius .* from .*obstacles_m\[300\]"
    ):
        replace(by_hand, starts=(by_hand.starts[0], (*on_a_box, 0.0)))


def test_double_reflections_of_very_many_faces_are_refused() -> None:
    """Their pairs would fill the memory; one reflection is fine."""
    with pytest.raises(ValueError, match="max_order must be at most 1 in a scene of more than 2000 faces"):
        parallel_env("paper-hw-2", size_m=150.0, n_obstacles=550, max_order=2).reset(seed=0)
