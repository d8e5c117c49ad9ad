"""The same environment under RLlib: ``python -m train.rllib --out results/rllib``. Needs the extra ``rllib``.

Its own PPO with one plain perceptron for all robots. What it trains is exported to the same file as that of
`train.ppo`, so ``--policy ppo:path=FILE`` runs it without ray or torch.
"""

import shutil
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from rich.console import Console

from baselines.evaluation.command import exit_code
from baselines.evaluation.executors import cores
from baselines.evaluation.ray_cluster import joined, load_ray
from baselines.policies.learned.interfaces import INTERFACES, make_interface
from baselines.policies.learned.network import Layer, Network, layout_of, plain
from envs.rendezvous_v0 import REWARDS
from train._interface_env import TranslatedEnv
from train._versions import versions
from wifipgo.atomic_files import write_json
from wifipgo.errors import pick, require
from wifipgo.scenarios import Scenario, scenario_named
from wifipgo.terminal import say

_ROBOT = "robot"


@dataclass(frozen=True, slots=True, kw_only=True)
class RllibConfig:
    """Train a shared policy with RLlib.

    Results in OUT: policy.npz for --policies ppo:path=FILE, checkpoint/ for RLlib, settings.json.

    Attributes:
        scenario: Scenario to train on.
        interface: How the network meets the environment: rays or flat.
        reward: Name of the reward.
        iterations: Updates.
        batch_size: Iterations of the team that are collected for an update.
        minibatch_size: Of a gradient step.
        n_epochs: How often each is used.
        learning_rate: Of Adam.
        gamma: Discount of an iteration.
        hidden: Units of the hidden layers.
        n_runners: Processes that collect; 0: this one.
        ray_address: Cluster to join, e.g. auto; without one, ray starts here.
        seed: Root of all chance; RLlib's runs repeat with no runners only.
        out: Folder of the results.
        overwrite: Replace results that are there.
    """

    scenario: str = "paper-sim-2"
    interface: str = "rays"
    reward: str = "mapped_share_truth"
    iterations: int = 100
    batch_size: int = 1_600
    minibatch_size: int = 200
    n_epochs: int = 8
    learning_rate: float = 3e-4
    gamma: float = 0.99
    hidden: tuple[int, ...] = (64, 64)
    n_runners: int = 0
    ray_address: str = ""
    seed: int = 0
    out: Path = Path("results/rllib")
    overwrite: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything together."""
        for name in ("iterations", "batch_size", "minibatch_size", "n_epochs"):
            require(getattr(self, name) >= 1, name, ">= 1", getattr(self, name))
        rule = f"<= batch_size ({self.batch_size})"
        require(self.minibatch_size <= self.batch_size, "minibatch_size", rule, self.minibatch_size)
        require(self.learning_rate > 0.0, "learning_rate", "> 0", self.learning_rate)
        require(0.0 <= self.gamma <= 1.0, "gamma", "in [0, 1]", self.gamma)
        require(min(self.hidden, default=0) >= 1, "hidden", "one or more layers of >= 1", self.hidden)
        require(self.n_runners >= 0, "n_runners", ">= 0", self.n_runners)
        if not self.ray_address:
            _check_runners(self.n_runners, cores())
        pick(INTERFACES, self.interface, "interface")
        pick(REWARDS, self.reward, "reward")


def train(config: RllibConfig, *, console: Console | None = None) -> Network:
    """Train, and leave policy, checkpoint and settings in ``config.out``.

    Raises:
        ValueError: A setting that is refused; nothing was written.
        OSError: A folder that cannot be written.
        MissingExtraError: The extra ``rllib`` is not installed.
    """
    console = console or Console(quiet=True)
    scenario = scenario_named(config.scenario)
    make_interface(config.interface, scenario)
    ray = load_ray(config.ray_address, what="train.rllib", extra="rllib", modules=("torch", "ray.rllib"))
    with joined(ray, config.ray_address, n_cpus=cores()):
        _check_runners(config.n_runners, int(ray.cluster_resources().get("CPU", 0)))
        _claim(config)
        algorithm = _algorithm(config, scenario)
        for k in range(config.iterations):
            runners = algorithm.train()["env_runners"]
            returned = runners.get("agent_episode_returns_mean", {})
            mean = np.mean([float(value) for value in returned.values()]) if returned else np.nan
            say(console, f"update {k + 1:>4}: mean return of a robot {mean:.3f}")
        network = exported(algorithm.get_module(_ROBOT).get_state(), config, scenario)
        network.save(config.out / "policy.npz")
        algorithm.save_to_path(str((config.out / "checkpoint").resolve()))
        algorithm.stop()
    say(
        console,
        f"run it: python -m baselines.evaluate --policies active,ppo:path={config.out / 'policy.npz'}",
    )
    return network


def exported(state: Mapping[str, Any], config: RllibConfig, scenario: Scenario) -> Network:
    """The actor of an RLlib module as a network that needs no torch."""
    arrays = {name: np.asarray(value) for name, value in state.items()}
    stems = [f"encoder.actor_encoder.net.mlp.{2 * k}" for k in range(len(config.hidden))]
    layers = [Layer(arrays[f"{stem}.weight"], arrays[f"{stem}.bias"]) for stem in (*stems, "pi.net.mlp.0")]
    interface = make_interface(config.interface, scenario)
    # A Gaussian's head gives means, then deviations.
    n_out = sum(interface.n_choices) or len(layers[-1].bias) // 2
    layers[-1] = Layer(layers[-1].weight[:n_out], layers[-1].bias[:n_out])
    return Network(
        interface=config.interface,
        nets={"action": layers},
        mean=np.zeros(interface.n_shown, np.float32),
        variance=np.ones(interface.n_shown, np.float32),
        clip=1e9,
        layout=layout_of(scenario),
        scenario=plain(scenario),
        origin={"command": "python -m train.rllib", "settings": _settings(config), "versions": versions()},
    )


def _check_runners(n_runners: int, n_cpus: int) -> None:
    """Refuse more runners than there are cores for: RLlib would wait for more, for ever."""
    require(n_runners <= n_cpus, "n_runners", f"<= {n_cpus}, the cores that there are", n_runners)


def _algorithm(config: RllibConfig, scenario: Scenario) -> Any:
    """RLlib's PPO, one module for all robots."""
    from ray.rllib.algorithms.ppo import PPOConfig  # noqa: PLC0415
    from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig  # noqa: PLC0415
    from ray.rllib.env.wrappers.pettingzoo_env import ParallelPettingZooEnv  # noqa: PLC0415
    from ray.tune.registry import register_env  # noqa: PLC0415

    register_env("rendezvous", lambda options: ParallelPettingZooEnv(TranslatedEnv(**options)))
    options = {"scenario": scenario, "interface": config.interface, "reward": config.reward}
    model = DefaultModelConfig(
        fcnet_hiddens=list(config.hidden), fcnet_activation="tanh", vf_share_layers=False
    )
    return (
        PPOConfig()
        .environment("rendezvous", env_config=options)
        .env_runners(num_env_runners=config.n_runners)
        .multi_agent(policies={_ROBOT}, policy_mapping_fn=lambda *_, **__: _ROBOT)
        .rl_module(model_config=model)
        .training(
            train_batch_size_per_learner=config.batch_size,
            minibatch_size=config.minibatch_size,
            num_epochs=config.n_epochs,
            lr=config.learning_rate,
            gamma=config.gamma,
        )
        .debugging(seed=config.seed)
        .build_algo()
    )


def _claim(config: RllibConfig) -> None:
    """Make the folder and write the settings down; refuse to replace what is not ours."""
    out = config.out
    if out.exists() and any(out.iterdir()):
        rule = "new or empty (--overwrite replaces results of this command)"
        require(config.overwrite and (out / "settings.json").is_file(), "out", rule, str(out))
        shutil.rmtree(out)
    out.mkdir(parents=True, exist_ok=True)
    write_json(out / "settings.json", _settings(config))


def _settings(config: RllibConfig) -> dict[str, Any]:
    return asdict(config) | {"out": str(config.out), "hidden": list(config.hidden)}


def main(args: Sequence[str] | None = None) -> int:
    """Run from the command line; 0 done, 2 refused, 130 interrupted."""
    kept = "interrupted; nothing is kept of an unfinished run"

    def job(console: Console) -> None:
        train(tyro.cli(RllibConfig, prog="python -m train.rllib", args=args), console=console)

    return exit_code(job, interrupted=kept)


if __name__ == "__main__":
    sys.exit(main())
