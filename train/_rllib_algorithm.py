"""RLlib's PPO on the environment, and what it trained as a network that needs no torch."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from baselines.policies.learned.interfaces import layout_read, make_interface
from baselines.policies.learned.network import Layer, Network, plain
from train._interface_env import TranslatedEnv
from train._rllib_config import RllibConfig, settings_of
from train._versions import versions
from wifipgo.scenarios import Scenario

ROBOT = "robot"


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
        layout=layout_read(config.interface, scenario),
        scenario=plain(scenario),
        origin={"command": "python -m train.rllib", "settings": settings_of(config), "versions": versions()},
    )


def make_algorithm(config: RllibConfig, scenario: Scenario, *, seed: int) -> Any:
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
        .multi_agent(policies={ROBOT}, policy_mapping_fn=lambda *_, **__: ROBOT)
        .rl_module(model_config=model)
        .training(
            train_batch_size_per_learner=config.batch_size,
            minibatch_size=config.minibatch_size,
            num_epochs=config.n_epochs,
            lr=config.learning_rate,
            gamma=config.gamma,
        )
        .debugging(seed=seed)
        .build_algo()
    )
