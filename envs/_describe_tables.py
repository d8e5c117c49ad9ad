"""What `envs.describe` prints: agents, actions, observation and values as tables."""

from typing import Any

import numpy as np
from rich.table import Table
from rich.text import Text

from envs._rendezvous import RendezvousEnv
from wifipgo.scenarios import SCENARIOS, Scenario
from wifipgo.scenarios.field_table import FieldRow, field_rows, limits_of

# Meaning and unit of each component of an action.
ACTIONS = (
    ("x of the waypoint, ahead in the body frame", "step lengths"),
    ("y of the waypoint, to the left in the body frame", "step lengths"),
    ("request: above 0 calls a neighbour and keeps a call up (Algorithm 2)", "-"),
)
# Agents of whom each has a row; of more, the first few.
_SHOWN_AGENTS = 8


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold")
    for column in columns:
        table.add_column(column, justify="right" if column in {"index", "low", "high"} else "left")
    return table


def _add(table: Table, *cells: object) -> None:
    """A row of plain text; brackets are no markup."""
    table.add_row(*(Text(number(cell)) for cell in cells))


def number(value: Any) -> str:
    """A value in a cell: floats to six digits, tuples of them in parentheses."""
    if isinstance(value, bool) or not isinstance(value, float | tuple):
        return str(value)
    if isinstance(value, tuple):
        return f"({', '.join(map(number, value))})"
    return f"{value:.6g}"


def scenario_table() -> Table:
    """Scenarios by name."""
    table = _table("scenarios; a path that ends in .toml is one of your own", "name", "robots", "source")
    table.columns[0].no_wrap = True
    for name, scenario in SCENARIOS.items():
        _add(table, name, scenario.n_robots, scenario.source)
    return table


def agent_table(env: RendezvousEnv, seed: int) -> Table:
    """Agents with what differs from one to the next, and where they start under a seed."""
    scenario, n = env.scenario, env.scenario.n_robots
    table = _table(
        f"{n} agents; starts of seed {seed}",
        "agent",
        "start x, y (m), yaw (deg)",
        "step (m)",
        "sigma_t (m)",
        "sigma_r (deg)",
        "antenna scale",
    )
    starts, steps_m = env.world.layout.starts, scenario.arena.steps_m(n)
    scales, sigmas = scenario.turn.antenna_scale or (1.0,) * n, scenario.sensing.sigmas(n)
    rows = list(zip(env.possible_agents, starts, steps_m, sigmas, scales, strict=True))
    for agent, (x, y, yaw), step_m, (sigma_t, sigma_r), scale in rows[:_SHOWN_AGENTS]:
        where = f"{x:.2f}, {y:.2f}, {np.rad2deg(yaw):.0f}"
        _add(table, agent, where, float(step_m), float(sigma_t), float(np.rad2deg(sigma_r)), float(scale))
    if n > _SHOWN_AGENTS:
        _add(table, f"... {env.possible_agents[-1]}")
    return table


def action_table(env: RendezvousEnv) -> Table:
    """Components of an action; every agent's are the same."""
    space = env.action_spaces[env.possible_agents[0]]
    table = _table(f"action: {space}", "index", "low", "high", "unit", "meaning")
    for k, (meaning, unit) in enumerate(ACTIONS):
        _add(table, k, float(space.low[k]), float(space.high[k]), unit, meaning)
    return table


def observation_table(env: RendezvousEnv) -> Table:
    """Blocks of the flat observation; with ``observation="dict"`` the same by name."""
    size = sum(field.size for field in env.layout)
    title = f"observation: {size} numbers, float32"
    table = _table(title, "index", "name", "low", "high", "unit", "meaning")
    table.columns[1].no_wrap = True
    for field in env.layout:
        last = field.start + field.size - 1
        index = f"{field.start}" if field.size == 1 else f"{field.start}..{last}"
        _add(table, index, field.name, field.low, field.high, field.unit, field.meaning)
    return table


def value_table(scenario: Scenario) -> Table:
    """Every value, and whether the paper gives it."""
    title = "values: --set NAME=VALUE changes one; what is in parentheses is the paper's letter, another name"
    table = _table(title, "table", "name", "value", "unit", "origin", "meaning")
    table.columns[1].no_wrap = True
    part = None
    for row in field_rows(scenario):
        table.add_section() if row.table != part else None
        shown = "" if row.table == part else f"[{row.table}]" if row.table else "(top)"
        name = f"{row.name} ({row.letter})" if row.letter else row.name
        _add(table, shown, name, row.value, row.unit, row.origin, row.meaning.replace("`", ""))
        part = row.table
    return table


def fields_markdown() -> str:
    """Every field with its default as Markdown tables, one for each part: a part of ``docs/scenarios.md``."""
    rows = field_rows(Scenario(name="", source=""))
    parts = dict.fromkeys(row.table for row in rows)
    return "\n".join(_markdown(part, [row for row in rows if row.table == part]) for part in parts)


def _markdown(part: str, rows: list[FieldRow]) -> str:
    head = f"### `[{part}]`" if part else "### At the top"
    lines = [
        f"| {_names(row)} | {row.kind} | {row.unit} | {_code(row.value)} | {limits_of(row.name)} "
        f"| {row.meaning.replace('|', '/')} |"
        for row in rows
    ]
    return "\n".join(
        [
            head,
            "",
            "| field | type | unit | default | limits | meaning |",
            "|---|---|---|---|---|---|",
            *lines,
            "",
        ]
    )


def _names(row: FieldRow) -> str:
    """Name of a field, and the paper's letter for it."""
    return f"`{row.name}`, `{row.letter}`" if row.letter else f"`{row.name}`"


def _code(value: Any) -> str:
    return f"`{number(value)}`"


def layout_markdown() -> str:
    """The flat observation block by block as a Markdown table: a part of ``docs/environment.md``.

    Slots are alike, so only the first is shown; indices are those of ``paper-hw-2``.
    """
    head = "| block | indices | low | high | unit | meaning |\n|---|---|---|---|---|---|"
    lines = [
        f"| `{f.name}` | {f.start}:{f.start + f.size} | {f.low:g} | {f.high:g} | {f.unit} | {f.meaning} |"
        for f in RendezvousEnv("paper-hw-2").layout
    ]
    return "\n".join([head, *lines])
