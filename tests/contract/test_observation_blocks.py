"""The table of observation blocks: whoever adds a row adds a block, everywhere."""

import numpy as np
import pytest

from envs import _observation
from envs._observation import BLOCKS, Block
from envs.rendezvous_v0 import by_name, layout, parallel_env
from wifipgo.scenarios import scenario_named


def with_rows(monkeypatch: pytest.MonkeyPatch, *rows: tuple[int, Block]) -> None:
    """Put rows into the table, each before the row that is at its place now."""
    blocks = list(BLOCKS)
    for place, block in sorted(rows, key=lambda row: row[0], reverse=True):
        blocks.insert(place, block)
    monkeypatch.setattr(_observation, "BLOCKS", tuple(blocks))


def test_columns_follow_each_other_without_gap_or_overlap() -> None:
    for n_slots in (1, 3):
        scenario = scenario_named("paper-sim-50", n_slots=n_slots)
        columns = np.concatenate([np.arange(f.start, f.start + f.size) for f in layout(scenario)])
        np.testing.assert_array_equal(columns, np.arange(len(columns)))
        assert len({f.name for f in layout(scenario)}) == len(layout(scenario))


def test_another_row_is_another_block(monkeypatch: pytest.MonkeyPatch) -> None:
    """In the layout, the spaces and the numbers; what was there keeps its numbers."""
    scenario = scenario_named("paper-sim-50", n_robots=5, n_slots=2, n_steps=6)
    before, _ = parallel_env(scenario).reset(seed=3)
    was = layout(scenario)
    travelled = Block(
        *("own/travelled", 2, 0.0, 1.0, "m", "nowhere"), of=lambda b, _: np.full((len(b.err), 2), 0.25)
    )
    partner = Block(
        *("slot/number", 1, 0.0, 1.0, "n_robots", "whose"), of=lambda b, s: b.radio.slots / s.n_robots
    )
    with_rows(monkeypatch, (3, travelled), (len(BLOCKS) - 1, partner))
    env = parallel_env(scenario, observation="dict")
    after, _ = env.reset(seed=3)
    slots = env.tick.belief.radio.slots
    assert [f.name for f in env.layout][3] == "own/travelled"
    for k, (agent, blocks) in enumerate(after.items()):
        assert env.observation_space(agent).contains(blocks)
        np.testing.assert_array_equal(blocks["own/travelled"], [0.25, 0.25])
        for slot in (0, 1):
            there = slots[k, slot] >= 0
            expected = slots[k, slot] / 5 if there else 0.0
            np.testing.assert_allclose(blocks[f"slot{slot}/number"], expected, rtol=1e-6)
        for name, numbers in by_name(before[agent], was).items():
            np.testing.assert_array_equal(blocks[name], numbers, err_msg=name)
    assert parallel_env(scenario).observation_space("robot_0").shape == (len(before["robot_0"]) + 2 + 2,)
