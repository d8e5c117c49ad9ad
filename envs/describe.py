"""What a scenario is: ``wifipgo describe paper-hw-2-obstacles``."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console
from rich.text import Text

from envs._describe_tables import (
    action_table,
    agent_table,
    fields_markdown,
    observation_table,
    scenario_table,
    value_table,
)
from envs._rendezvous import RendezvousEnv
from wifipgo.coerce import settings
from wifipgo.command.command_line import exit_code
from wifipgo.command.docstrings import documented
from wifipgo.command.overrides import Overrides, joined
from wifipgo.command.terminal import Terminal
from wifipgo.errors import require
from wifipgo.files.targets import check_target
from wifipgo.scenarios import Scenario, scenario_named, scenario_toml

# Columns of tables that go to a file or another program.
_WIDTH = 132


@dataclass(frozen=True, slots=True, kw_only=True)
class DescribeConfig:
    """Agents, actions, observation and values of a scenario, and a picture of its room.

    Example: wifipgo describe paper-hw-2-obstacles --out room.png

    Example: wifipgo describe room.toml --set n_obstacles=6 size_m=30 --seed 4

    Example: wifipgo describe paper-hw-2 --set size_m=30 --toml > room.toml

    Attributes:
        scenario: Scenario, e.g. paper-hw-2, or a file, e.g. room.toml; an unknown one lists those that exist.
        overrides: Other values for fields of the scenario: --set n_obstacles=4 size_m=30.
        seed: Seed of the world whose starts and obstacles are shown.
        out: File for the picture, .png; results/describe/NAME.png if not given.
        list: Only list the scenarios that exist.
        toml: Only print the scenario as a TOML file that says everything.
        fields: Only print every field with type, unit, default and meaning, as in docs/scenarios.md.
    """

    scenario: tyro.conf.Positional[str] = "paper-hw-2"
    overrides: Overrides = ()
    seed: int = 0
    out: Path | None = None
    list: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    toml: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    fields: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False


def describe(config: DescribeConfig, *, console: Console) -> None:
    """Print what is asked for; the picture is drawn last.

    Raises:
        ValueError: A name or value that is refused; the message lists what exists.
        OSError: A scenario that cannot be read, or a picture that cannot be written.
    """
    require(config.seed >= 0, "seed", ">= 0", config.seed)
    if config.list:
        console.print(scenario_table())
    elif config.fields:
        console.out(fields_markdown(), end="", highlight=False)
    else:
        scenario = scenario_named(config.scenario).with_overrides(**settings(config.overrides))
        if config.toml:
            console.out(scenario_toml(scenario), end="", highlight=False)
        else:
            _describe(scenario, config, console)


def _describe(scenario: Scenario, config: DescribeConfig, console: Console) -> None:
    """Print the tables, then draw the room."""
    path = config.out or Path("results/describe") / f"{Path(scenario.name).name}.png"
    check_target("out", path, {".png": None}, overwrite=True, folder_comes=True)
    env = RendezvousEnv(scenario)
    env.reset(seed=config.seed)
    console.print(Text(scenario.name, style="bold"))
    console.print(Text(scenario.source))
    tables = (agent_table(env, config.seed), action_table(env), observation_table(env), value_table(scenario))
    for table in tables:
        console.print()
        console.print(table)
    _draw(path, env, config.seed)
    console.print(Text(f"\npicture: {path}"))


def _draw(path: Path, env: RendezvousEnv, seed: int) -> None:
    """Draw the room, under the project's own settings."""
    from wifipgo.command.figures import drawing  # noqa: PLC0415 (matplotlib loads slowly, and only here)

    with drawing(path, asked_for=True):
        from envs._describe_picture import draw_room  # noqa: PLC0415

        draw_room(path, env, seed=seed)


def main(args: Sequence[str] | None = None) -> int:
    """Run from the command line; the exit code is that of `wifipgo.command.command_line`."""
    shown = sys.stdout is not None and sys.stdout.isatty()  # there is none where a shell closed it
    console = Terminal() if shown else Terminal(width=_WIDTH)
    config = partial(tyro.cli, documented(DescribeConfig), prog="wifipgo describe", args=joined(args))
    return exit_code(lambda: describe(config(), console=console))


if __name__ == "__main__":
    sys.exit(main())
