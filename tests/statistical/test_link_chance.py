"""Chance of a link is a function of world, iteration, receiver and sender; and as random as drawn numbers."""

from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy import stats

from baselines.policies import make_policy
from envs.rendezvous_v0 import parallel_env
from wifipgo.counters import Counters
from wifipgo.radio.channel.impairments import ImpairmentConfig, link_chance, true_headings
from wifipgo.radio.channel.receiver import draw_reception
from wifipgo.radio.turn_profiles import listen
from wifipgo.rows import Generators, Rows

SHAPE = (2, 16, 30)  # antennas, positions, subcarriers
ROWS = Rows(3, 5)
EVERYTHING = ImpairmentConfig(packet_loss=0.3, agc=True, int8=True, heading_noise_rad=0.1)


class Links(NamedTuple):
    """Who listens to whom."""

    receiver: np.ndarray
    sender: np.ndarray


def all_links(rows: Rows = ROWS) -> Links:
    """Everybody to everybody else of the same world."""
    receiver, peer = np.divmod(np.arange(len(rows) * rows.n_robots), rows.n_robots)
    sender = receiver - rows.peer(receiver) + peer
    apart = receiver != sender
    return Links(receiver[apart], sender[apart])


def streams(seed: int, n_worlds: int = ROWS.n_worlds) -> Generators:
    return Generators([np.random.default_rng([seed, world]) for world in range(n_worlds)])


def drawn(links: Links, rng: Any, rows: Rows = ROWS, cfg: ImpairmentConfig = EVERYTHING) -> list[Any]:
    """All that chance decides about a reception: headings, noise, oscillators, packets that arrive."""
    chance = link_chance(rng, *links, rows=rows)
    turn_rad = true_headings(np.zeros((len(links.receiver), SHAPE[1])), cfg, rng=chance)
    return [turn_rad, *draw_reception((len(links.receiver), *SHAPE), cfg, rng=chance)]


@pytest.mark.parametrize("seed", range(3))
def test_a_link_draws_the_same_whatever_other_links_there_are(seed: int) -> None:
    """And in whatever order; and the streams go on alike."""
    links, pick = all_links(), np.random.default_rng(seed)
    some = pick.permutation(len(links.receiver))[: pick.integers(1, len(links.receiver))]
    rng, other = streams(seed), streams(seed)
    for _ in range(3):
        all_of, few = drawn(links, rng), drawn(Links(*(end[some] for end in links)), other)
        for whole, part in zip(all_of, few, strict=True):
            np.testing.assert_array_equal(whole[some], part)
    assert rng.random((3, 1)).tolist() == other.random((3, 1)).tolist()


def test_a_link_draws_in_a_batch_and_in_a_larger_team_what_it_draws_alone() -> None:
    links, rng = all_links(), streams(4)
    together = drawn(links, rng)
    for world in range(ROWS.n_worlds):
        own = ROWS.world(links.receiver) == world
        mine = Links(*(end[own] - world * ROWS.n_robots for end in links))
        for alone in (Rows(1, ROWS.n_robots), Rows(1, 40)):
            for whole, part in zip(
                together, drawn(mine, np.random.default_rng([4, world]), alone), strict=True
            ):
                np.testing.assert_array_equal(whole[own], part)


@pytest.mark.parametrize(
    "off",
    [
        {"packet_loss": 0.0},
        {"common_phase": False, "timing_jitter_s": 0.0},
        {"heading_noise_rad": 0.0},
        {"noise_floor": False},
    ],
    ids=str,
)
def test_an_impairment_that_is_switched_off_leaves_the_others_as_they_were(off: dict[str, Any]) -> None:
    settings = {"packet_loss": 0.3, "agc": True, "int8": True, "heading_noise_rad": 0.1} | off
    links = all_links()
    less = drawn(links, streams(5), cfg=ImpairmentConfig(**settings))
    n_same = 0
    for one, other in zip(drawn(links, streams(5)), less, strict=True):
        if other is not None and other.any():
            np.testing.assert_array_equal(one, other)
            n_same += 1
    assert n_same == 3


