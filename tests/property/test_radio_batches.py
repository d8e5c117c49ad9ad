"""Radio of many worlds at once: each world is what it would be alone, whatever else is in the batch."""

from typing import Any, NamedTuple

import numpy as np
import pytest

from wifipgo.errors import BadInputError
from wifipgo.radio import aoa
from wifipgo.radio.channel.csi import RadioConfig
from wifipgo.radio.channel.impairments import EpisodeImpairments, ImpairmentConfig, draw_episode_impairments
from wifipgo.radio.links import Links, probe_links
from wifipgo.radio.propagation.materials import Slab
from wifipgo.radio.propagation.paths import DIFFRACTED, Paths, Surfaces, surfaces_of, trace_paths
from wifipgo.radio.propagation.scenes import Scenes
from wifipgo.radio.turn_profiles import listen
from wifipgo.rows import Chance, Generators, Rows
from wifipgo.segments import polygon_edges

CARRIER_HZ, N_ROBOTS = 5.0e9, 4
SQUARE_M = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
# Without its upper left quarter: not convex.
ANGLE_M = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.6, 1.0], [0.6, 0.5], [0.0, 0.5]])


def box(x_m: float, y_m: float) -> np.ndarray:
    return np.array([x_m, y_m]) + np.array([1.0, 0.8]) * SQUARE_M


# Corners of the room over its size; boxes, of which some touch each other or a wall.
ROOMS: list[tuple[np.ndarray, float, list[np.ndarray]]] = [
    (SQUARE_M, 9.0, []),
    (SQUARE_M, 12.0, [box(3.0, 3.0)]),
    (SQUARE_M, 10.0, [box(3.0, 3.0), box(4.0, 3.0), box(6.0, 6.5)]),
    (SQUARE_M, 11.0, [box(0.0, 4.0), np.array([[6.0, 2.0], [8.0, 4.0], [5.0, 4.5]])]),
    (ANGLE_M, 12.0, [box(8.0, 7.0)]),
]
# Clear of everything in every room.
AISLES_M = np.array([[1.0, 1.0], [8.6, 1.2], [2.0, 2.5], [8.4, 5.6], [3.4, 5.4], [8.5, 3.0], [1.2, 5.5]])


class Batch(NamedTuple):
    """Worlds side by side."""

    rows: Rows
    each: list[Surfaces]
    p_m: np.ndarray
    yaw_rad: np.ndarray

    @property
    def scenes(self) -> Scenes:
        """All of them."""
        return Scenes.of(self.each)

    def alone(self, world: int) -> np.ndarray:
        """Robots of one world."""
        return self.p_m[self.of(world)]

    def of(self, world: int) -> slice:
        """Rows of one world."""
        return slice(world * self.rows.n_robots, (world + 1) * self.rows.n_robots)


def batch(seed: int = 0, rooms: Any = ROOMS) -> Batch:
    rng = np.random.default_rng(seed)
    each = [
        surfaces_of(
            polygon_edges(size_m * corners),
            boxes_m,
            carrier_hz=CARRIER_HZ,
            wall=Slab("concrete", float(rng.uniform(0.1, 0.3))),
            obstacle=Slab("wood", 0.03),
        )
        for corners, size_m, boxes_m in rooms
    ]
    places = [AISLES_M[rng.permutation(len(AISLES_M))[:N_ROBOTS]] for _ in rooms]
    p_m = np.concatenate(places) + rng.uniform(-0.1, 0.1, (len(rooms) * N_ROBOTS, 2))
    return Batch(Rows(len(rooms), N_ROBOTS), each, p_m, rng.uniform(-3.0, 3.0, len(p_m)))


def assert_same_paths(got: Paths, alone: Paths) -> None:
    """Equal to the bit, but for columns of padding."""
    n = alone.order.shape[1]
    for ours, theirs in zip(got, alone, strict=True):
        np.testing.assert_array_equal(ours[:, :n], theirs)
    assert (got.order[:, n:] == -1).all()
    assert not got.gain[:, n:].any()


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("penetration", [True, False])
@pytest.mark.parametrize(
    ("max_order", "diffraction"), [(0, False), (1, False), (2, False), (0, True), (2, True)]
)
def test_paths_are_those_of_each_world_alone(
    max_order: int, diffraction: bool, penetration: bool, seed: int
) -> None:
    worlds, rng = batch(seed), np.random.default_rng(seed)
    low, high = np.triu_indices(N_ROBOTS, 1)
    world = np.repeat(np.arange(worlds.rows.n_worlds), len(low))
    base = world * N_ROBOTS
    tx, rx = np.tile(low, worlds.rows.n_worlds) + base, np.tile(high, worlds.rows.n_worlds) + base
    mixed = rng.permutation(len(tx))
    options: dict[str, Any] = {
        "carrier_hz": CARRIER_HZ,
        "max_order": max_order,
        "penetration": penetration,
        "diffraction": diffraction,
    }
    got = trace_paths(
        worlds.p_m[tx[mixed]], worlds.p_m[rx[mixed]], worlds.scenes, world=world[mixed], **options
    )
    assert max_order + diffraction == 0 or len(np.unique((got.order >= 0).sum(axis=1))) > 1
    assert diffraction == bool((got.order == DIFFRACTED).any())
    for k, surfaces in enumerate(worlds.each):
        own = np.flatnonzero(world[mixed] == k)
        alone = trace_paths(worlds.p_m[tx[mixed][own]], worlds.p_m[rx[mixed][own]], surfaces, **options)
        assert_same_paths(got.only(own), alone)
        one = trace_paths(worlds.p_m[tx[mixed][own[:1]]], worlds.p_m[rx[mixed][own[:1]]], surfaces, **options)
        assert_same_paths(alone.only(np.array([0])), one)


