"""MAPPO in TorchRL's own parts, for choices among directions: policy, advantages, loss. Needs ``torchrl``.

A robot is a row of a batch, whatever team it was in: teams of several sizes are learned from side by side.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import torch
from tensordict import TensorDict, TensorDictBase
from tensordict.nn import InteractionType, TensorDictModule, TensorDictSequential
from torch import nn
from torchrl.modules import ProbabilisticActor
from torchrl.objectives import ClipPPOLoss
from torchrl.objectives.value import GAE

from train._module_files import load_modules, save_modules
from train._tensors import tensor_of
from train._truths import N_TRUTH, TRUTHS, truth_of
from train.rays_networks import RaysActor, RunningNorm, TeamCritic
from train.torchrl_env import GROUP

__all__ = ["CHOICE", "RETURN", "RIGHT", "SHOWN", "TEAM", "Mappo"]

# Entries of rows and rollouts; `RIGHT` is what a script would choose, `RETURN` what came of it all.
SHOWN, CHOICE, TEAM = (GROUP, "observation"), (GROUP, "action"), (GROUP, "team")
RIGHT, RETURN = (GROUP, "right"), (GROUP, "return")
_TRUTH, _LOGITS, _LOG_PROB = (GROUP, "truth"), (GROUP, "logits"), (GROUP, "action_log_prob")
_VALUE, _REWARD, _DONE = (GROUP, "state_value"), (GROUP, "reward"), (GROUP, "done")
_ADVANTAGE, _TARGET = (GROUP, "advantage"), (GROUP, "value_target")
_LEARNED_FROM = (SHOWN, CHOICE, _LOG_PROB, TEAM, _ADVANTAGE, _TARGET, RETURN, RIGHT)


class Mappo:
    """One actor that all robots share, and a critic that sees the team and what is true (Yu et al. 2022).

    Args:
        interface: By which robots are shown what they see: "rays" or "trail".
        gamma: Discount of an iteration.
        lmbda: Of the generalised advantage estimate.
        clip_epsilon: Of the ratio of probabilities.
        entropy_coeff: Weight of the entropy.
        hidden: Units of the hidden layers, of actor and critic alike.

    Attributes:
        actor: What `train.rays_networks.network_of` exports.
        critic: Value of what a row shows and `TEAM`.
        policy: Draws choices, for ``env.rollout``.
        loss: TorchRL's `ClipPPOLoss` of rows; its parameters are those to optimise.
    """

    def __init__(
        self,
        interface: str = "rays",
        *,
        gamma: float = 0.997,
        lmbda: float = 0.95,
        clip_epsilon: float = 0.2,
        entropy_coeff: float = 0.005,
        hidden: Sequence[int] = (64, 64),
    ) -> None:
        """Make the networks."""
        self.actor = RaysActor(interface, hidden=hidden)
        self.critic = TeamCritic(interface, self.actor.norm, hidden, n_truth=N_TRUTH)
        self.policy = _policy_of(self.actor)
        self._team = TensorDictModule(self.critic.team, in_keys=[SHOWN, _TRUTH], out_keys=[TEAM])
        value = TensorDictModule(self.critic, in_keys=[SHOWN, TEAM], out_keys=[_VALUE])
        self._gamma, self._returns = gamma, RunningNorm(1)
        self._gae = GAE(gamma=gamma, lmbda=lmbda, value_network=TensorDictSequential(self._team, value))
        self.loss = ClipPPOLoss(
            self.policy,
            value,
            clip_epsilon=clip_epsilon,
            entropy_coeff=entropy_coeff,
            critic_coeff=0.5,
            loss_critic_type="l2",
            normalize_advantage=True,
        )
        keys = {"value": _VALUE, "advantage": _ADVANTAGE, "value_target": _TARGET}
        self._gae.set_keys(**keys, reward=_REWARD, done=_DONE, terminated=(GROUP, "terminated"))
        self.loss.set_keys(**keys, action=CHOICE, sample_log_prob=_LOG_PROB)

    def save(self, path: Path) -> None:
        """Write what a later training goes on from: networks and normalisation, as plain numbers."""
        save_modules(path, self._modules())

    def load(self, path: Path) -> None:
        """Go on from what `save` wrote of networks of the same interface and size.

        Raises:
            BadInputError: It is no such file, or of other networks; names what differs.
            OSError: It cannot be read.
        """
        load_modules(path, self._modules())

    def _modules(self) -> Mapping[str, nn.Module]:
        return {"actor": self.actor, "critic": self.critic, "returns": self._returns}

    @torch.no_grad()
    def rows(self, rollouts: Sequence[TensorDictBase]) -> TensorDict:
        """What the loss needs of rollouts, with advantages: a row a robot, world and step.

        The normalisation takes them into account first, and probabilities are told anew by it: an update is
        held against the policy that it begins with. Rewards become shares of the deviation of all returns so
        far, so that values are as large as what a network begins with.

        Args:
            rollouts: Of (worlds, steps), one for each environment; rewards and ends of robots are changed.
        """
        for rollout in rollouts:
            told = rollout["next"]
            for flag in ("done", "terminated"):  # the end of a world is one of each of its robots
                told[GROUP, flag] = told[flag].unsqueeze(-1).expand_as(told[_REWARD])
            self.actor.norm.update(rollout[SHOWN])
            rollout[RETURN] = _returns(told[_REWARD], told[_DONE], self._gamma)
            self._returns.update(rollout[RETURN])
        return torch.cat([self._with_advantages(rollout) for rollout in rollouts])

    def _with_advantages(self, rollout: TensorDictBase) -> TensorDict:
        """Rows of one rollout."""
        rollout[_LOG_PROB] = self.policy.get_dist(rollout).log_prob(rollout[CHOICE])
        deviation = (self._returns.variance + 1e-8).sqrt()
        rollout[RETURN], rollout["next", _REWARD] = (
            worth / deviation for worth in (rollout[RETURN], rollout["next", _REWARD])
        )
        for told in (rollout, rollout["next"]):
            info = told[GROUP, "info"]
            told[_TRUTH] = tensor_of(truth_of({name: info[name].numpy() for name in TRUTHS}))
        robots = self._gae(self._team(rollout)).select(*_LEARNED_FROM, strict=False)[GROUP].flatten(0, 2)
        return TensorDict({GROUP: robots}, batch_size=robots.batch_size)


def _returns(reward: torch.Tensor, done: torch.Tensor, gamma: float) -> torch.Tensor:
    """Discounted sums of what follows, (worlds, steps, robots, 1), up to the end of the rollout."""
    out, after = torch.empty_like(reward), torch.zeros_like(reward[:, 0])
    for t in reversed(range(reward.shape[1])):
        after = out[:, t] = reward[:, t] + gamma * after * ~done[:, t]
    return out


def _policy_of(actor: RaysActor) -> ProbabilisticActor:
    """Draws one of the choices, and tells its log probability."""
    return ProbabilisticActor(
        TensorDictModule(actor, in_keys=[SHOWN], out_keys=[_LOGITS]),
        in_keys={"logits": _LOGITS},
        out_keys=[CHOICE],
        distribution_class=torch.distributions.Categorical,
        distribution_kwargs={"validate_args": False},  # logits of our own: a tenth of the time
        default_interaction_type=InteractionType.RANDOM,
        return_log_prob=True,
        log_prob_key=_LOG_PROB,
    )
