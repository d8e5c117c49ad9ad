"""The command ``wifipgo``: one table of subcommands, each loaded when it is asked for.

A subcommand is a module with ``main(args) -> int``. Nothing slow is imported here: ``wifipgo --help`` lists
what there is before numpy would have loaded.
"""

import importlib
import sys
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

from wifipgo.command import early_interrupts, own_packages
from wifipgo.command.bench import listed
from wifipgo.command.command_line import exit_code, say
from wifipgo.errors import pick
from wifipgo.version import version

# Processes that a command starts load this module first, so it holds in them too.
own_packages.find_own_first()


class Subcommand(NamedTuple):
    """What a word after ``wifipgo`` starts.

    Attributes:
        module: Its module, with ``main(args)``; a string, as floors know nothing of those above.
        does: What it does, in a line.
        extra: The extra that it needs, if any.
    """

    module: str
    does: str
    extra: str = ""


SUBCOMMANDS: Mapping[str, Subcommand] = MappingProxyType(
    {
        "describe": Subcommand("envs.describe", "agents, actions, observation and values of a scenario"),
        "watch": Subcommand("baselines.watch", "one episode as a film, a picture or a recording"),
        "evaluate": Subcommand("baselines.evaluate", "policies against each other on the same worlds"),
        "suite": Subcommand("baselines.suite.__main__", "policies ranked over many scenarios, to be cited"),
        "merge": Subcommand("baselines.merge", "parts of an evaluation or a suite, made one"),
        "train": Subcommand("train.ppo", "a policy with shared parameters by PPO", "train"),
        "reproduce": Subcommand(
            "baselines.reproduce.__main__", "the paper's figures, regenerated, and its claims, judged"
        ),
        "optimise": Subcommand("wifipgo.graph.optimise", "a multi-robot pose graph in g2o, JRL or CSV files"),
        "ate": Subcommand("wifipgo.graph.ate", "trajectory errors of a team against the truth: ATE, RPE"),
        "recordings": Subcommand(
            "wifipgo.radio.recordings.__main__", "directions of transmitters from real CSI recordings"
        ),
        "bench": Subcommand("wifipgo.command.bench", "benchmarks of a checkout, by name"),
    }
)

_HELP = """usage: wifipgo COMMAND [OPTIONS]

Multi-robot pose graph optimisation with Wi-Fi direction sensing: a library and a PettingZoo environment.

Commands; `wifipgo COMMAND --help` teaches one:
{commands}

Begin with:
  wifipgo describe paper-hw-2-obstacles
  wifipgo evaluate --policies active,random --trials 20 --out results/first
  wifipgo watch --policy active --seed 3 --out active.gif

Results go to the folder or file that --out names; nothing else is written. Exit codes: 0 done, 1 doubtful
or incomplete, 2 bad input, 3 a computation failed, 130 interrupted."""


def help_text() -> str:
    """What ``wifipgo --help`` prints."""
    needs = {name: f" (extra '{row.extra}')" if row.extra else "" for name, row in SUBCOMMANDS.items()}
    return _HELP.format(commands=listed({name: row.does + needs[name] for name, row in SUBCOMMANDS.items()}))


def main(args: Sequence[str] | None = None) -> int:
    """Run from the command line; the exit code is that of `wifipgo.command.command_line`."""
    early_interrupts.watch(ours=True)
    words = list(sys.argv[1:] if args is None else args)
    if words[:1] == ["help"]:
        words = [*words[1:2], "--help"]
    if words and words[0] in SUBCOMMANDS:
        module = importlib.import_module(SUBCOMMANDS[words[0]].module)
        return int(module.main(words[1:]))
    return exit_code(lambda: _answer(words), computes=False)


def _answer(words: Sequence[str]) -> None:
    """Help, the version, or a word that is no command."""
    match words:
        case [] | ["-h" | "--help", *_]:
            say(help_text())
        case ["-V" | "--version", *_]:
            say(f"wifipgo {version()}")
        case [word, *_]:
            pick(SUBCOMMANDS, word, "command")