def numbers(kind: str, k: int = 12) -> np.ndarray:
    """Normal numbers by seed, iteration, world, receiver, sender, cause and place in the stream."""
    links, found = all_links(), []
    for seed in range(4):
        rng = streams(seed)
        for _ in range(10):
            chance = link_chance(rng, *links, rows=ROWS)
            each = [chance.stream(cause) for cause in range(4)]
            found.append(np.stack([getattr(one, kind)((len(links.receiver), k)) for one in each], axis=1))
    return np.array(found).reshape(4, 10, ROWS.n_worlds, -1, 4, k)


def test_numbers_of_links_have_the_law_and_nothing_to_do_with_each_other() -> None:
    """Across seeds, iterations, worlds, links, causes and places: 230 000 numbers."""
    normal, uniform = numbers("standard_normal"), numbers("random")
    assert stats.kstest(normal.ravel(), "norm").pvalue > 1e-3
    assert stats.kstest(uniform.ravel(), "uniform").pvalue > 1e-3
    assert abs((normal**4).mean() - 3.0) < 6.0 * np.sqrt(96.0 / normal.size)
    few = 5.0 / np.sqrt(normal.size / 2)
    for axis in range(normal.ndim):
        a, b = (
            np.take(normal, range(1, normal.shape[axis]), axis),
            np.take(normal, range(normal.shape[axis] - 1), axis),
        )
        assert abs((a * b).mean()) < few
        assert abs(((a**2 - 1.0) * (b**2 - 1.0)).mean()) < 2.0 * few
    assert len(np.unique(normal)) == normal.size  # no stretch comes twice


def test_both_directions_of_a_link_have_chance_of_their_own() -> None:
    there, back = Links(np.array([0]), np.array([1])), Links(np.array([1]), np.array([0]))
    a, b = (
        link_chance(streams(0), *way, rows=ROWS).standard_normal((1, 4000)).ravel() for way in (there, back)
    )
    assert abs(np.corrcoef(a, b)[0, 1]) < 5.0 / np.sqrt(4000)


def test_whole_numbers_are_equally_probable() -> None:
    chance = Counters(np.arange(20_000, dtype=np.uint64))
    counts = np.bincount(chance.integers(8, size=(20_000, 4)).ravel(), minlength=8)
    assert stats.chisquare(counts).pvalue > 1e-3
    assert chance.random().shape == (20_000,)


def heard_by(
    policy: str, monkeypatch: pytest.MonkeyPatch
) -> tuple[dict[tuple[int, int, int], Any], np.ndarray]:
    """Key of every link that is heard, by iteration, receiver and sender; and where robots end."""
    found: dict[tuple[int, int, int], Any] = {}
    t = [0]

    def listens(links: Any, receiver: np.ndarray, sender: np.ndarray, **named: Any) -> np.ndarray:
        for a, b, key in zip(receiver.tolist(), sender.tolist(), named["rng"].key.tolist(), strict=True):
            found[t[0], a, b] = key
        profile: np.ndarray = listen(links, receiver, sender, **named)
        return profile

    with monkeypatch.context() as patch:
        patch.setattr("wifipgo.loop.aoa_measurements.listen", listens)
        env = parallel_env("paper-sim-2", n_robots=5, n_slots=2, size_m=15.0, n_steps=12)
        driver = make_policy(policy, env.scenario)
        driver.reset(3)
        observations, _ = env.reset(seed=3)
        while env.agents:
            t[0] += 1
            observations, *_ = env.step(driver.act(observations))
    return found, env.tick.truth.poses[:, -1]


def test_policies_that_part_ways_hear_each_link_in_the_same_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    """In every iteration, though they hear other links from other places."""
    (one, here), (other, there) = (heard_by(policy, monkeypatch) for policy in ("random", "frontier_home"))
    assert np.abs(here - there).max() > 1.0
    assert one.keys() != other.keys()
    both = one.keys() & other.keys()
    assert len({t for t, *_ in both}) == 13
    assert all(one[link] == other[link] for link in both)
    assert len(set(one.values())) == len(one)
