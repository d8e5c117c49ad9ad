"""A picture of a room before anybody moves: walls, obstacles, starts, how far robots see and drive."""

from collections.abc import Sequence
from pathlib import Path

from wifipgo.command.figures import Axes, Figure

import numpy as np
from matplotlib.artist import Artist
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, Polygon

from envs._rendezvous import RendezvousEnv
from wifipgo.command.palette import ROBOTS
from wifipgo.files.atomic_files import appearing
from wifipgo.world.layout import ArenaConfig
from wifipgo.world.polygons import area_m2, convex_parts

_MANY = 8  # robots from which names are left out and lines are thin


def draw_room(path: Path, env: RendezvousEnv, *, seed: int) -> None:
    """Draw the world that an environment was reset to, and write it to a PNG file.

    Raises:
        OSError: It cannot be written.
    """
    figure = Figure(figsize=(7.2, 7.6), dpi=130, layout="constrained")
    axes, scenario = figure.subplots(), env.scenario
    _draw_walls(axes, env)
    for k, start in enumerate(env.world.layout.starts):
        _draw_robot(axes, env, k, start)
    axes.set_title(f"{scenario.name}: {scenario.n_robots} robots, world of seed {seed}", loc="left")
    axes.spines[["top", "right"]].set_visible(False)
    low, high = _limits_m(env)
    axes.set(xlim=(low, high), ylim=(low, high), xlabel="x (m)", ylabel="y (m)", aspect="equal")
    figure.legend(handles=_key(env), loc="outside lower center", ncols=3, frameon=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    with appearing(path) as unfinished:
        figure.savefig(unfinished, format="png")


def _limits_m(env: RendezvousEnv) -> tuple[float, float]:
    """Limits of both axes that hold the room and every circle."""
    size_m, starts = env.scenario.arena.size_m, np.asarray(env.world.layout.starts)
    steps_m = env.scenario.arena.steps_m(env.scenario.n_robots)
    reach_m = np.maximum(steps_m, env.scenario.sensing.sensor_range_m)[:, None]
    margin_m = 0.04 * size_m
    low = min(0.0, float((starts[:, :2] - reach_m).min()))
    high = max(size_m, float((starts[:, :2] + reach_m).max()))
    return low - margin_m, high + margin_m


def _draw_walls(axes: Axes, env: RendezvousEnv) -> None:
    layout, n_by_hand = env.world.layout, len(env.scenario.arena.obstacles_m)
    axes.add_collection(LineCollection(list(layout.walls_m), colors="0.2", linewidths=2.5))
    for k, corners in enumerate(layout.obstacles_m):
        by_hand = k < n_by_hand
        axes.add_patch(Polygon(corners, closed=True, fc="0.65" if by_hand else "0.85", ec="0.35", lw=0.8))
        if by_hand:
            x, y = max(convex_parts(corners), key=area_m2).mean(axis=0).tolist()  # not in a notch
            axes.text(x, y, str(k), ha="center", va="center", fontsize=8)


def _draw_robot(axes: Axes, env: RendezvousEnv, k: int, start: np.ndarray) -> None:
    """Body, heading, sensor range (dashed) and step (dotted)."""
    scenario, colour, many = env.scenario, ROBOTS[k % len(ROBOTS)], env.scenario.n_robots > _MANY
    at, line = (float(start[0]), float(start[1])), 0.7 if many else 1.4
    step_m = float(scenario.arena.steps_m(scenario.n_robots)[k])
    for radius_m, style in ((scenario.sensing.sensor_range_m, "--"), (step_m, ":")):
        axes.add_patch(Circle(at, radius_m, fill=False, ec=colour, ls=style, lw=line))
    body_m = scenario.arena.robot_radius_m
    axes.add_patch(Circle(at, body_m, fc=colour, ec="none"))
    ahead = 3.0 * body_m * np.array([np.cos(start[2]), np.sin(start[2])])
    axes.plot([at[0], at[0] + ahead[0]], [at[1], at[1] + ahead[1]], color=colour, lw=2.0 * line)
    if not many:
        axes.annotate(env.possible_agents[k], at, (4, 6), textcoords="offset points", fontsize=8)


def _made_of(arena: ArenaConfig) -> str:
    """Materials of obstacles, each once."""
    return ", ".join(dict.fromkeys(arena.obstacle_materials)) or arena.obstacle_material


def _key(env: RendezvousEnv) -> Sequence[Artist]:
    arena, sensing = env.scenario.arena, env.scenario.sensing
    step = f"step: {arena.step_m:g} m" + (" x factor" if arena.step_scale else "")
    marks: list[Artist] = [
        Line2D([], [], color="0.3", marker="o", ms=5, lw=2.0, label="start and heading"),
        Line2D([], [], color="0.3", ls="--", label=f"sensor range: {sensing.sensor_range_m:g} m"),
        Line2D([], [], color="0.3", ls=":", label=step),
        Line2D([], [], color="0.2", lw=2.5, label=f"walls: {arena.wall_material}"),
    ]
    if arena.obstacles_m:
        marks.append(Patch(fc="0.65", ec="0.35", label=f"obstacles by index: {_made_of(arena)}"))
    if len(env.world.layout.obstacles_m) > len(arena.obstacles_m):
        marks.append(Patch(fc="0.85", ec="0.35", label=f"random obstacles: {_made_of(arena)}"))
    return marks
