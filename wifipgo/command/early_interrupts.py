"""Ctrl-C while a command still loads its modules: one line and exit code 130, no traceback.

Loading takes seconds; `wifipgo.command.command_line.exit_code`, which comes then, ends this. The packages of
commands import `wifipgo` first, which imports this first, so it holds before anything that is slow to
load; the command ``wifipgo`` says itself that it is one of ours. In programs of others this does nothing, nor
where Ctrl-C is ignored (``nohup``) or handled otherwise.
"""

import os
import signal
import sys
import threading

_OURS = ("baselines", "envs", "train", "wifipgo")
_INTERRUPTED = 130


def _end(*_: object) -> None:
    """Nothing has begun yet, so there is nothing to clean up; libraries that load may catch exceptions."""
    os.write(2, b"interrupted; nothing was written\n")
    os._exit(_INTERRUPTED)


def _starts_a_command() -> bool:
    """Whether ``python -m`` is about to load one of our modules: it says so in ``sys.argv`` until then."""
    if sys.argv[:1] != ["-m"]:
        return False
    words = iter(sys.orig_argv)
    option = next((word for word in words if word.startswith("-m")), "")
    module = option.removeprefix("-m") or next(words, "")
    return module.partition(".")[0] in _OURS


def watch(*, ours: bool = False) -> None:
    """Answer Ctrl-C from now on, if a command is about to be loaded.

    Args:
        ours: Whether one is for sure.
    """
    here = threading.current_thread() is threading.main_thread()
    if (
        here
        and (ours or _starts_a_command())
        and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    ):
        signal.signal(signal.SIGINT, _end)


def unwatch() -> None:
    """Let Ctrl-C be `KeyboardInterrupt` again."""
    here = threading.current_thread() is threading.main_thread()
    if here and signal.getsignal(signal.SIGINT) is _end:
        signal.signal(signal.SIGINT, signal.default_int_handler)


watch()
