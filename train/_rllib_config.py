"""Settings of a training under RLlib, checked, and their record."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from baselines.evaluation.executors import cores
from baselines.policies.learned.interfaces import INTERFACES
from envs.rendezvous_v0 import REWARDS
from wifipgo.errors import pick, require

# What may change when a run is continued.
_FREE = {"out", "overwrite", "resume", "iterations", "n_runners", "ray_address", "checkpoint_every"}


@dataclass(frozen=True, slots=True, kw_only=True)
class RllibConfig:
    """Train a shared policy with RLlib.

    Results in OUT: policy.npz for --policies ppo:path=FILE, checkpoints/ of RLlib, settings.json.

    Attributes:
        scenario: Scenario to train on.
        interface: How the network meets the environment: rays or flat.
        reward: Name of the reward.
        iterations: Updates.
        checkpoint_every: Updates between checkpoints; there is one at the end, too.
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
        overwrite: Replace the run that is there.
        resume: Go on from the last checkpoint in OUT, e.g. with more iterations. It holds pickles, which can
            run anything: only in a folder of your own.
    """

    scenario: str = "paper-sim-2"
    interface: str = "rays"
    reward: str = "mapped_share_truth"
    iterations: int = 100
    checkpoint_every: int = 10
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
    resume: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything together."""
        for name in ("iterations", "checkpoint_every", "batch_size", "minibatch_size", "n_epochs"):
            require(getattr(self, name) >= 1, name, ">= 1", getattr(self, name))
        rule = f"<= batch_size ({self.batch_size})"
        require(self.minibatch_size <= self.batch_size, "minibatch_size", rule, self.minibatch_size)
        require(self.learning_rate > 0.0, "learning_rate", "> 0", self.learning_rate)
        require(0.0 <= self.gamma <= 1.0, "gamma", "in [0, 1]", self.gamma)
        require(min(self.hidden, default=0) >= 1, "hidden", "one or more layers of >= 1", self.hidden)
        require(self.n_runners >= 0, "n_runners", ">= 0", self.n_runners)
        require(not (self.overwrite and self.resume), "overwrite", "absent with --resume", self.overwrite)
        if not self.ray_address:
            check_runners(self.n_runners, cores())
        pick(INTERFACES, self.interface, "interface")
        pick(REWARDS, self.reward, "reward")


def check_runners(n_runners: int, n_cpus: int) -> None:
    """Refuse more runners than there are cores for: RLlib would wait for more, for ever."""
    require(n_runners <= n_cpus, "n_runners", f"<= {n_cpus}, the cores that there are", n_runners)


def settings_of(config: RllibConfig) -> dict[str, Any]:
    """Settings as JSON has them."""
    return asdict(config) | {"out": str(config.out), "hidden": list(config.hidden)}


def changed_settings(there: Mapping[str, Any], here: Mapping[str, Any]) -> list[str]:
    """Settings in which two records differ although they shape what is learned, with both values."""
    names = sorted((there.keys() | here.keys()) - _FREE)
    return [
        f"{name} ({there.get(name)!r} there, {here.get(name)!r} now)"
        for name in names
        if there.get(name) != here.get(name)
    ]
