"""How a command ends that prints to a console."""

from collections.abc import Callable

from rich.console import Console

from wifipgo.command import command_line
from wifipgo.command.terminal import Terminal


def exit_code(job: Callable[[Console], object], *, interrupted: str) -> int:
    """`wifipgo.command.command_line.exit_code` of a job that takes the console to print to."""
    return command_line.exit_code(lambda: job(Terminal()), interrupted=interrupted)
