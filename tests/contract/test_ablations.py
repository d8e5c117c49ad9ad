"""A trained policy without something: nothing else changes, and what is taken away has no effect at all."""

import numpy as np
import pytest

from baselines.policies import make_policy
from baselines.policies.learned.ablations import ABLATIONS, Without
from envs.rendezvous_v0 import layout
from wifipgo.errors import UnknownNameError
from wifipgo.scenarios import scenario_named

FOUR = scenario_named("paper-sim-2", n_robots=4)
N_WORLDS = 12


def observed() -> np.ndarray:
    """Observations of teams that hear and see each other, as far as their bounds allow."""
    rng, fields = np.random.default_rng(3), layout(FOUR)
    low, high = (
        np.repeat([getattr(f, end) for f in fields], [f.size for f in fields]) for end in ("low", "high")
    )
    return rng.uniform(low, np.minimum(high, 1.0), (N_WORLDS, FOUR.n_robots, len(low))).astype(np.float32)


def acted(spec: str, rows: np.ndarray) -> np.ndarray:
    policy = make_policy(spec, FOUR)
    policy.reset_rows(range(N_WORLDS))
    return policy.act_rows(rows)


@pytest.mark.parametrize(
    ("name", "blocks"),
    [
        ("profile", {f"slot{k}/profile" for k in range(FOUR.n_slots)}),
        ("camera", {"own/sighted", "own/sighted_bearing"}),
        ("calls", set()),
        ("memory", set()),
        ("", set()),
    ],
)
def test_only_what_is_named_is_hidden(name: str, blocks: set[str]) -> None:
    rows = observed()[0]
    shown = Without(name, FOUR).shown(rows)
    changed = {field.name for field in layout(FOUR) if (shown[:, field.where] != rows[:, field.where]).any()}
    assert changed == blocks
    assert all((shown[:, field.where] == 0.0).all() for field in layout(FOUR) if field.name in blocks)


@pytest.mark.parametrize("name", ["profile", "camera"])
def test_what_is_hidden_has_no_effect(name: str) -> None:
    """Other signals or sights change what the whole policy does, and nothing of what it does without."""
    rows, other = observed(), observed()
    hidden = np.zeros(rows.shape[2], dtype=bool)
    for field in layout(FOUR):
        hidden[field.where] = field.name.startswith("own/sighted" if name == "camera" else "slot")
        hidden[field.where] &= name == "camera" or field.name.endswith("/profile")
    other[..., hidden] = np.roll(rows[..., hidden], 1, axis=0)
    assert (acted("ppo", rows) != acted("ppo", other)).any()
    np.testing.assert_array_equal(acted(f"ppo:without={name}", rows), acted(f"ppo:without={name}", other))


def test_without_calls_it_drives_the_same_and_never_calls() -> None:
    rows = observed()
    whole, silent = acted("ppo", rows), acted("ppo:without=calls", rows)
    np.testing.assert_array_equal(silent[..., :2], whole[..., :2])
    assert (whole[..., 2] > 0.0).any()
    assert (silent[..., 2] == -1.0).all()


def test_without_memory_the_past_has_no_effect() -> None:
    """Two pasts, one present: the whole policy may do one thing or another, the one without does the same."""
    where = {field.name: field.where for field in layout(FOUR)}
    now, here, elsewhere = observed(), observed(), observed()
    now[..., where["own/elapsed"]], now[..., where["own/recorded_spread"]] = 0.4, 3.0
    for past in (here, elsewhere):
        past[..., where["own/elapsed"]], past[..., where["own/recorded_spread"]] = 0.2, 0.0
    elsewhere[..., where["own/position"]] += 0.5
    pasts, done = (here, elsewhere), {}
    for spec in ("ppo", "ppo:without=memory"):
        for k, past in enumerate(pasts):
            policy = make_policy(spec, FOUR)
            policy.reset_rows(range(N_WORLDS))
            for rows in (past, now):
                actions = policy.act_rows(rows)
            done[spec, k] = actions
    assert (done["ppo", 0] != done["ppo", 1]).any()
    np.testing.assert_array_equal(done["ppo:without=memory", 0], done["ppo:without=memory", 1])


def test_several_are_taken_away_at_once() -> None:
    rows = observed()
    every = "+".join(ABLATIONS)
    hidden = Without(every, FOUR).shown(rows[0]) == 0.0
    each = [Without(name, FOUR).shown(rows[0]) == 0.0 for name in ABLATIONS]
    np.testing.assert_array_equal(hidden, np.any(each, axis=0))
    assert (acted(f"ppo:without={every}", rows)[..., 2] == -1.0).all()


@pytest.mark.parametrize("name", ["lidar", "profile,camera", "profile+", "Profile"])
def test_what_does_not_exist_is_refused_by_name(name: str) -> None:
    with pytest.raises(
        UnknownNameError, match=r"ablation in without: .*known: calls, camera, memory, profile"
    ):
        make_policy("ppo", FOUR, without=name)
