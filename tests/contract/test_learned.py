"""A trained policy as a file: what it refuses, and that it has no favourite direction."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from baselines.evaluate import main
from baselines.policies import make_policy
from baselines.policies.learned.interfaces import make_interface
from baselines.policies.learned.network import Layer, Network, layout_of, load_network, perceptron, plain
from baselines.policies.learned.policy import LearnedPolicy, shipped
from baselines.policies.learned.ray_interface import N_DIRECTION, Rays
from envs import _observation
from envs._observation import BLOCKS, Block
from envs.directions import STAY
from envs.rendezvous_v0 import parallel_env
from wifipgo.scenarios import Scenario, scenario_named


def rows_of(scenario: str, seed: int, n_steps: int) -> np.ndarray:
    """Observations in the middle of an episode."""
    env = parallel_env(scenario)
    policy = make_policy("random", env.scenario)
    policy.reset(seed)
    observations, _ = env.reset(seed=seed)
    for _ in range(n_steps):
        observations, *_ = env.step(policy.act(observations))
    return np.stack(list(observations.values()))


def flat_network(scenario: str) -> Network:
    """One layer that answers with the first three numbers of the observation."""
    sc = scenario_named(scenario)
    n = sum(size for _, size in layout_of(sc))
    return Network(
        interface="flat",
        nets={"action": [Layer(np.eye(3, n), np.zeros(3))]},
        mean=np.zeros(n),
        variance=np.ones(n),
        clip=10.0,
        layout=layout_of(sc),
        scenario=plain(sc),
    )


def test_a_quarter_turn_of_the_body_turns_the_choice() -> None:
    """The world turns by -90 degrees in the body frame: 4 of 16 rays, 18 of 72 profile bins."""
    scenario, network = scenario_named("paper-sim-2"), shipped()
    rows = rows_of("paper-sim-2", 5, 12)
    field = {f.name: f.where for f in parallel_env(scenario).layout}
    turned = rows.copy()
    turned[:, field["lidar"]] = np.roll(rows[:, field["lidar"]], -4, axis=1)
    turned[:, field["slot0/profile"]] = np.roll(rows[:, field["slot0/profile"]], -18, axis=1)
    c, s = rows[:, field["own/heading"]].T
    turned[:, field["own/heading"]] = np.stack([-s, c], axis=1)
    c, s = rows[:, field["own/sighted_bearing"]].T
    turned[:, field["own/sighted_bearing"]] = np.stack([s, -c], axis=1)
    # Statistics that know no direction: those of ray 0 for all.
    interface = make_interface(network.interface, scenario)
    assert isinstance(interface, Rays)
    n = interface.n_whole
    even: dict[str, Any] = {
        name: np.concatenate([getattr(network, name)[:n], np.repeat(getattr(network, name)[n::STAY], STAY)])
        for name in ("mean", "variance")
    }
    network = replace(network, **even)
    before, after = (network.scores(interface.shown(each)) for each in (rows, turned))
    np.testing.assert_allclose(after[:, :STAY], np.roll(before[:, :STAY], -4, axis=1), atol=1e-4)
    np.testing.assert_allclose(after[:, STAY:], before[:, STAY:], atol=1e-4)


def test_answers_and_commands_are_inverse_in_the_open() -> None:
    rays, rows = Rays(scenario_named("paper-sim-2")), rows_of("paper-sim-2", 0, 0)
    rows = np.repeat(rows[:1], 2 * (STAY + 1), axis=0)
    lidar = next(f for f in parallel_env("paper-sim-2").layout if f.name == "lidar")
    rows[:, lidar.where] = 1.0
    answers = np.stack(np.meshgrid(np.arange(STAY + 1), [0, 1], indexing="ij"), -1).reshape(-1, 2)
    np.testing.assert_array_equal(rays.answers(rays.commands(answers, rows)), answers)


def test_nothing_is_new_outside_the_room() -> None:
    """At the start in the middle of one's own survey, what lies ahead is new; beyond the walls nothing is."""
    scenario = scenario_named("paper-sim-2", starts=((10.0, 10.0, 0.0), (2.0, 2.0, 0.0)))
    env = parallel_env(scenario)
    observations, _ = env.reset(seed=0)
    shown = Rays(scenario).shown(np.stack(list(observations.values())))
    new = shown[:, -N_DIRECTION * STAY :].reshape(2, N_DIRECTION, STAY)[:, 3:8]
    at_6_m = new[0, 2]  # 3 steps of 2 m from the middle of the room: all directions are alike
    assert np.ptp(at_6_m) < 0.25
    assert at_6_m.min() > 0.7
    corner = new[1, 4]  # 16 m from a corner: only the quadrant that faces the room
    assert corner[0] > 0.5
    np.testing.assert_array_equal(corner[5:12], 0.0)


