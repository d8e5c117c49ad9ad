"""Teams of several sizes are trained together, each part as it would be alone."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from support.short_training import FEW, RARELY

from baselines.policies import make_policy
from baselines.policies.learned.network import load_network
from baselines.policies.learned.policy import SHIPPED
from baselines.policies.learned.training_scenarios import scenario_varied
from train._config import EnvsConfig, ImitationConfig, TrainConfig
from train._config_files import changed_fields, read_yaml, record_of
from train._dagger import _Scripts, teachers
from train._mixed_vec_env import MixedVecEnv
from train._rollouts import environments, rows_of, scenarios_of, teams_of
from train.training import train

OTHERS = ("paper-hw-2 n_robots=3 size_m=14", "paper-sim-2 obstacle_density=0.1")
MIXED = EnvsConfig(n_envs=3, others=OTHERS, overrides=("n_steps=10",))


def mixed(out: Path, **changes: object) -> TrainConfig:
    taught = ImitationConfig(policy="active", rounds=2, agent_steps=70, epochs=1)
    few = replace(FEW, agent_steps=140, batch_size=70)
    envs = replace(MIXED, **changes)  # type: ignore[arg-type]
    return TrainConfig(envs=envs, ppo=few, imitation=taught, selection=RARELY, out=out)


def test_a_mixture_is_trained_and_its_settings_stay(tmp_path: Path) -> None:
    config = mixed(tmp_path / "out")
    run = train(config)
    assert run.state.imitated == 140
    assert run.state.agent_steps == 140
    fifty = make_policy(f"ppo:path={config.out}", scenario_varied("paper-sim-50"))
    assert fifty.remark.startswith("was trained on 'paper-sim-2'")  # type: ignore[attr-defined]
    other = replace(config, envs=replace(MIXED, others=OTHERS[:1]), resume=True)
    with pytest.raises(ValueError, match=r"resume must be given with the settings of .*envs\.others"):
        train(other)


def test_scripts_of_all_teams_are_those_of_each(tmp_path: Path) -> None:
    config = mixed(tmp_path)
    norm = environments(config, config.seed)
    venv = norm.venv
    assert isinstance(venv, MixedVecEnv)
    assert rows_of(config) == venv.num_envs == 7
    norm.reset()
    scripts, parts = _Scripts(norm, config), teams_of(norm)
    for _ in range(3):
        found = scripts.answers()
        norm.step(found)
    expected = []
    for k, scenario in enumerate(scenarios_of(config)):
        alone = make_policy("active", scenario)
        alone.reset_rows([config.seed + k])
        expected.append(alone)
    assert [len(part.seen) for part in parts] == [2, 3, 2]
    assert scripts.by_row(np.array([True, False, True])).tolist() == [True] * 2 + [False] * 3 + [True] * 2
    norm.reset()
    anew = _Scripts(norm, config).answers()
    each = [
        part.interface.answers(alone.act_rows(part.seen[None]).reshape(-1, 3))
        for part, alone in zip(parts, expected, strict=True)
    ]
    np.testing.assert_array_equal(anew, np.concatenate(each))
    norm.close()


def test_answers_about_rows_come_in_their_order() -> None:
    config = TrainConfig(envs=MIXED)
    norm = environments(config, 0)
    rooms = [world.size_m for world in (scenario.arena for scenario in norm.get_attr("scenario", [6, 3, 0]))]
    assert rooms == [20.0, 14.0, 20.0]
    norm.close()


def test_teams_that_differ_need_the_interface_of_rays(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"envs\.others must be of scenarios with"):
        scenarios_of(mixed(tmp_path, interface="flat"))
    with pytest.raises(ValueError, match="did you mean 'n_robots'"):
        scenarios_of(mixed(tmp_path, others=("paper-sim-2 n_robot=3",)))


def test_the_settings_of_the_policy_that_ships_can_be_run() -> None:
    """Two stages, the second of which imitates the network of the first, and a rule with fifty robots."""
    first, last = (read_yaml(Path(f"train/configs/{name}.yaml")) for name in ("everywhere", "fifty"))
    assert first.ppo.agent_steps >= 10_000_000
    assert (last.imitation.policy, last.start) == ("start", "results/everywhere")
    last = replace(last, imitation=replace(last.imitation, policy="ppo"))
    for config in (first, last):
        assert rows_of(config) * config.ppo.n_steps % config.ppo.batch_size == 0
        assert len(teachers(config)) == len(scenarios_of(config))
    rules = [config.imitation.in_scenario("paper-sim-50") for config in (first, last)]
    assert rules == ["team_plan", "team_plan"]
    assert scenario_varied("paper-sim-2 n_robots=4").n_robots == 4


def test_the_policy_that_ships_was_trained_by_the_settings_that_its_commands_name() -> None:
    origin = load_network(Path("baselines/trained") / SHIPPED).origin
    for stage, name in ((origin["begun_with"], "everywhere"), (origin, "fifty")):
        file = Path(f"train/configs/{name}.yaml")
        assert stage["command"] == f"wifipgo train --config {file} --seed 0"
        assert changed_fields(stage["settings"], record_of(read_yaml(file))) == []
    assert origin["begun_with"]["agent_steps"] > 9_000_000


def test_who_is_imitated_is_chosen_by_scenario(tmp_path: Path) -> None:
    """What the lessons say in each part is what its own teacher would do there."""
    others = ("paper-sim-2 n_robots=3",)
    imitation = ImitationConfig(policy="random", instead=("voronoi in paper-sim-2 n_robots=3",))
    config = replace(mixed(tmp_path, others=others), imitation=imitation)
    norm = environments(config, 0)
    norm.reset()
    scripts = _Scripts(norm, config)
    said, (_, part) = scripts.answers(), teams_of(norm)
    voronoi = make_policy("voronoi", scenarios_of(config)[1])
    n_teams = part.num_envs // 3
    voronoi.reset_rows([config.seed + 2 * k + 1 for k in range(n_teams)], [0] * n_teams)
    actions = voronoi.act_rows(part.seen.reshape(n_teams, 3, -1))
    np.testing.assert_array_equal(said[-part.num_envs :], part.interface.answers(actions.reshape(-1, 3)))
    with pytest.raises(ValueError, match=r"unknown scenario of imitation\.instead 'paper-sim-50'; known:"):
        replace(config, imitation=replace(imitation, instead=("voronoi in paper-sim-50",)))
