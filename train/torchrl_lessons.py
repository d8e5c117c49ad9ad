"""A start from other policies for learners in TorchRL: they say what they would do, the actor learns it.

As `train._dagger` (Ross, Gordon and Bagnell 2011): from the second round on the network drives, so that it
learns what to do where *it* gets. Needs ``torchrl``.
"""

from collections.abc import Sequence

import torch
from tensordict import TensorDict, TensorDictBase
from torch.nn.functional import cross_entropy, mse_loss

from baselines.policies import make_policy
from baselines.policies.learned.interfaces import make_interface
from envs.directions import N_MOTIONS
from envs.rendezvous_v0 import layout
from train._tensors import tensor_of
from train.torchrl_env import RendezvousTorchEnv
from train.torchrl_mappo import CHOICE, RETURN, RIGHT, SHOWN, TEAM, Mappo
from wifipgo.errors import require

__all__ = ["Lesson", "imitate"]

_VALUE_WEIGHT = 0.25
_SHARE = 0.2  # chance that the script drives a world for a step after the first round


class Lesson:
    """Policy of a rollout: script or network drives, and what the script would choose is noted as `RIGHT`.

    Args:
        script: A policy, as `baselines.policies.make_policy` takes it.
        env: Whose worlds are driven; its interface chooses among directions.
        mappo: Whose policy drives where the script does not.
        share: Chance that the script drives a world for a step.
    """

    def __init__(self, script: str, env: RendezvousTorchEnv, mappo: Mappo, *, share: float = 1.0) -> None:
        """Make the script; it begins anew with each world."""
        self._env, self._mappo, self.share = env, mappo, share
        self._interface = make_interface(mappo.actor.interface, env.worlds.scenario)
        self._script = make_policy(script, env.worlds.scenario)
        where = {field.name: field.where for field in layout(env.worlds.scenario)}
        self._elapsed = where["own/elapsed"]
        self._episodes = [-1] * env.worlds.n_worlds

    def __call__(self, td: TensorDictBase) -> TensorDictBase:
        """Choose for the robots of all worlds."""
        right = self._right()
        chosen = self._mappo.policy(td)
        by_script = torch.rand(len(right), 1) < self.share
        chosen[RIGHT] = right
        chosen[CHOICE] = torch.where(by_script, right, chosen[CHOICE])
        return chosen

    def _right(self) -> torch.Tensor:
        """What the script would choose now, (worlds, robots)."""
        seen = self._env.seen
        begins = (seen[:, 0, self._elapsed] == 0.0).all(axis=-1)
        if begins.any():
            self._episodes = [k + int(new) for k, new in zip(self._episodes, begins, strict=True)]
            self._script.reset_rows(range(len(begins)), self._episodes, mask=begins)
        actions = self._script.act_rows(seen)
        motion, call = self._interface.answers(actions.reshape(-1, 3)).T
        return tensor_of((motion + N_MOTIONS * call).reshape(seen.shape[:2]))


def imitate(
    mappo: Mappo,
    envs: Sequence[RendezvousTorchEnv],
    scripts: Sequence[str],
    *,
    rounds: int = 4,
    epochs: int = 6,
    batch_size: int = 1024,
    lr: float = 1e-3,
) -> int:
    """Teach actor and critic what policies do, and what comes of it.

    Args:
        mappo: Is changed.
        envs: An episode of each world is played a round.
        scripts: Policies, scripted or trained (``ppo:path=...``): one for all environments, or one for each.
        rounds: Of collecting and fitting; the script drives the first.
        epochs: Passes over all that was collected, after each round.
        batch_size: Agent-steps of a gradient step.
        lr: Learning rate.

    Returns:
        Agent-steps played.

    Raises:
        BadInputError: Neither one policy nor as many as environments.
    """
    require(len(scripts) in {1, len(envs)}, "policies to imitate", f"1 or {len(envs)}", len(scripts))
    of_each = [*scripts] * (len(envs) if len(scripts) == 1 else 1)
    drivers = [Lesson(script, env, mappo) for env, script in zip(envs, of_each, strict=True)]
    optimiser = torch.optim.Adam(mappo.loss.parameters(), lr=lr)
    lessons: list[TensorDict] = []
    for k in range(rounds):
        played = []
        for env, driver in zip(envs, drivers, strict=True):
            driver.share = _SHARE if k else 1.0
            with torch.no_grad():
                played.append(env.rollout(env.worlds.scenario.n_steps, driver, break_when_any_done=False))
        lessons.append(mappo.rows(played))
        _fit(mappo, torch.cat(lessons), optimiser, epochs=epochs, batch_size=batch_size)
    return sum(len(each) for each in lessons)


def _fit(
    mappo: Mappo, rows: TensorDict, optimiser: torch.optim.Optimizer, *, epochs: int, batch_size: int
) -> None:
    """Likelihood of what the script would choose, squared error of the value."""
    for _ in range(epochs):
        for some in torch.split(torch.randperm(len(rows)), batch_size):
            row = rows[some]
            value = mappo.critic(row[SHOWN], row[TEAM])
            said = cross_entropy(mappo.actor(row[SHOWN]), row[RIGHT].long())
            loss = said + _VALUE_WEIGHT * mse_loss(value, row[RETURN])
            optimiser.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            torch.nn.utils.clip_grad_norm_(mappo.loss.parameters(), 1.0)
            optimiser.step()
