"""Batches of environments, here or in a process of their own, behind one face: ask, then take the answer."""

import multiprocessing
import pickle
import threading
import traceback
from collections.abc import Sequence
from contextlib import suppress
from multiprocessing.connection import Connection
from multiprocessing.shared_memory import SharedMemory
from typing import Any, Protocol

import cloudpickle
import numpy as np

from train._env_batch import Batch, Maker
from train._shown_batch import Showing, ShownBatch
from train._world_batch import WorldBatch, are_worlds
from wifipgo.command.processes import one_thread_each, settle_in

_PATIENCE_S = 5.0
# Threads that start workers take turns: the environment, which says how many threads they have, is one.
_STARTING = threading.Lock()
_SHARE = "share"  # asked of a worker, not of its batch


class Crew(Protocol):
    """Something that runs the methods of a `Batch`.

    Attributes:
        n_envs: Environments of it.
        rows: Where flat observations lie after each answer that has None in their place.
    """

    n_envs: int
    rows: np.ndarray | None

    def ask(self, name: str, *args: Any) -> None:
        """Name an attribute of the batch to read, or a method and its arguments."""

    def answer(self) -> Any:
        """Wait for what was asked and hand it back, or raise what went wrong."""

    def dismiss(self) -> None:
        """Let the environments go; nothing can be asked any more."""

    def close(self) -> None:
        """Wait until they are gone."""


class LocalCrew:
    """Environments of this process: the work is done when the answer is taken."""

    rows: np.ndarray | None = None

    def __init__(
        self, makers: Sequence[Maker], phases: Sequence[float] = (), showing: Showing | None = None
    ) -> None:
        """Make the environments."""
        self.n_envs, self._asked = len(makers), ("team", ())
        self._batch = batch_of(makers, phases, showing)

    def ask(self, name: str, *args: Any) -> None:
        """Remember what to do."""
        self._asked = (name, args)

    def answer(self) -> Any:
        """Do it."""
        return _done(self._batch, *self._asked)

    def dismiss(self) -> None:
        """Close the environments."""
        self._batch.close()

    def close(self) -> None:
        """Nothing is left to wait for."""


class RemoteCrew:
    """Environments of another process.

    Attributes:
        pipe: Becomes readable when there is an answer.

    Args:
        makers: Functions; cloudpickle takes them there, so lambdas and closures will do.
        name: Of the process, for messages.
        phases: See `train._world_batch.WorldBatch`.
        showing: As what observations are shown, and actions taken; as they are without.
    """

    def __init__(
        self,
        makers: Sequence[Maker],
        name: str,
        phases: Sequence[float] = (),
        showing: Showing | None = None,
    ) -> None:
        """Start the process; it makes the environments meanwhile."""
        self.n_envs = len(makers)
        spawn = multiprocessing.get_context("spawn")
        self.pipe, theirs = spawn.Pipe()
        packed = cloudpickle.dumps((list(makers), list(phases), showing))
        self._process = spawn.Process(target=_serve, args=(theirs, packed), name=name, daemon=True)
        with _STARTING, one_thread_each():
            self._process.start()
        theirs.close()  # so that its death ends our waiting
        self.rows: np.ndarray | None = None  # goes before the memory that it lies in
        self._memory: SharedMemory | None = None

    def share(self, shape: tuple[int, ...]) -> None:
        """Let observations, float32, come through memory that both processes see, not through the pipe."""
        self._memory = SharedMemory(create=True, size=4 * int(np.prod(shape)))
        self.rows = np.ndarray(shape, np.float32, self._memory.buf)
        self.ask(_SHARE, self._memory.name, shape)
        self.answer()
        self._memory.unlink()  # both have it: whatever ends them, nothing is left behind

    def ask(self, name: str, *args: Any) -> None:
        """Send what to do; the process begins at once."""
        try:
            self.pipe.send_bytes(_packed((name, args)))
        except OSError as problem:
            raise self._death() from problem

    def answer(self) -> Any:
        """Wait for the process.

        Raises:
            Exception: What the environment raised, with the process's own trace as a note.
            RuntimeError: The process is dead.
        """
        try:
            fine, value, *trace = cloudpickle.loads(self.pipe.recv_bytes())
        except (EOFError, OSError) as problem:
            raise self._death() from problem
        if fine:
            return value
        value.add_note(f"In {self._process.name}:\n{''.join(trace)}")
        raise value

    def dismiss(self) -> None:
        """The process ends when the pipe is closed."""
        self.pipe.close()

    def close(self) -> None:
        """Wait for that; a process that does not end is ended."""
        self.rows = None
        if self._memory is not None:
            self._memory.close()
            self._memory = None
        self._process.join(_PATIENCE_S)
        for end in (self._process.terminate, self._process.kill):
            if self._process.is_alive():
                end()
                self._process.join(_PATIENCE_S)

    def _death(self) -> RuntimeError:
        self._process.join(_PATIENCE_S)
        code = self._process.exitcode
        return RuntimeError(
            f"{self._process.name} with {self.n_envs} environments died (exit code {code}); "
            "a script that starts workers must do so under `if __name__ == '__main__':`"
        )


AnyBatch = Batch | WorldBatch | ShownBatch


def batch_of(makers: Sequence[Maker], phases: Sequence[float], showing: Showing | None = None) -> AnyBatch:
    """Worlds that are stepped at once where they can be, else one environment after the other."""
    if not are_worlds(makers):
        return Batch(makers)
    worlds = WorldBatch(makers, phases)
    return worlds if showing is None else ShownBatch(worlds, showing)


def _done(batch: AnyBatch, name: str, args: tuple[Any, ...]) -> Any:
    found = getattr(batch, name)
    return found(*args) if callable(found) else found


def _serve(pipe: Connection, packed: bytes) -> None:
    """Life of a worker: make the environments, answer until the pipe is closed."""
    settle_in()
    batch: AnyBatch | None = None
    memory: list[SharedMemory] = []
    name: str = "team"
    args: tuple[Any, ...] = ()
    try:
        while True:
            try:
                batch = batch or batch_of(*cloudpickle.loads(packed))
                if name == _SHARE:
                    name, args = "write_into", (_attached(memory, *args),)
                reply = _packed((True, _done(batch, name, args)))
            except Exception as problem:
                reply = _packed_problem(problem)
            pipe.send_bytes(reply)
            name, args = cloudpickle.loads(pipe.recv_bytes())
    except (EOFError, OSError):
        pass
    finally:
        if batch is not None:
            batch.close()


def _attached(memory: list[SharedMemory], name: str, shape: tuple[int, ...]) -> np.ndarray:
    """An array in the parent's memory, which stays as long as the list does."""
    memory.append(SharedMemory(name))
    return np.ndarray(shape, np.float32, memory[-1].buf)


def _packed(message: Any) -> bytes:
    """Bytes of a message: by pickle, which is faster, where that can."""
    with suppress(Exception):
        return pickle.dumps(message, pickle.HIGHEST_PROTOCOL)
    packed: bytes = cloudpickle.dumps(message)
    return packed


def _packed_problem(problem: Exception) -> bytes:
    """An exception for the parent; one that does not travel goes as its text."""
    trace = "".join(traceback.format_exception(problem))
    try:
        packed: bytes = cloudpickle.dumps((False, problem, trace))
        cloudpickle.loads(packed)
    except Exception:
        packed = cloudpickle.dumps((False, RuntimeError(f"{type(problem).__name__}: {problem}"), trace))
    return packed
