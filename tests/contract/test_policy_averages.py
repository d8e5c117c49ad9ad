"""Averages of a policy over its training: what is judged and saved, while what learns is left as it is."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from support.short_training import FEW, small

pytest.importorskip("stable_baselines3")

from gymnasium import spaces
from stable_baselines3.common.policies import ActorCriticPolicy

from baselines.policies.learned.network import load_network
from train._averages import AVERAGE, PolicyAverage
from train._checkpoints import read_training
from train._config import ImitationConfig, PpoConfig
from train.training import Run, digest, train
from wifipgo.errors import BadInputError

AVERAGED = replace(FEW, agent_steps=240, learning_rate=3e-2, average_age=0.3)


def policy() -> ActorCriticPolicy:
    box = spaces.Box(-1.0, 1.0, (3,))
    return ActorCriticPolicy(box, spaces.Discrete(2), lambda _: 1e-3, net_arch=[4])


def filled(of: ActorCriticPolicy, value: float) -> None:
    with torch.no_grad():
        for parameter in of.parameters():
            parameter.fill_(value)


@pytest.mark.parametrize("age", [0.5, 0.3, 0.1])
def test_weights_are_as_old_on_average_as_asked(age: float) -> None:
    """Weights that say the number of their update: the average is older by the share, at any length."""
    learning = policy()
    average = PolicyAverage(learning, age)
    assert average.policy is learning  # nothing is averaged yet
    for update in range(1, 2_001):
        filled(learning, float(update))
        average.update()
        if update in {500, 2_000}:
            values = torch.cat([p.flatten() for p in average.policy.parameters()])
            torch.testing.assert_close(values, torch.full_like(values, (1 - age) * update), rtol=0.01, atol=0)


def test_an_average_goes_on_where_another_was() -> None:
    learning = policy()
    first, later = PolicyAverage(learning, 0.2), PolicyAverage(learning, 0.2)
    for update in (1.0, 5.0, 2.0):
        filled(learning, update)
        first.update()
    later.restore(first.arrays(), where="run")
    filled(learning, 9.0)
    for each in (first, later):
        each.update()
    arrays = first.arrays()
    assert arrays.keys() == later.arrays().keys()
    assert all((array == later.arrays()[name]).all() for name, array in arrays.items())
    arrays[f"{AVERAGE}updates"] = np.array(-1)
    with pytest.raises(BadInputError, match="run: average/updates must be >= 0, got -1"):
        later.restore(arrays, where="run")
    del arrays[f"{AVERAGE}value_net.bias"]
    with pytest.raises(BadInputError, match=r"run must be with the array 'average/value_net\.bias'"):
        later.restore(arrays, where="run")


def actor_of(arrays: dict[str, np.ndarray], prefix: str) -> list[Any]:
    return [arrays[f"{prefix}mlp_extractor.ray.{k}.weight"] for k in (0, 2)]


def test_the_average_is_judged_and_the_policy_learns_as_without(tmp_path: Path) -> None:
    lessons = ImitationConfig(policy="active", rounds=1, agent_steps=40, epochs=1)
    run = train(small(tmp_path / "run", ppo=AVERAGED, imitation=lessons))
    plain = train(small(tmp_path / "plain", ppo=replace(AVERAGED, average_age=0.0), imitation=lessons))
    assert digest(run.model) == digest(plain.model)
    folder = run.checkpoints.path()
    arrays, network = read_training(folder), load_network(folder / "policy.npz")
    for saved, average, now in zip(
        network.nets["ray"], actor_of(arrays, AVERAGE), actor_of(arrays, "policy/"), strict=True
    ):
        np.testing.assert_array_equal(saved.weight, average)
        assert np.abs(average - now).max() > 1e-3
    assert arrays[f"{AVERAGE}updates"] == 240 // 80
    goes_on(tmp_path, run, arrays)


def goes_on(tmp_path: Path, run: Run, arrays: dict[str, np.ndarray]) -> None:
    """Continued, it learns on from the policy; another that starts with it starts with the average."""
    again = Run(replace(run.config, resume=True), run._console)
    resumed = {**again.average.arrays(), "now": again.model.policy.state_dict()["value_net.weight"].numpy()}
    again.norm.close()
    assert all((resumed[name] == array).all() for name, array in arrays.items() if name.startswith(AVERAGE))
    assert (resumed["now"] == arrays["policy/value_net.weight"]).all()
    later = Run(small(tmp_path / "later", start=str(run.config.out)), run._console)
    later.norm.close()
    begun = later.model.policy.state_dict()["value_net.weight"].numpy()
    best = read_training(run.checkpoints.path("best"))
    name = f"{AVERAGE}value_net.weight" if f"{AVERAGE}value_net.weight" in best else "policy/value_net.weight"
    np.testing.assert_array_equal(begun, best[name])


def test_ages_that_no_average_can_have_are_refused() -> None:
    with pytest.raises(ValueError, match=r"ppo\.average_age must be in \[0, 0\.5\], got 0\.6"):
        PpoConfig(average_age=0.6)