def standing(worlds: Batch, rng: Chance, n_worlds: int, **changes: Any) -> EpisodeImpairments:
    cfg = ImpairmentConfig(**changes)
    return draw_episode_impairments(
        cfg, n_robots=N_ROBOTS, n_antennas=2, size_m=8.0, rng=rng, n_worlds=n_worlds
    )


def generators(n_worlds: int, seed: int) -> list[np.random.Generator]:
    return [np.random.default_rng([seed, world]) for world in range(n_worlds)]


def assert_same_links(got: Links, alone: Links, rows: slice) -> None:
    np.testing.assert_array_equal(got.rate_mbit_s[rows], alone.rate_mbit_s)
    np.testing.assert_array_equal(got.esnr_db[rows], alone.esnr_db)


@pytest.mark.parametrize("bandwidth_hz", [20e6, 40e6])
@pytest.mark.parametrize(("tx_power_dbm", "diffraction"), [(-38.0, False), (-12.0, False), (-30.0, True)])
def test_links_are_those_of_each_world_alone(
    tx_power_dbm: float, diffraction: bool, bandwidth_hz: float
) -> None:
    worlds = batch()
    radio = RadioConfig(
        tx_power_dbm=tx_power_dbm, bandwidth_hz=bandwidth_hz, max_order=2, diffraction=diffraction
    )
    got = probe_links(worlds.p_m, worlds.scenes, radio, rows=worlds.rows)
    for k, surfaces in enumerate(worlds.each):
        alone = probe_links(worlds.alone(k), surfaces, radio)
        assert_same_links(got, alone, worlds.of(k))
        assert_same_paths(got.paths.only(got.row[worlds.of(k)][0, 1:]), alone.paths.only(alone.row[0, 1:]))
    assert (got.rate_mbit_s > 0.0).any()
    silent = got.rate_mbit_s == 0.0
    assert silent[np.arange(len(worlds.p_m)), np.arange(len(worlds.p_m)) % N_ROBOTS].all()
    assert (got.esnr_db[silent] == -30.0).all()
    assert (got.esnr_db[~silent] >= 4.0).all()


@pytest.mark.parametrize("n_robots", [2, 3])
@pytest.mark.parametrize("max_order", [0, 1])
def test_a_single_link_is_that_of_the_batch(n_robots: int, max_order: int) -> None:
    """Products of one number with many are rounded otherwise by numpy than of many with many."""
    worlds, rows = batch(4), Rows(len(ROOMS), n_robots)
    p_m = worlds.p_m.reshape(-1, N_ROBOTS, 2)[:, :n_robots].reshape(-1, 2)
    radio, turn = RadioConfig(max_order=max_order), aoa.AoaConfig()
    links = probe_links(p_m, worlds.scenes, radio, rows=rows)
    receiver = np.arange(0, len(rows), n_robots)
    yaw_rad, rng = np.zeros(len(rows)), Generators(generators(len(ROOMS), 5))
    got = listen(links, receiver, receiver + 1, yaw_rad, radio=radio, turn=turn, rng=rng)
    for k, surfaces in enumerate(worlds.each):
        own = slice(k * n_robots, (k + 1) * n_robots)
        alone = probe_links(p_m[own], surfaces, radio)
        assert_same_links(links, alone, own)
        zero, chance = np.zeros(1, dtype=int), generators(len(ROOMS), 5)[k]
        heard = listen(alone, zero, zero + 1, yaw_rad[own], radio=radio, turn=turn, rng=chance)
        np.testing.assert_array_equal(got[k : k + 1], heard)


