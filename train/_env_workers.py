"""Batches of environments, here or in a process of their own, behind one face: ask, then take the answer."""

import multiprocessing
import traceback
from collections.abc import Sequence
from multiprocessing.connection import Connection
from typing import Any, Protocol

import cloudpickle

from train._env_batch import Batch, Maker
from wifipgo.command.processes import one_thread_each, settle_in

_PATIENCE_S = 5.0


class Crew(Protocol):
    """Something that runs the methods of a `Batch`."""

    n_envs: int

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

    def __init__(self, makers: Sequence[Maker]) -> None:
        """Make the environments."""
        self.n_envs, self._batch, self._asked = len(makers), Batch(makers), ("team", ())

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

    Args:
        makers: Functions; cloudpickle takes them there, so lambdas and closures will do.
        name: Of the process, for messages.
    """

    def __init__(self, makers: Sequence[Maker], name: str) -> None:
        """Start the process; it makes the environments meanwhile."""
        self.n_envs = len(makers)
        spawn = multiprocessing.get_context("spawn")
        self._pipe, theirs = spawn.Pipe()
        packed = cloudpickle.dumps(list(makers))
        self._process = spawn.Process(target=_serve, args=(theirs, packed), name=name, daemon=True)
        with one_thread_each():
            self._process.start()
        theirs.close()  # so that its death ends our waiting

    def ask(self, name: str, *args: Any) -> None:
        """Send what to do; the process begins at once."""
        try:
            self._pipe.send_bytes(cloudpickle.dumps((name, args)))
        except OSError as problem:
            raise self._death() from problem

    def answer(self) -> Any:
        """Wait for the process.

        Raises:
            Exception: What the environment raised, with the process's own trace as a note.
            RuntimeError: The process is dead.
        """
        try:
            fine, value, *trace = cloudpickle.loads(self._pipe.recv_bytes())
        except (EOFError, OSError) as problem:
            raise self._death() from problem
        if fine:
            return value
        value.add_note(f"In {self._process.name}:\n{''.join(trace)}")
        raise value

    def dismiss(self) -> None:
        """The process ends when the pipe is closed."""
        self._pipe.close()

    def close(self) -> None:
        """Wait for that; a process that does not end is ended."""
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


def _done(batch: Batch, name: str, args: tuple[Any, ...]) -> Any:
    found = getattr(batch, name)
    return found(*args) if callable(found) else found


def _serve(pipe: Connection, packed: bytes) -> None:
    """Life of a worker: make the environments, answer until the pipe is closed."""
    settle_in()
    batch: Batch | None = None
    name, args = "team", ()
    try:
        while True:
            try:
                batch = batch or Batch(cloudpickle.loads(packed))
                reply = cloudpickle.dumps((True, _done(batch, name, args)))
            except Exception as problem:
                reply = _packed(problem)
            pipe.send_bytes(reply)
            name, args = cloudpickle.loads(pipe.recv_bytes())
    except (EOFError, OSError):
        pass
    finally:
        if batch is not None:
            batch.close()


def _packed(problem: Exception) -> bytes:
    """An exception for the parent; one that does not travel goes as its text."""
    trace = "".join(traceback.format_exception(problem))
    try:
        packed = cloudpickle.dumps((False, problem, trace))
        cloudpickle.loads(packed)
    except Exception:
        packed = cloudpickle.dumps((False, RuntimeError(f"{type(problem).__name__}: {problem}"), trace))
    return packed
