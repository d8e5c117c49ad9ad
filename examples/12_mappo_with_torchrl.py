"""TorchRL: MAPPO on any mix of scenarios, from nothing or from others; ``ppo:path=FOLDER`` plays it.

Needs ``torchrl``. Run: python examples/12_mappo_with_torchrl.py
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
import tyro
from rich.progress import track
from tensordict import TensorDict

from baselines.policies.learned.training_scenarios import scenario_varied
from train.rays_networks import network_of
from train.torchrl_env import RendezvousTorchEnv
from train.torchrl_lessons import imitate
from train.torchrl_mappo import Mappo

SHARE = ("next", "robots", "info", "mapped_share_truth")


@dataclass(frozen=True, kw_only=True)
class MappoConfig:
    """Episodes of some worlds of each scenario (NAME KEY=VALUE ...), a few epochs of them, and again."""

    scenarios: tuple[str, ...] = ("paper-sim-2",)
    interface: str = "rays"
    start: Path | None = None  # the folder of a training that is gone on from
    imitate: tuple[str, ...] = ()  # policies to begin with, one for all or one for each scenario
    imitate_lr: float = 1e-3
    agent_steps: int = 200_000
    worlds: int = 16
    batch_size: int = 400
    epochs: int = 8
    lr: float = 7e-4
    gamma: float = 0.997
    entropy: float = 0.005
    critic_only: int = 0  # updates before the actor learns too
    seed: int = 0
    out: Path = Path("results/mappo")


def learn(
    mappo: Mappo, rows: TensorDict, optimiser: torch.optim.Optimizer, chosen: MappoConfig, *, acts: bool
) -> None:
    """PPO's epochs; they end where the policy has moved far enough."""
    for _ in range(chosen.epochs):
        for some in torch.split(torch.randperm(len(rows)), chosen.batch_size):
            losses = mappo.loss(rows[some])
            if losses["mean_ratio"] - 1.0 + losses["kl_approx"] > 0.045:  # of little variance: Schulman 2020
                return
            optimiser.zero_grad()
            of_actor = losses["loss_objective"] + losses["loss_entropy"] if acts else 0.0
            (losses["loss_critic"] + of_actor).backward()
            torch.nn.utils.clip_grad_norm_(mappo.loss.parameters(), 0.5)
            optimiser.step()


def train(mappo: Mappo, envs: Sequence[RendezvousTorchEnv], chosen: MappoConfig) -> Iterator[str]:
    """Collect and learn; says before it, and after each update what was mapped, by scenario."""
    yield "0 agent-steps"
    played = [(env, env.worlds.scenario.n_steps) for env in envs]
    n_rows = chosen.worlds * sum(n * env.worlds.n_robots for env, n in played)
    n_updates = math.ceil(chosen.agent_steps / n_rows)
    optimiser = torch.optim.Adam(mappo.loss.parameters(), lr=chosen.lr, eps=1e-5)
    slower = torch.optim.lr_scheduler.LinearLR(optimiser, 1.0, 0.1, n_updates)
    for update in track(range(1, n_updates + 1), f"{n_updates} updates"):
        with torch.no_grad():
            episodes = [env.rollout(n, mappo.policy, break_when_any_done=False) for env, n in played]
        learn(mappo, mappo.rows(episodes), optimiser, chosen, acts=update > chosen.critic_only)
        slower.step()
        shares = [f"{episode[SHARE][:, -1].mean():.3f}" for episode in episodes]
        yield f"{update * n_rows} agent-steps: {' '.join(shares)}"


def main(chosen: MappoConfig) -> None:
    """Train, and write the network down after each update."""
    torch.manual_seed(chosen.seed)
    torch.set_num_threads(1)  # small networks
    chosen.out.mkdir(parents=True, exist_ok=True)
    played = [scenario_varied(text) for text in chosen.scenarios]
    first = 2**32 * (1 + chosen.seed)  # no world of an evaluation has so large a seed
    own: dict[str, Any] = {"num_envs": chosen.worlds, "interface": chosen.interface, "actions": "discrete"}
    own["terminate_at_end"] = True  # the score is taken then: nothing counts after it
    envs = [RendezvousTorchEnv(each, seed=first + 1000 * k, **own) for k, each in enumerate(played)]
    mappo = Mappo(chosen.interface, gamma=chosen.gamma, entropy_coeff=chosen.entropy)
    origin: dict[str, Any] = {"command": "examples/12_mappo_with_torchrl.py", "seed": chosen.seed}
    origin["settings"] = {"envs": {"others": chosen.scenarios[1:]}}
    if chosen.start:
        mappo.load(chosen.start / "mappo.npz")
    if chosen.imitate:
        print(f"{imitate(mappo, envs, chosen.imitate, lr=chosen.imitate_lr)} agent-steps of lessons")
    for said in train(mappo, envs, chosen):
        network_of(mappo.actor, played[0], origin).save(chosen.out / "policy.npz")
        mappo.save(chosen.out / "mappo.npz")
        print(said)
    print(f"wifipgo suite --policies team_plan,mappo=ppo:path={chosen.out}")


if __name__ == "__main__":
    main(tyro.cli(MappoConfig))