def test_pairs_that_are_asked_for_are_those_of_the_list() -> None:
    """A few of many pairs, either way round and twice, are traced again."""
    worlds = batch(1)
    links = probe_links(worlds.p_m, worlds.scenes, RadioConfig(), rows=worlds.rows)
    a, b = np.array([5, 0, 2, 5]), np.array([4, 3, 1, 4])
    assert_same_paths(links.paths.only(links.row[a, b % N_ROBOTS]), links.between(a, b))


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"diffuse_ratio": 0.5},
        {
            "packet_loss": 0.3,
            "chain_phase_rad": 0.5,
            "heading_noise_rad": 0.02,
            "heading_bias_rad": 0.1,
            "agc": True,
            "int8": True,
        },
        {"noise_floor": False, "common_phase": False, "timing_jitter_s": 0.0},
    ],
)
@pytest.mark.parametrize("estimator", sorted(aoa.ESTIMATORS))
def test_profiles_are_those_of_each_world_alone(estimator: str, changes: dict[str, Any]) -> None:
    """To the bit: who listens to whom differs from world to world, and one listens to nobody."""
    worlds, radio, turn = batch(2), RadioConfig(tx_power_dbm=-20.0), aoa.AoaConfig(aoa_estimator=estimator)
    n_worlds = worlds.rows.n_worlds
    kept = standing(worlds, Generators(generators(n_worlds, 1)), n_worlds, **changes)
    links = probe_links(worlds.p_m, worlds.scenes, radio, kept, rows=worlds.rows)
    wanted = np.random.default_rng(3).random((len(worlds.p_m), N_ROBOTS)) < 0.4
    wanted[np.arange(len(wanted)), np.arange(len(wanted)) % N_ROBOTS] = False
    wanted[worlds.of(1)] = False
    receiver, peer = np.nonzero(wanted)
    sender, world = receiver // N_ROBOTS * N_ROBOTS + peer, receiver // N_ROBOTS
    rng = Generators(generators(n_worlds, 2))
    options: dict[str, Any] = {"radio": radio, "turn": turn}
    got = listen(links, receiver, sender, worlds.yaw_rad, rng=rng, standing=kept, **options)
    assert got.max() > 0.3
    for k, surfaces in enumerate(worlds.each):
        own, base = world == k, k * N_ROBOTS
        plain = standing(worlds, generators(n_worlds, 1)[k], 1, **changes)
        np.testing.assert_array_equal(plain.chain_rad, kept.chain_rad[worlds.of(k)])
        alone = probe_links(worlds.alone(k), surfaces, radio, plain)
        assert_same_links(links, alone, worlds.of(k))
        profile = listen(
            alone,
            receiver[own] - base,
            sender[own] - base,
            worlds.yaw_rad[worlds.of(k)],
            rng=generators(n_worlds, 2)[k],
            standing=plain,
            **options,
        )
        np.testing.assert_array_equal(got[own], profile)


def test_worlds_that_are_alike_share_one_scene() -> None:
    worlds = batch(0, [ROOMS[2]] * 3)
    shared = probe_links(worlds.p_m, worlds.each[0], RadioConfig(), rows=worlds.rows)
    each = [worlds.each[0]] * 3
    apart = probe_links(worlds.p_m, Scenes.of(each), RadioConfig(), rows=worlds.rows)
    assert_same_links(shared, apart, slice(None))


def test_the_robot_that_is_nowhere_is_named() -> None:
    worlds = batch()
    p_m = worlds.p_m.copy()
    p_m[9] = [3.5, 3.4]  # in a box of the third world, and nowhere in the first
    with pytest.raises(BadInputError, match=r"p_m must be inside the room and outside .* at robot 9,"):
        probe_links(p_m, worlds.scenes, RadioConfig(), rows=worlds.rows)
    p_m[9] = p_m[8]
    with pytest.raises(BadInputError, match=r"p_m must differ.* at robots 8 and 9"):
        probe_links(p_m, worlds.scenes, RadioConfig(), rows=worlds.rows)
    with pytest.raises(BadInputError, match="rows must be those of 20 robots"):
        probe_links(p_m, worlds.scenes, RadioConfig(), rows=Rows(5, 3))
    with pytest.raises(BadInputError, match="world must be given where there are 5 scenes"):
        trace_paths(p_m[:1], p_m[1:2], worlds.scenes, carrier_hz=CARRIER_HZ)
    with pytest.raises(BadInputError, match=r"world must be in 0..4"):
        trace_paths(p_m[:1], p_m[1:2], worlds.scenes, carrier_hz=CARRIER_HZ, world=np.array([5]))


def test_a_body_that_touches_a_box_of_its_own_world_is_put_in_front_of_it() -> None:
    worlds = batch()
    p_m = worlds.p_m.copy()
    p_m[9] = [3.0005, 3.4]
    got = probe_links(p_m, worlds.scenes, RadioConfig(), rows=worlds.rows)
    alone = probe_links(p_m[worlds.of(2)], worlds.each[2], RadioConfig())
    assert_same_links(got, alone, worlds.of(2))
