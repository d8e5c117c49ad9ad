"""The episodes of two robots that Figs. 7 and 8 share."""

from baselines.evaluation.episodes import Episode
from baselines.evaluation.jobs import Task
from baselines.reproduce._claims import BESIDE, HEADLINE
from baselines.reproduce._runs import Run, Setting, changed, tasks_of
from baselines.reproduce._sensitivity import Pair, all_runs, reading_runs, sensitivity_runs

ROOMS = {
    "without obstacles": changed("paper-hw-2"),
    "four obstacles": changed("paper-hw-2-obstacles"),
    "heterogeneous noise": changed("paper-hw-2-hetero"),
}
CHANGED = ("without obstacles", "four obstacles")  # rooms in which our numbers are changed
# What is compared: reference, other, role, and how to call it.
PAIRS = (
    ("active", "random", HEADLINE, ""),
    ("active", "random, every step", BESIDE, "; random optimises at every step"),
    ("active, every step", "random, every step", BESIDE, "; both optimise at every step"),
    ("oracle bearing", "random", BESIDE, "; bearings of an oracle in place of the radio's"),
)

Played = dict[str, dict[str, list[Episode]]]


def runs() -> dict[str, dict[str, Run]]:
    """Every room, and every policy in it."""
    return {room: _policies(room) for room in ROOMS}


def changes(room: str) -> dict[str, Pair]:
    """Active and random under changes; where noise is unequal, under other readings of the text only."""
    return (sensitivity_runs if room in CHANGED else reading_runs)(ROOMS[room])


def _policies(room: str) -> dict[str, Run]:
    found = {policy: Run(ROOMS[room], policy) for policy in ("active", "random")}
    found["oracle bearing"] = Run(ROOMS[room], "oracle_bearing")
    every = changed(ROOMS[room], estimator="every_step")
    return found | {f"{policy}, every step": Run(every, policy) for policy in ("random", "active")}


def tasks(setting: Setting) -> list[Task]:
    """All episodes, those of the sensitivity included."""
    main = [run for room in runs().values() for run in room.values()]
    rooms = ROOMS if setting.sensitivity else ()
    more = [run for room in rooms for run in all_runs(changes(room))]
    return tasks_of([*main, *more], setting)


def played(setting: Setting) -> Played:
    """Every finished episode, by room and policy."""
    return {
        room: {label: run.episodes(setting) for label, run in policies.items()}
        for room, policies in runs().items()
    }
