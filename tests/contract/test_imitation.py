"""The scripts that a network imitates drive every environment as they would drive it alone."""

import numpy as np

from baselines.policies import make_policy
from train._config import EnvsConfig, ImitationConfig, TrainConfig
from train._dagger import _Scripts
from train._rollouts import environments, scenarios_of, teams_of


def test_scripts_are_those_of_each_environment_alone() -> None:
    """Two scenarios in turn, and environments that end at other times than their neighbours."""
    config = TrainConfig(
        envs=EnvsConfig(scenario="paper-hw-2", others=("paper-hw-2-obstacles",), n_envs=3, n_workers=0),
        imitation=ImitationConfig(policy="frontier_home"),
        seed=4,
    )
    norm = environments(config, config.seed)
    norm.reset()
    scripts, (translated,) = _Scripts(norm, config), teams_of(norm)
    scenarios = [scenarios_of(config)[k % 2] for k in range(3)]
    alone = [make_policy("frontier_home", scenario) for scenario in scenarios]
    episodes = [0, 0, 0]
    for k, policy in enumerate(alone):
        policy.reset(config.seed + k)
    ends = np.array([[0, 0, 0], [0, 1, 0], [0, 0, 0], [1, 1, 0], [0, 0, 0]], dtype=bool)
    for over in ends:
        answers = scripts.answers()
        teams = translated.seen.reshape(3, 2, -1)
        expected = [
            list(policy.act({"robot_0": team[0], "robot_1": team[1]}).values())
            for policy, team in zip(alone, teams, strict=True)
        ]
        np.testing.assert_array_equal(answers, translated.interface.answers(np.array(expected).reshape(6, 3)))
        norm.step(answers)
        scripts.ended(np.repeat(over, 2))
        for k in np.flatnonzero(over).tolist():
            episodes[k] += 1
            alone[k].reset(config.seed + k, episodes[k])
    norm.close()
