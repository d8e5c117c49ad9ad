"""Fig. 8: all trials of random and active rendezvous, and the robots one by one; ground truth beside it."""

from itertools import product
from pathlib import Path

from wifipgo.command.figures import Axes

import numpy as np

from baselines.evaluation.episodes import Episode
from baselines.reproduce import _draw, _rules
from baselines.reproduce._claims import BESIDE, Claim, Sentence, judged, row
from baselines.reproduce._held import Active, held
from baselines.reproduce._measures import truth_reduction
from baselines.reproduce._runs import TRIALS, Setting, write_data
from baselines.reproduce._sensitivity import sensitivity
from baselines.reproduce._two_robots import CHANGED, PAIRS, ROOMS, Played, changes, played, tasks

__all__ = ["SENTENCES", "TITLE", "TRIALS", "claims", "make", "tasks"]

TITLE = "2 robots, all trials: Err, each robot's, and ground truth"
HELD = Sentence(
    "fig8.held",
    "Active rendezvous maintains the error threshold in environments with and without obstacles.",
    "Fig. 8",
)
WITHIN = Sentence(
    "fig8.within", "The same robot by robot: nearly always at or below the threshold.", "Fig. 8"
)
TRUTH = Sentence(
    "fig8.truth",
    "Active rendezvous reduces the ground-truth pose error by 64 % against random rendezvous.",
    "Abstract of the later version (arXiv 1907.05538v3)",
)
SENTENCES = (HELD, WITHIN, TRUTH)


def make(setting: Setting, folder: Path) -> list[Claim]:
    """Draw, write the data, judge."""
    rooms = played(setting)
    write_data(folder, {f"{room}, {label}": e for room, of in rooms.items() for label, e in of.items()})
    _draw_all(folder / "fig8.png", rooms, setting)
    return _judged(rooms, setting)


def claims(setting: Setting) -> list[Claim]:
    """Judge only."""
    return _judged(played(setting), setting)


def _judged(rooms: Played, setting: Setting) -> list[Claim]:
    active = {
        room: Active(rooms[room]["active"], setting.of(ROOMS[room]).rendezvous.err_threshold)
        for room in CHANGED
    }
    return [*held(HELD, WITHIN, active), _truth(rooms, setting)]


def _draw_all(path: Path, rooms: Played, setting: Setting) -> None:
    """A column for each room: mean Err with bands, then the mean of each robot."""
    with _draw.page(path, (9.6, 5.6)) as figure:
        grid = figure.subplots(2, len(rooms), squeeze=False, sharex=True)
        for (row, panel), (place, room) in product(enumerate((_team, _each)), enumerate(rooms)):
            axes = grid[row, place]
            panel(axes, rooms[room])
            _draw.threshold_line(axes, setting.of(ROOMS[room]).rendezvous.err_threshold)
            _draw.err_axes(axes, left=place == 0)
        _draw.from_zero(figure)
        for axes, room in zip(grid[0], rooms, strict=True):
            axes.set_title(f"{room}, {len(rooms[room]['active'])} trials", fontsize=9)
        figure.suptitle("mean over trials, its 95 % interval; every panel has a scale of its own", fontsize=9)
        for axes, what in zip(grid[:, 0], ("mean of the robots", "each robot"), strict=True):
            axes.set_ylabel(f"Err (Eq. 4)\n{what}")
        _draw.key(figure)


def _team(axes: Axes, of: dict[str, list[Episode]]) -> None:
    for label, episodes in of.items():
        if label in _draw.LOOKS:
            _draw.err_curve(axes, episodes, label)


def _each(axes: Axes, of: dict[str, list[Episode]]) -> None:
    """Mean over trials of each robot's Err."""
    for label in ("active", "random"):
        errs = np.mean([episode.steps["err"] for episode in of[label]], axis=0)
        for robot, err in enumerate(errs.T):
            style = ("-", "--")[robot % 2]
            iteration = np.arange(1, len(err) + 1)
            axes.plot(iteration, err, color=_draw.LOOKS[label][0], ls=style, label=f"{label}, robot {robot}")


def _truth(rooms: Played, setting: Setting) -> Claim:
    found = [
        row(room + words, truth_reduction, of[reference], of[other], role=role)
        for reference, other, role, words in (*PAIRS, ("random, every step", "random", BESIDE, _STRONG))
        for room, of in rooms.items()
    ]
    for room in ROOMS:
        found += sensitivity(changes(room), setting, truth_reduction, prefix=f"{room}: ")
    return judged(
        TRUTH,
        quantity="ground-truth error at the end (Eq. 12 + Eq. 13), reduction of the mean",
        unit=" %",
        rule=_rules.at_least(64.0, 0.0, " %"),
        goal="at least 64 % in all three",
        found=found,
    )


_STRONG = "; random that optimises at every step against random that does not"