@pytest.mark.parametrize(("size_m", "sensor_range_m"), [(10.0, 1.1), (10.0, 3.0), (4.0, 4.5), (40.0, 0.4)])
def test_what_is_new_ahead_is_a_mean_over_a_disc(size_m: float, sensor_range_m: float) -> None:
    """One square is new: ahead there is what the disc around has of it."""
    scenario = scenario_named("paper-sim-2", size_m=size_m, sensor_range_m=sensor_range_m)
    rays, field = Rays(scenario), {f.name: f for f in parallel_env(scenario).layout}
    side, new = 16, (7, 9)
    row = np.zeros((1, field["slot0/profile"].where.stop), np.float32)
    row[:, field["own/heading"].where] = [1.0, 0.0]
    row[:, field["survey"].where] = 1.0
    row[0, field["survey"].where.start + new[0] * side + new[1]] = 0.0
    at = np.stack(np.meshgrid(np.arange(side), np.arange(side), indexing="ij"), -1)
    apart = np.hypot(*(at[:, :, None, None] - at).transpose(4, 0, 1, 2, 3))
    near = apart <= sensor_range_m / size_m * side
    line = np.pad(near[new][:, new[1]] / near.sum(axis=(2, 3)).max(), 1)
    step_bins = side * scenario.arena.steps_m(2).mean() / size_m
    for begin in range(3, 13):  # a step ahead along x from the middle of a square
        row[:, field["own/position"].where] = (begin + 0.5) / side, (new[1] + 0.5) / side
        ahead = rays.shown(row)[0, -N_DIRECTION * 16 :].reshape(N_DIRECTION, 16)[3, 0]
        expected = np.interp(begin + step_bins, np.arange(-1, side + 1), line)
        assert ahead == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize(("scenario", "n_robots"), [("paper-sim-2", 2), ("paper-hw-2-obstacles", 4)])
def test_a_row_is_shown_alone_as_among_others(scenario: str, n_robots: int) -> None:
    changes = {"n_robots": n_robots, "n_slots": n_robots - 1}
    sc = scenario_named(scenario, **changes)
    rays, n_numbers = Rays(sc), max(f.where.stop for f in parallel_env(sc).layout)
    rows = np.random.default_rng(0).uniform(0.0, 1.0, (40, n_numbers)).astype(np.float32)
    answers = np.random.default_rng(1).integers(0, (17, 2), (40, 2))
    shown, commands = rays.shown(rows), rays.commands(answers, rows)
    for k in range(40):
        np.testing.assert_array_equal(rays.shown(rows[k : k + 1])[0], shown[k])
        np.testing.assert_array_equal(rays.commands(answers[k : k + 1], rows[k : k + 1])[0], commands[k])


def test_a_file_is_what_was_saved(tmp_path: Path) -> None:
    network = shipped()
    network.save(tmp_path / "copy.npz")
    interface = make_interface(network.interface, scenario_named("paper-sim-2"))
    shown = interface.shown(rows_of("paper-sim-2", 1, 3))
    np.testing.assert_array_equal(load_network(tmp_path / "copy.npz").scores(shown), network.scores(shown))
    assert [p.name for p in tmp_path.iterdir()] == ["copy.npz"]
    assert (tmp_path / "copy.npz").stat().st_size < 300_000
    assert {"command", "settings", "agent_steps", "versions"} <= network.origin.keys()


def test_tanh_stands_between_layers_only() -> None:
    layers = [Layer(np.full((1, 1), 2.0), np.array([0.5])), Layer(np.full((1, 1), 3.0), np.array([1.0]))]
    np.testing.assert_allclose(perceptron(layers, np.array([[0.25]])), [[3.0 * np.tanh(1.0) + 1.0]])


def test_sampled_actions_repeat_with_the_seed_and_differ_from_the_best() -> None:
    env = parallel_env("paper-sim-2")
    observations, _ = env.reset(seed=0)

    def drawn(seed: int, sample: bool = True) -> np.ndarray:
        policy = LearnedPolicy(env.scenario, sample=sample)
        policy.reset(seed)
        return np.stack([np.stack(list(policy.act(observations).values())) for _ in range(20)])

    np.testing.assert_array_equal(drawn(1), drawn(1))
    assert not np.array_equal(drawn(1), drawn(2))
    assert not np.ptp(drawn(1, sample=False), axis=0).any()


