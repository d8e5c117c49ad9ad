"""Many worlds as one environment of TorchRL, and so of BenchMARL. Needs ``torchrl``."""

from os import PathLike
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from tensordict import TensorDict, TensorDictBase
from torchrl.data import Bounded, Categorical, Composite, Unbounded
from torchrl.envs import EnvBase

from baselines.policies.learned.interfaces import make_interface
from envs.rendezvous_v0 import RESET_MASK, RendezvousVectorEnv, flat_vector_env
from train._tensors import tensor_of
from wifipgo.scenarios import Scenario

GROUP = "robots"
_MASK = "action_mask"
_FLAGS = ("done", "terminated", "truncated")


class RendezvousTorchEnv(EnvBase):
    """World k of the batch is `envs.rendezvous_v0.RendezvousEnv` with the seed of world k.

    Entries, all with the worlds as batch: ``("robots", "observation")`` (robots, numbers), ``"action"``,
    ``"reward"`` (robots, 1), ``"info"`` by name, in single precision; with ``actions="discrete"`` also
    ``"action_mask"``; ``done``, ``terminated`` and ``truncated`` (1,) of the world; and ``state`` (numbers,)
    if asked for. There is no autoreset: TorchRL says by ``_reset`` which worlds begin anew.

    Args:
        scenario: As in `envs.rendezvous_v0.parallel_env`.
        num_envs: Worlds.
        return_state: Show what is true and believed of the team, for a centralised critic.
        interface: Show what networks of this interface are shown, by its name in
            `baselines.policies.learned.interfaces.INTERFACES`; without one, the whole observation. The
            choices of ``actions="discrete"`` are the answers of those that choose among directions.
        seed: Of world 0; those after it have the numbers that follow.
        device: Where tensors are wanted; worlds are stepped by the processor.
        arguments: Others of `envs.rendezvous_v0.vector_env`; observations are always flat.

    Attributes:
        worlds: Stepped as one.
        seen: What robots observe now, (worlds, robots, numbers), whatever is shown of it.

    Raises:
        ValueError: As `vector_env`, and for ``observation`` other than "flat".
    """

    seen: np.ndarray

    def __init__(
        self,
        scenario: str | PathLike[str] | Scenario = "paper-hw-2",
        *,
        num_envs: int = 64,
        return_state: bool = False,
        interface: str | None = None,
        seed: int | None = None,
        device: Any = "cpu",
        **arguments: Any,
    ) -> None:
        """Make the worlds, and tell TorchRL what they show."""
        worlds = flat_vector_env(scenario, num_envs, whom="tensors", **arguments)
        super().__init__(device=device, batch_size=torch.Size([num_envs]))
        self.worlds, self.return_state = worlds, return_state
        self._interface = None if interface is None else make_interface(interface, worlds.scenario)
        self.group_map = {GROUP: list(worlds.possible_agents)}
        self._next_seed = seed
        self._before: Any = None
        self._memory: Any = None
        self._terminated = self._truncated = np.zeros(num_envs, dtype=bool)
        self._set_specs(RendezvousVectorEnv(scenario, n_worlds=1, **arguments).reset(seed=0)[1])

    def robots_spec(self, entry: str) -> Composite | None:
        """Spec of one entry of the robots of a world, None where there is none."""
        spec = self.full_observation_spec_unbatched[GROUP]
        found = {entry: spec[entry].clone()} if entry in list(spec.keys()) else None
        return found and _group(found, self.worlds.n_robots).to(self.device)

    def _set_specs(self, infos: dict[str, np.ndarray]) -> None:
        """Specs of one world: TorchRL adds the axis of worlds."""
        n, device = self.worlds.n_robots, self.device
        seen: dict[str, Any] = {"observation": self._shown_spec(n)}
        if _MASK in infos:
            seen[_MASK] = _unknown(infos[_MASK].astype(bool))
        told = {name: _unknown(column) for name, column in infos.items() if name != _MASK}
        seen["info"] = Composite(told, shape=(n,))
        observation = {GROUP: Composite(seen, shape=(n,))}
        if self.return_state:
            observation["state"] = _box(self.worlds.state_space)
        moves: Any = self.worlds.single_action_space
        discrete = isinstance(moves, spaces.Discrete)
        action = Categorical(int(moves.n), shape=(n,)) if discrete else _box(moves, n)
        flags = {name: Categorical(2, shape=(1,), dtype=torch.bool) for name in _FLAGS}
        self.full_action_spec_unbatched = _group({"action": action}, n).to(device)
        self.full_observation_spec_unbatched = Composite(observation).to(device)
        self.full_reward_spec_unbatched = _group({"reward": Unbounded(shape=(n, 1))}, n).to(device)
        self.full_done_spec_unbatched = Composite(flags).to(device)

    def _set_seed(self, seed: int | None) -> None:
        """Worlds take it at the next reset."""
        self._next_seed = seed

    def _reset(self, tensordict: TensorDictBase | None = None, **_: Any) -> TensorDictBase:
        """Begin an episode in every world, or in those of ``_reset``."""
        asked = None if tensordict is None else tensordict.get("_reset", None)
        options = {} if asked is None else {RESET_MASK: asked.cpu().numpy().reshape(self.worlds.n_worlds)}
        seed, self._next_seed = self._next_seed, None
        seen, infos = self.worlds.reset(seed=seed, options=options)
        over = self.worlds.over
        return self._told(seen, infos, self._terminated & over, self._truncated & over)

    def _step(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Advance every world that is not over."""
        self._before = self._memory
        step = self.worlds.step(tensordict.get((GROUP, "action")).detach().cpu().numpy())
        ends = (step.terminations, step.truncations)
        self._terminated, self._truncated = (np.asarray(flags.any(axis=1)) for flags in ends)
        told = self._told(step.observations, step.infos, self._terminated, self._truncated)
        told.set((GROUP, "reward"), self._tensor(step.rewards).unsqueeze(-1))
        return told

    def render(self, world: int = 0) -> Any:
        """A picture of one world."""
        worlds: Any = self.worlds
        return worlds.render(world)

    def close(self, **arguments: Any) -> None:
        """Close the worlds."""
        super().close(**arguments)
        self.worlds.close()

    def _told(
        self, seen: np.ndarray, infos: dict[str, np.ndarray], terminated: np.ndarray, truncated: np.ndarray
    ) -> TensorDict:
        """What is observed and said, as tensors."""
        n, self.seen = (self.worlds.n_worlds, self.worlds.n_robots), seen
        info = {name: self._tensor(column) for name, column in infos.items() if name != _MASK}
        group = {
            "observation": self._tensor(self._shown(seen)),
            "info": TensorDict(info, n, device=self.device),
        }
        if _MASK in infos:
            group[_MASK] = self._tensor(infos[_MASK].astype(bool))
        flags = zip(_FLAGS, (terminated | truncated, terminated, truncated), strict=True)
        told: dict[str, Any] = {name: self._tensor(flag[:, None]) for name, flag in flags}
        if self.return_state:
            told["state"] = self._tensor(self.worlds.state())
        told[GROUP] = TensorDict(group, n, device=self.device)
        return TensorDict(told, self.batch_size, device=self.device)

    def _shown(self, seen: np.ndarray) -> np.ndarray:
        """Observations of all robots as a network is shown them.

        Worlds that go on while others begin anew are shown again: nobody remembers the same step twice.
        """
        if self._interface is None:
            return seen
        rows = seen.reshape(-1, seen.shape[-1])
        self._memory = self._interface.remembered(rows, self._before)
        return self._interface.shown(rows, self._memory).reshape(*seen.shape[:-1], -1)

    def _shown_spec(self, n_robots: int) -> Bounded | Unbounded:
        """Bounds of what is shown; an interface tells none."""
        if self._interface is None:
            return _box(self.worlds.single_observation_space, n_robots)
        return Unbounded(shape=(n_robots, self._interface.n_shown))

    def _tensor(self, x: np.ndarray) -> torch.Tensor:
        return tensor_of(x, self.device)


def _group(entries: dict[str, Any], n_robots: int) -> Composite:
    """Specs of the robots of a world."""
    return Composite({GROUP: Composite(entries, shape=(n_robots,))})


def _box(space: Any, *robots: int) -> Bounded:
    """Numbers within the bounds of a space, for each robot."""
    shape = (*robots, *space.shape)
    low, high = (torch.from_numpy(side).expand(shape).clone() for side in (space.low, space.high))
    return Bounded(low, high, shape=low.shape, dtype=low.dtype)


def _unknown(column: np.ndarray) -> Any:
    """Values of the kind that one world's are of."""
    if column.dtype == bool:
        return Categorical(2, shape=column.shape[1:], dtype=torch.bool)
    return Unbounded(shape=column.shape[1:], dtype=tensor_of(column).dtype)
