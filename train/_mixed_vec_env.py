"""Environments with teams of several sizes as one: the rows of one after those of the other."""

import os
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import chain
from multiprocessing.connection import Connection, wait
from typing import Any, TypeVar

import numpy as np
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvObs, VecEnvStepReturn

from wifipgo.errors import require

T = TypeVar("T")


class MixedVecEnv(VecEnv):
    """Several VecEnvs that show and are told the same kind of numbers, side by side.

    Parts with processes of their own are stepped at once, as many as there are cores, those first that took
    longest before: more at a time would only take the cores from each other. Results do not depend on it.

    Args:
        parts: Those with processes tell by ``pipes`` when they have answered.

    Attributes:
        parts: As given.
        bounds: First row of each part, and the end of the last.
    """

    def __init__(self, parts: Sequence[VecEnv]) -> None:
        """Put them together."""
        self.parts = tuple(parts)
        first = self.parts[0]
        for part in self.parts[1:]:
            same = (part.observation_space, part.action_space) == (
                first.observation_space,
                first.action_space,
            )
            require(same, "parts", "of the same spaces", part.observation_space)
        self._took_s = [0.0] * len(self.parts)
        self._actions = np.empty(0)
        self._waiting: list[int] = []
        self._running: dict[int, float] = {}
        self.bounds = np.cumsum([0, *(part.num_envs for part in self.parts)]).tolist()
        super().__init__(self.bounds[-1], first.observation_space, first.action_space)

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seed the next reset; each part has a root of its own."""
        roots = np.random.SeedSequence(seed).generate_state(len(self.parts)).tolist()
        return list(
            chain.from_iterable(part.seed(root) for part, root in zip(self.parts, roots, strict=True))
        )

    def reset(self) -> VecEnvObs:
        """Begin an episode everywhere."""
        apart = all(getattr(part, "pipes", ()) for part in self.parts)
        return np.concatenate(done([part.reset for part in self.parts], at_once=apart))

    def step_async(self, actions: np.ndarray) -> None:
        """Hand out one action a row, to as many parts as there are cores."""
        self._waiting = sorted(range(len(self.parts)), key=lambda k: self._took_s[k])
        self._actions = actions
        for _ in range(min(_cores(), len(self.parts))):
            self._start()

    def step_wait(self) -> VecEnvStepReturn:
        """What the step gave, by row."""
        found: dict[int, VecEnvStepReturn] = {}
        while self._running:
            k = self._answering()
            found[k] = self.parts[k].step_wait()
            self._took_s[k] = time.perf_counter() - self._running.pop(k)
            self._start()
        shown, rewards, dones, infos = zip(*(found[k] for k in range(len(self.parts))), strict=True)
        rows = np.concatenate([np.asarray(each) for each in shown])
        return rows, np.concatenate(rewards), np.concatenate(dones), list(chain.from_iterable(infos))

    def _start(self) -> None:
        """Step the part that took longest of those that wait."""
        if self._waiting:
            k = self._waiting.pop()
            self._running[k] = time.perf_counter()
            self.parts[k].step_async(self._actions[self.bounds[k] : self.bounds[k + 1]])

    def _answering(self) -> int:
        """A part that runs and has answered, or one that works when it is asked for the answer."""
        of: dict[Connection, int] = {}
        for k in self._running:
            of |= dict.fromkeys(getattr(self.parts[k], "pipes", ()), k)
        working = self._running.keys() - of.values()
        return min(working) if working else of[wait(list(of))[0]]  # type: ignore[index]

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """An attribute of the environment of each row."""
        return self._by_row("get_attr", indices, attr_name)

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute of the environments of some rows."""
        self._by_row("set_attr", indices, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method in the environments of some rows."""
        return self._by_row("env_method", indices, method_name, *method_args, **method_kwargs)

    def env_is_wrapped(self, wrapper_class: type[Any], indices: VecEnvIndices = None) -> list[bool]:
        """Whether a wrapper of this type is around the environment of each row."""
        return self._by_row("env_is_wrapped", indices, wrapper_class)

    def close(self) -> None:
        """Close all parts; workers, which end when their pipes are closed, end at once."""
        for pipe in chain.from_iterable(getattr(part, "pipes", ()) for part in self.parts):
            pipe.close()
        for part in self.parts:
            part.close()

    def _with_bounds(self) -> Iterable[tuple[VecEnv, int, int]]:
        return zip(self.parts, self.bounds[:-1], self.bounds[1:], strict=True)

    def _by_row(self, name: str, indices: VecEnvIndices, *args: Any, **kwargs: Any) -> list[Any]:
        """Ask the parts of some rows; answers in the order of the rows that were asked for."""
        rows = list(self._get_indices(indices))
        found: dict[int, Any] = {}
        for part, begin, end in self._with_bounds():
            mine = [row for row in rows if begin <= row < end]
            if mine:
                told = getattr(part, name)(*args, indices=[row - begin for row in mine], **kwargs)
                found |= dict(zip(mine, told or [None] * len(mine), strict=True))
        return [found[row] for row in rows]


def done(jobs: Sequence[Callable[[], T]], *, at_once: bool) -> list[T]:
    """What jobs give, in order; at once where each waits for processes of its own."""
    if not at_once:
        return [job() for job in jobs]
    with ThreadPoolExecutor(len(jobs)) as threads:
        return list(threads.map(lambda job: job(), jobs))


def _cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