def test_a_network_of_another_layout_is_refused_by_block(tmp_path: Path) -> None:
    path = tmp_path / "flat.npz"
    flat_network("paper-sim-2").save(path)
    assert make_policy(f"ppo:path={path}", scenario_named("paper-hw-2")).act({"robot_0": np.ones(368)})
    with pytest.raises(ValueError, match=r"flat.npz was trained on 'paper-sim-2'.*'slot1/present': absent"):
        make_policy(f"ppo:path={path}", scenario_named("paper-sim-50"))
    with pytest.raises(ValueError, match="sample must be False for the interface 'flat'"):
        make_policy(f"ppo:path={path}:sample=True", scenario_named("paper-sim-2"))
    replace(shipped(), mean=np.zeros(3), variance=np.ones(3)).save(path)
    with pytest.raises(ValueError, match=r"shape of ray/0/weight must be \(64, 33\), got \(64, 60\)"):
        make_policy(f"ppo:path={path}", scenario_named("paper-sim-2"))


def played(policy: LearnedPolicy, scenario: Scenario, n_steps: int) -> np.ndarray:
    """Actions of some steps."""
    env = parallel_env(scenario)
    observations, _ = env.reset(seed=4)
    actions = []
    for _ in range(n_steps):
        chosen = policy.act(observations)
        actions.append(np.stack(list(chosen.values())))
        observations, *_ = env.step(chosen)
    return np.stack(actions)


@pytest.mark.parametrize("name", ["trail", "flat"])
def test_blocks_that_it_does_not_read_change_nothing(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """One in the middle, one in every slot, one last: the policy plays as before, to the bit."""
    scenario = scenario_named("paper-sim-2", size_m=6.0)
    network = shipped() if name == "trail" else flat_network("paper-sim-2")
    before = played(LearnedPolicy.of(network, scenario), scenario, 12)
    nothing = [
        Block(block, 2, -1.0, 1.0, "1", "noise", of=lambda b, _: b.err[:, None] * [0.01, -0.01] % 1.0)
        for block in ("own/new", "new")
    ]
    slot = Block("slot/new", 1, 0.0, 1.0, "1", "noise", of=lambda b, _: b.radio.slots * 0.3)
    rows = [*BLOCKS[:4], nothing[0], *BLOCKS[4:16], slot, *BLOCKS[16:], nothing[1]]
    monkeypatch.setattr(_observation, "BLOCKS", tuple(rows))
    np.testing.assert_array_equal(played(LearnedPolicy.of(network, scenario), scenario, 12), before)


def test_what_it_cannot_read_is_refused_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = scenario_named("paper-sim-2")
    policy = LearnedPolicy(scenario)
    with pytest.raises(ValueError, match=r"observations must be 368 numbers .*, got 367"):
        policy.act({"robot_0": np.ones(367)})
    lidar = next(k for k, block in enumerate(BLOCKS) if block.name == "lidar")
    finer = replace(BLOCKS[lidar], size=32)
    monkeypatch.setattr(_observation, "BLOCKS", (*BLOCKS[:lidar], finer, *BLOCKS[lidar + 1 :]))
    with pytest.raises(ValueError, match="the first is 'lidar': 16 in training, 32 in 'paper-sim-2'"):
        LearnedPolicy(scenario)
    monkeypatch.setattr(_observation, "BLOCKS", (*BLOCKS[:lidar], *BLOCKS[lidar + 1 :]))
    for network in (shipped(), flat_network("paper-sim-2")):
        trained = replace(network, layout=shipped().layout)
        with pytest.raises(ValueError, match=r"1 blocks .* 'lidar': 16 in training, absent in 'paper-sim-2'"):
            LearnedPolicy.of(trained, scenario)
    monkeypatch.undo()
    fewer = [(name, size) for name, size in shipped().layout if name != "own/spread"]
    with pytest.raises(ValueError, match="'own/spread': absent in training, 1 in 'paper-sim-2'"):
        LearnedPolicy.of(replace(shipped(), layout=fewer), scenario)


def test_time_that_is_left_is_counted_in_the_episode_that_is_played() -> None:
    """Steps home over steps left: after a tenth of 200 steps, 180 are left, not 45."""
    scenario = scenario_named("paper-sim-2")
    rows = rows_of("paper-sim-2", 3, 5)
    short, long = (Rays(scenario_named("paper-sim-2", n_steps=n)).shown(rows) for n in (50, 200))
    differs = np.flatnonzero((short != long).any(axis=0))
    assert len(differs) == 1
    home = np.abs(short[:, differs[0]]) > 0.0
    np.testing.assert_allclose(short[home, differs[0]] / long[home, differs[0]], 4.0, rtol=1e-5)
    np.testing.assert_array_equal(Rays(scenario).shown(rows), short)


@pytest.mark.parametrize("content", [None, b"", b"no archive", b"PK\x03\x04 a broken one"])
def test_what_is_no_policy_is_refused_by_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: bytes | None
) -> None:
    path = tmp_path / "policy.npz"
    if content is not None:
        path.write_bytes(content)
    code = main(["--policies", f"ppo:path={path}", "--out", str(tmp_path / "out")])
    said = " ".join(capsys.readouterr().err.split())
    assert code == 2
    assert str(path) in said
    assert not (tmp_path / "out").exists()
