"""Fig. 7: one trial of random and active rendezvous in every room, with each rendezvous marked."""

from collections.abc import Sequence
from functools import partial
from itertools import product
from pathlib import Path

from baselines.evaluation.episodes import Episode
from baselines.evaluation.intervals import difference
from baselines.reproduce import _draw, _rules
from baselines.reproduce._claims import (
    HEADLINE,
    NO_EPISODES,
    SENSITIVITY,
    Claim,
    Found,
    Sentence,
    judged,
    missing,
    row,
)
from baselines.reproduce._measures import column, err_ratio
from baselines.reproduce._runs import TRIALS, Setting, write_data
from baselines.reproduce._sensitivity import sensitivity, sensitivity_runs
from baselines.reproduce._two_robots import CHANGED, PAIRS, ROOMS, Played, changes, played, tasks

__all__ = ["SENTENCES", "TITLE", "TRIALS", "claims", "make", "tasks"]

TITLE = "2 robots, one trial: Err and every rendezvous"
RATIO = Sentence(
    "fig7.ratio",
    "Active rendezvous reduces the error by 6X against random rendezvous, in different environments and "
    "with heterogeneous sensor noise.",
    "Abstract, Fig. 7",
)
COUNT_ACTIVE = Sentence(
    "fig7.count_active",
    "The number of rendezvous of active rendezvous is independent of obstacles.",
    "Sec. 7.2.2, Fig. 7 (c), (d)",
)
COUNT_RANDOM = Sentence(
    "fig7.count_random",
    "Obstacles affect the number of rendezvous of robots that walk at random.",
    "Sec. 7.2.2, Fig. 7 (c), (d)",
)
SENTENCES = (RATIO, COUNT_ACTIVE, COUNT_RANDOM)


def make(setting: Setting, folder: Path) -> list[Claim]:
    """Draw, write the data, judge."""
    rooms = played(setting)
    write_data(folder, {f"{room}, {label}": e for room, of in rooms.items() for label, e in of.items()})
    _draw_trial(folder / "fig7.png", rooms, setting)
    return _judged(rooms, setting)


def claims(setting: Setting) -> list[Claim]:
    """Judge only."""
    return _judged(played(setting), setting)


def _judged(rooms: Played, setting: Setting) -> list[Claim]:
    return [_ratio(rooms, setting), *_counts(rooms, setting)]


def _draw_trial(path: Path, rooms: Played, setting: Setting) -> None:
    """Trial 0: a column for each room, a row for each policy."""
    labels = [label for label in ("active", "random", "random, every step") if label in rooms[CHANGED[0]]]
    with _draw.page(path, (9.6, 2.3 * len(labels))) as figure:
        grid = figure.subplots(len(labels), len(rooms), squeeze=False, sharex=True, sharey="col")
        for (row, label), (place, room) in product(enumerate(labels), enumerate(rooms)):
            axes, episode = grid[row, place], rooms[room][label][0]
            _draw.meetings(axes, episode)
            _draw.robots(axes, episode, _draw.LOOKS[label][0], label)
            _draw.threshold_line(axes, setting.of(ROOMS[room]).rendezvous.err_threshold)
            _draw.err_axes(axes, left=place == 0)
            n = len(episode.meetings)
            axes.set_title(("" if row else f"{room}\n") + f"{label}: {n} rendezvous", fontsize=9)
        _draw.from_zero(figure)
        _draw.key(figure)
        figure.suptitle(f"trial 0, seed {rooms[CHANGED[0]]['active'][0].seed}", fontsize=10)


def _ratio(rooms: Played, setting: Setting) -> Claim:
    found = [
        row(room + words, err_ratio, of[other], of[reference], role=role)
        for reference, other, role, words in PAIRS
        for room, of in rooms.items()
    ]
    for room in ROOMS:
        found += sensitivity(changes(room), setting, lambda a, r: err_ratio(r, a), prefix=f"{room}: ")
    return judged(
        RATIO,
        quantity="Err (Eq. 4) of the last ten iterations, random over active",
        unit="x",
        rule=_rules.at_least(6.0, 1.0, "x"),
        goal="at least 5x with and without obstacles",
        found=found,
    )


def _counts(rooms: Played, setting: Setting) -> list[Claim]:
    """Whether obstacles change how often robots meet: not the active ones, but those that walk at random."""
    of = {
        "active": (COUNT_ACTIVE, _rules.INDEPENDENT),
        "random": (COUNT_RANDOM, _rules.AFFECTED),
    }
    return [
        judged(
            sentence,
            quantity="mean number of rendezvous with four obstacles less that without",
            rule=_rules.Rule(text, lambda _: _rules.UNDECIDED),  # each row has a test of its own
            found=_compared_everywhere(rooms, setting, policy),
        )
        for policy, (sentence, text) in of.items()
    ]


def _compared_everywhere(rooms: Played, setting: Setting, policy: str) -> list[Found]:
    """Counts of one policy, and again with every number of ours changed."""
    compared = partial(_compared, affected=policy == "random")
    without, boxes = (rooms[room][policy] for room in CHANGED)
    found = [compared(without, boxes, HEADLINE, "paper-hw-2 and paper-hw-2-obstacles")]
    if not setting.sensitivity:
        return found
    bare, full = (sensitivity_runs(ROOMS[room]) for room in CHANGED)
    for label, pairs in bare.items():
        chosen = [pair[policy == "random"].episodes(setting) for pair in (pairs, full[label])]
        found.append(compared(chosen[0], chosen[1], SENSITIVITY, label))
    return found


def _compared(
    without: Sequence[Episode], boxes: Sequence[Episode], role: str, label: str, *, affected: bool
) -> Found:
    """Counts with and without obstacles, and whether a test calls them equal."""
    if not without or not boxes:
        return missing(label, NO_EPISODES, role)
    one, other = column(boxes, "rendezvous"), column(without, "rendezvous")
    margin, estimate = _rules.SAME_COUNT * float(other.mean()), difference(one, other)
    p = _rules.equivalence_p(one, other, margin)
    note = f"{other.mean():.2f} without, {one.mean():.2f} with; margin {margin:.2f}, p of equivalence {p:.2g}"
    verdict = _rules.judged_counts(estimate, p, affected=affected)
    return Found(conditions=label, estimate=estimate, n=len(one), role=role, note=note, verdict=verdict)
