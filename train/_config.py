"""What a training run consists of: one frozen value, checked when it is made."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Annotated

import tyro

from baselines.policies.learned.interfaces import DIRECTIONS, INTERFACES
from baselines.suite.definition import ROOTS
from envs.rendezvous_v0 import REWARDS
from wifipgo.errors import pick, require

# Root of the seeds of the tables in docs/training.md: never trained on, never chosen by.
HELD_OUT_SEED = 2026
_IN = " in "
# Who is imitated where a network is to stay as it is: the one that the training begins with.
START = "start"
# What a value is read from, and whether that is more than what the robot is shown.
CRITICS: Mapping[str, bool] = MappingProxyType({"own": False, "team": True})


@dataclass(frozen=True, slots=True, kw_only=True)
class EnvsConfig:
    """What is played.

    Attributes:
        scenario: Scenario that is evaluated, and trained on.
        others: More scenarios to train on, each a name and what is changed in it ("paper-sim-2 n_robots=4
            size_m=30"); environments take them in turn. Teams, rooms and lengths of episodes may differ where
            the interface is rays or trail.
        overrides: Other values for fields of all of them, KEY=VALUE.
        reward: Name of the reward.
        interface: How the network meets the environment: rays (directions to choose from), trail (the same
            with a memory of the robot's own way) or flat (the observation as it is, the action as a point).
        endless: Take the end by the clock for a cut in a task that goes on, and put the value of the last
            state there; else for the end, which is what the score does.
        n_envs: Worlds side by side, those of a scenario and a process stepped at once: 64 for each process
            is a good number.
        n_workers: Processes that share them; 0: this one. Where scenarios differ in teams, rooms or lengths,
            each has one of its own if this is not 0. Results do not depend on it.
        n_phases: Groups of worlds whose episodes end at other times, so that an update learns from all parts
            of an episode however short ppo.n_steps is; each is stepped by itself. Where scenarios differ in
            teams, rooms or lengths, groups are of whole scenarios, and cost nothing.
    """

    scenario: str = "paper-sim-2"
    others: tuple[str, ...] = ()
    overrides: tuple[str, ...] = ()
    reward: str = "mapped_share_truth"
    interface: str = "rays"
    endless: bool = False
    n_envs: int = 64
    n_workers: int = 0
    n_phases: int = 1

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything together."""
        require(self.n_envs >= 1, "envs.n_envs", ">= 1", self.n_envs)
        rule = f"in 0..{self.n_envs} (n_envs)"
        require(0 <= self.n_workers <= self.n_envs, "envs.n_workers", rule, self.n_workers)
        require(1 <= self.n_phases <= self.n_envs, "envs.n_phases", rule.replace("0..", "1.."), self.n_phases)
        rule = f"fewer than n_envs ({self.n_envs}): each scenario needs an environment"
        require(len(self.others) < self.n_envs, "envs.others", rule, self.others)
        pick(REWARDS, self.reward, "envs.reward")
        pick(INTERFACES, self.interface, "envs.interface")

    @property
    def texts(self) -> tuple[str, ...]:
        """Scenarios that environments take in turn, as the settings name them."""
        return (self.scenario, *self.others)


@dataclass(frozen=True, slots=True, kw_only=True)
class PpoConfig:
    """Proximal policy optimisation, in the words of stable-baselines3.

    Attributes:
        agent_steps: Steps of single agents in all; 0: only imitate.
        learning_rate: Of Adam, falling to a tenth of it in a straight line.
        n_steps: Iterations of each environment between updates.
        batch_size: Agent-steps of a gradient step.
        n_epochs: How often each agent-step is used.
        gamma: Discount of an iteration.
        gae_lambda: Of the generalised advantage estimate.
        clip_range: Of the ratio of probabilities.
        ent_coef: Weight of the entropy.
        vf_coef: Weight of the value's error.
        max_grad_norm: Gradients are cut to it.
        target_kl: Stop an update's epochs at this divergence; 0: never.
        critic_only: First updates in which the policy stays and only the value learns.
        hidden: Units of the hidden layers, of policy and value alike.
        average_age: Mean age of the weights that are judged and shipped, as a share of the training so far:
            an average over updates, later ones counting more; 0: the weights as they are.
        critic: What the value is read from: own (what the robot is shown) or team (MAPPO: also the truth
            about the team's errors and map, and what its robots are shown on average). Policies read their
            own only.
    """

    agent_steps: int = 500_000
    learning_rate: float = 3e-4
    n_steps: int = 50
    batch_size: int = 400
    n_epochs: int = 5
    gamma: float = 0.99
    gae_lambda: float = 0.95
    clip_range: float = 0.2
    ent_coef: float = 0.003
    vf_coef: float = 0.5
    max_grad_norm: float = 0.5
    target_kl: float = 0.02
    critic_only: int = 0
    hidden: tuple[int, ...] = (64, 64)
    critic: str = "own"
    average_age: float = 0.0

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        for name in ("n_steps", "batch_size", "n_epochs"):
            require(getattr(self, name) >= 1, f"ppo.{name}", ">= 1", getattr(self, name))
        for name in ("learning_rate", "clip_range", "max_grad_norm"):
            require(getattr(self, name) > 0.0, f"ppo.{name}", "> 0", getattr(self, name))
        for name in ("agent_steps", "ent_coef", "vf_coef", "target_kl", "critic_only"):
            require(getattr(self, name) >= 0, f"ppo.{name}", ">= 0", getattr(self, name))
        for name in ("gamma", "gae_lambda"):
            require(0.0 <= getattr(self, name) <= 1.0, f"ppo.{name}", "in [0, 1]", getattr(self, name))
        require(0.0 <= self.average_age <= 0.5, "ppo.average_age", "in [0, 0.5]", self.average_age)
        pick(CRITICS, self.critic, "ppo.critic")
        require(min(self.hidden, default=0) >= 1, "ppo.hidden", "one or more layers of >= 1", self.hidden)


@dataclass(frozen=True, slots=True, kw_only=True)
class NormConfig:
    """Running normalisation, saved with every checkpoint.

    Attributes:
        observations: By mean and variance of what is shown.
        reward: By the deviation of the discounted return.
        clip: Largest normalised number.
    """

    observations: bool = True
    reward: bool = True
    clip: float = 10.0

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        require(self.clip > 0.0, "norm.clip", "> 0", self.clip)


@dataclass(frozen=True, slots=True, kw_only=True)
class ImitationConfig:
    """Start from a scripted policy: it says what it would do, the network learns to say the same.

    In the first round the scripted policy drives, afterwards the network, with a chance of ``expert_share``
    that an environment is driven by the script for a step (DAgger). Values learn the returns.

    Attributes:
        policy: Who is imitated, e.g. active or ppo:path=RUN; start: the network that is begun with, by how
            likely each of its choices is, so that there it stays as it was; empty: start from nothing.
        instead: Who is imitated in single scenarios, each ``POLICY in SCENARIO`` as envs.others has it.
        rounds: Rounds of collecting and fitting.
        agent_steps: Collected in each round.
        epochs: Passes over all that was collected, after each round.
        batch_size: Agent-steps of a gradient step.
        learning_rate: Of Adam.
        expert_share: Chance that the script drives after the first round.
        stay_weight: Of the divergence from the network that is begun with, where start is imitated, beside
            the likelihood of what others would do elsewhere.
    """

    policy: str = ""
    instead: tuple[str, ...] = ()
    rounds: int = 4
    agent_steps: int = 16_000
    epochs: int = 6
    batch_size: int = 256
    learning_rate: float = 1e-3
    expert_share: float = 0.2
    stay_weight: float = 30.0

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        for name in ("rounds", "agent_steps", "epochs", "batch_size"):
            require(getattr(self, name) >= 1, f"imitation.{name}", ">= 1", getattr(self, name))
        require(self.learning_rate > 0.0, "imitation.learning_rate", "> 0", self.learning_rate)
        require(self.stay_weight > 0.0, "imitation.stay_weight", "> 0", self.stay_weight)
        require(0.0 <= self.expert_share <= 1.0, "imitation.expert_share", "in [0, 1]", self.expert_share)
        for text in self.instead:
            policy, _, scenario = text.partition(_IN)
            require(bool(policy and scenario), "imitation.instead", "POLICY in SCENARIO", text)
        require(
            bool(self.policy) or not self.instead,
            "imitation.instead",
            "empty without imitation.policy",
            self.instead,
        )

    def in_scenario(self, text: str) -> str:
        """Who is imitated in a scenario, by its text in the settings of the environments."""
        instead = {scenario: policy for policy, _, scenario in (each.partition(_IN) for each in self.instead)}
        return instead.get(text, self.policy)


@dataclass(frozen=True, slots=True, kw_only=True)
class SelectionConfig:
    """Which checkpoint is the best: mapped share on worlds that are neither trained on nor reported.

    Attributes:
        every: Agent-steps between evaluations; 0: only at the end.
        scenarios: What is played, as in envs.others; empty: envs.scenario. The score is the mean over all.
        trials: Worlds of each, the same each time and for the scripted policies.
        seed: Root of their seeds.
        policies: Scripted policies whose scores stand in the learning curve.
    """

    every: int = 20_000
    scenarios: tuple[str, ...] = ()
    trials: int = 20
    seed: int = 1
    policies: tuple[str, ...] = ("active", "random")

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything, and the worlds that results are reported on."""
        require(self.every >= 0, "selection.every", ">= 0", self.every)
        require(self.trials >= 1, "selection.trials", ">= 1", self.trials)
        rule = f">= 0 and not {HELD_OUT_SEED} or another root of held-out worlds"
        held_out = (HELD_OUT_SEED, *ROOTS)
        require(self.seed >= 0 and self.seed not in held_out, "selection.seed", rule, self.seed)


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainConfig:
    """Train a policy with shared parameters: PPO, after imitating a scripted policy if asked to.

    Results in OUT: checkpoints/best and last (model, normalisation, policy.npz for
    --policy ppo:path=FILE), curve.parquet, curve.png, config.yaml, versions.json, tensorboard/.

    Example: wifipgo train --config train/configs/paper-sim-2.yaml --out results/mine

    Example: wifipgo train --envs.scenario paper-hw-2 --ppo.agent-steps 200000 --out results/quick

    Attributes:
        seed: Root of all chance.
        out: Folder of the results.
        overwrite: Replace a run that is there.
        resume: Continue the run in OUT; settings that shape what is learned must stay.
        start: Folder of a run whose best checkpoint the network begins with, weights and normalisation.
        config: YAML file with these settings, or the name of one that ships (paper-sim-2, from-nothing); what
            else is on the command line wins.
    """

    envs: EnvsConfig = field(default_factory=EnvsConfig)
    ppo: PpoConfig = field(default_factory=PpoConfig)
    norm: NormConfig = field(default_factory=NormConfig)
    imitation: ImitationConfig = field(default_factory=ImitationConfig)
    selection: SelectionConfig = field(default_factory=SelectionConfig)
    seed: int = 0
    out: Path = Path("results/train")
    overwrite: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    resume: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    start: str = ""
    config: Path | None = None

    def __post_init__(self) -> None:
        """Reject what contradicts itself."""
        require(self.seed >= 0, "seed", ">= 0", self.seed)
        require(not (self.resume and self.overwrite), "resume", "given without overwrite", True)
        apart = self.envs.interface in DIRECTIONS or not CRITICS[self.ppo.critic]
        rule = f"own unless envs.interface is {' or '.join(DIRECTIONS)}: other policies would read the truth"
        require(apart, "ppo.critic", rule, self.ppo.critic)
        teaches, begun = bool(self.imitation.policy), bool(self.start)
        texts = dict.fromkeys(self.envs.texts)
        stays = START in map(self.imitation.in_scenario, texts)
        rule = f"other than {START} unless a network is begun with (start)"
        require(begun or not stays, "imitation.policy", rule, START)
        for text in self.imitation.instead:
            pick(texts, text.partition(_IN)[2], "scenario of imitation.instead")
        require(
            teaches or self.ppo.agent_steps > 0,
            "ppo.agent_steps",
            "> 0 where imitation.policy is empty: there is nothing to learn",
            self.ppo.agent_steps,
        )
        rule = "0 where imitation.policy is empty and nothing is begun with: there is no policy to spare"
        require(teaches or begun or self.ppo.critic_only == 0, "ppo.critic_only", rule, self.ppo.critic_only)
