"""Trajectory errors of whole teams, on the command line.

::

    wifipgo ate REFERENCE ESTIMATE... [--align]
"""

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import tyro
from jaxtyping import Float, Int
from rich.table import Table

from wifipgo.command.command_line import exit_code, printable, say
from wifipgo.command.docstrings import documented
from wifipgo.command.terminal import Terminal
from wifipgo.errors import BadInputError, DoubtfulError, require
from wifipgo.files.atomic_files import write_json
from wifipgo.graph.files.trajectories import (
    TOLERANCE_S,
    Team,
    associated,
    read_team,
    robot_of,
)
from wifipgo.graph.team_accuracy import Accuracy, TeamAccuracy, team_accuracy

COLUMNS = ("poses", "ATE m", "ATE deg", "RPE m", "RPE deg", "Eq. 12 m2", "Eq. 13")


class Compared(NamedTuple):
    """Poses of a team beside the true ones.

    Attributes:
        estimate: Poses that have a counterpart.
        reference: Those.
        robot: Whose each is.
        missing: Robots of the reference that are not in the estimate, or nowhere at its times.
    """

    estimate: Float[np.ndarray, "poses 7"]
    reference: Float[np.ndarray, "poses 7"]
    robot: Int[np.ndarray, " poses"]
    missing: tuple[int, ...]


def compared(reference: Team, estimate: Team, *, tolerance_s: float = TOLERANCE_S) -> Compared:
    """Poses of two teams that belong together, robot by robot.

    Where both are of one robot, its number does not matter.

    Raises:
        BadInputError: No pose of the one belongs to any of the other.
    """
    if len(reference) == len(estimate) == 1:
        estimate = dict(zip(reference, estimate.values(), strict=True))
    rows = {
        robot: associated(reference[robot], estimate[robot], tolerance_s=tolerance_s)
        for robot in reference
        if robot in estimate
    }
    found = [robot for robot, (there, _) in rows.items() if len(there)]
    if not found:
        sources = [next(iter(team.values())).source for team in (reference, estimate)]
        rule = f"poses of one robot within {tolerance_s:g} s of each other"
        raise BadInputError(f"{sources[1]}: expected {rule} here and in {sources[0]}, got none")
    return Compared(
        np.concatenate([estimate[robot].poses[rows[robot][1]] for robot in found]),
        np.concatenate([reference[robot].poses[rows[robot][0]] for robot in found]),
        np.repeat(found, [len(rows[robot][0]) for robot in found]),
        tuple(sorted(set(reference) - set(found))),
    )


def run(
    reference: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="REFERENCE")],
    estimates: Annotated[tyro.conf.Positional[tuple[Path, ...]], tyro.conf.arg(metavar="ESTIMATE...")],
    *,
    align: bool = False,
    scale: bool = False,
    tolerance: float = TOLERANCE_S,
    delta: int = 1,
    out: Path | None = None,
) -> None:
    """Compare trajectories of a team with the true ones: ATE and RPE of each robot and of all.

    Reads TUM and KITTI trajectories (one file a robot: 0.txt, 1.txt, ... in a folder), g2o, the truth of a
    JRL data set, JRR results and folders that wifipgo optimise wrote. Poses belong together that are
    each other's nearest in time, within the tolerance; KITTI has no times, so line k belongs to line k.
    Figures are RMSE, Eqs. 12 and 13 of the paper mean squares. Exit code 1 says that a robot of the
    reference is missing, 2 that the input was bad.

    Example: wifipgo ate truth/ results/team --align

    Example: wifipgo ate truth/ first/ second/ --align --out ate.json

    Example: wifipgo ate truth/ estimate/0.txt estimate/1.txt

    Args:
        reference: The truth: a file or a folder.
        estimates: Teams to compare with it; files of single trajectories with different robots' numbers as
            names are one team.
        align: Move each estimate, all robots together, to where it fits best (Umeyama).
        scale: Let its scale fit too; needs --align.
        tolerance: Of time stamps, s.
        delta: Poses over which relative errors are taken.
        out: A JSON file for the figures.
    """
    require(len(estimates) > 0, "ESTIMATE", "at least one", "none")
    require(0.0 <= tolerance < np.inf, "tolerance", "finite and not negative, in s", tolerance)
    require(align or not scale, "scale", "given with --align only", scale)
    truth, alignment = read_team(reference), ("similar" if scale else "rigid") if align else "none"
    found: dict[str, TeamAccuracy] = {}
    missing: dict[str, tuple[int, ...]] = {}
    for name, team in _teams(estimates).items():
        pairs = compared(truth, team, tolerance_s=tolerance)
        rows = (pairs.estimate, pairs.reference, pairs.robot)
        found[name] = team_accuracy(*rows, alignment=alignment, delta=delta)
        missing |= {name: pairs.missing} if pairs.missing else {}
        Terminal().print(accuracy_table(name, found[name], alignment))
    if out is not None:
        estimates_json = {name: accuracy.as_json() for name, accuracy in found.items()}
        table = {"alignment": alignment, "delta": delta, "estimates": estimates_json}
        write_json(out, table, allow_nan=True)
        say(f"results: {out}")
    if missing:
        told = "; ".join(f"{name}: {', '.join(map(str, robots))}" for name, robots in missing.items())
        raise DoubtfulError(f"robots of the reference that have no pose here: {told}")


def _teams(paths: Sequence[Path]) -> Mapping[str, Team]:
    """Teams by name; files of different robots are one."""
    robots = [robot_of(path) if path.is_file() else None for path in paths]
    if len(paths) > 1 and None not in robots and len(set(robots)) == len(robots):
        parts = [read_team(path) for path in paths]
        name = f"{paths[0]} ... {paths[-1].name}"
        return {name: {robot: line for part in parts for robot, line in part.items()}}
    return {str(path): read_team(path) for path in paths}


def accuracy_table(name: str, accuracy: TeamAccuracy, alignment: str) -> Table:
    """One line a robot and one for all."""
    how = "not aligned" if alignment == "none" else f"aligned as one team, {alignment}"
    table = Table(title=f"{printable(name)}\nRMSE, {how}")
    for column in ("robot", *COLUMNS):
        table.add_column(column, justify="right", no_wrap=True)
    for robot, one in accuracy.robots.items():
        table.add_row(str(robot), *_cells(one), end_section=robot == max(accuracy.robots))
    table.add_row("team", *_cells(accuracy.team))
    return table


def _cells(one: Accuracy) -> list[str]:
    """Texts of a line; a dash for what there is none of."""
    values = (
        one.ate_m,
        np.rad2deg(one.ate_rad),
        one.rpe_m,
        np.rad2deg(one.rpe_rad),
        one.ate_trans,
        one.ate_rot,
    )
    return [str(one.poses), *("-" if np.isnan(value) else f"{value:.4g}" for value in values)]


def main(args: Sequence[str] | None = None) -> int:
    """Run from the command line; the exit code is that of `wifipgo.command.command_line`."""
    return exit_code(lambda: tyro.cli(documented(run), prog="wifipgo ate", args=args))


if __name__ == "__main__":
    sys.exit(main())
