"""Fig. 9: in the light and in the dark, active rendezvous against one that needs to see."""

from pathlib import Path

import numpy as np

from baselines.evaluation.episodes import Episode
from baselines.evaluation.jobs import Task
from baselines.evaluation.statistics import Estimate, bootstrap, ratio_of_means
from baselines.reproduce import _draw, _rules
from baselines.reproduce._claims import BESIDE, HEADLINE, Claim, Found, judged
from baselines.reproduce._measures import column, err_ratio
from baselines.reproduce._runs import Run, Setting, changed, tasks_of, write_data

TITLE = "2 robots in the light and in the dark: active against vision-based rendezvous"
ROOMS = {"without obstacles": "paper-hw-2", "four obstacles": "paper-hw-2-obstacles"}
LIGHTS = {"light": "", "dark": "-dark"}

Played = dict[str, dict[str, list[Episode]]]


def runs() -> dict[str, dict[str, Run]]:
    """Every policy in every room and light, by ``room, light``."""
    return {
        f"{room}, {light}": _policies(ROOMS[room] + ending)
        for room in ROOMS
        for light, ending in LIGHTS.items()
    }


def _policies(name: str) -> dict[str, Run]:
    found = {policy: Run(changed(name), policy) for policy in ("active", "random", "vision")}
    return found | {"random, every step": Run(changed(name, estimator="every_step"), "random")}


def tasks(setting: Setting) -> list[Task]:
    """All episodes."""
    return tasks_of([run for policies in runs().values() for run in policies.values()], setting)


def make(setting: Setting, folder: Path) -> list[Claim]:
    """Draw, write the data, judge."""
    played = {
        where: {label: run.episodes(setting) for label, run in policies.items()}
        for where, policies in runs().items()
    }
    write_data(folder, {f"{where}, {label}": e for where, of in played.items() for label, e in of.items()})
    _draw_lights(folder / "fig9.png", played)
    return [_dark_as_light(played), _gain(played), _blind(played)]


def _draw_lights(path: Path, played: Played) -> None:
    """A row for each light: trial 0 of active with its calls shaded, then all trials of every policy."""
    room = next(iter(ROOMS))
    with _draw.page(path, (9.6, 5.6)) as figure:
        grid = figure.subplots(len(LIGHTS), 2, squeeze=False, sharex=True, sharey="col")
        for row, light in zip(grid, LIGHTS, strict=True):
            of = played[f"{room}, {light}"]
            one, every = row
            _draw.shaded_calls(one, of["active"][0])
            _draw.meetings(one, of["active"][0])
            _draw.robots(one, of["active"][0], _draw.LOOKS["active"][0])
            one.set_title(f"{light}: active, trial 0", loc="left")
            for label, episodes in of.items():
                _draw.err_curve(every, episodes, label)
            every.set_title(f"{light}: {len(of['active'])} trials", loc="left")
            for axes, left in ((one, True), (every, False)):
                _draw.threshold_line(axes, changed(ROOMS[room]).rendezvous.err_threshold)
                _draw.err_axes(axes, left=left)
                axes.legend(loc="upper left", fontsize=7)
        _draw.from_zero(figure)


def _relative(dark: list[Episode], light: list[Episode]) -> Estimate:
    """By which part the error in the dark is more than in the light."""
    found = bootstrap((column(dark, "err_last10"), column(light, "err_last10")), ratio_of_means)
    return Estimate(*(None if end is None else end - 1.0 for end in (found.value, found.low, found.high)))


def _same(dark: list[Episode], light: list[Episode]) -> str:
    """Whether the robots drove the same way, to the bit."""
    equal = all(
        np.array_equal(one.reference, other.reference) for one, other in zip(dark, light, strict=True)
    )
    return "every trajectory is the same to the bit" if equal else ""


def _dark_as_light(played: Played) -> Claim:
    found = [
        Found(
            conditions=f"{room}, {label}",
            estimate=_relative(played[f"{room}, dark"][label], played[f"{room}, light"][label]),
            n=len(played[f"{room}, dark"][label]),
            role=HEADLINE if label == "active" else BESIDE,
            note=_same(played[f"{room}, dark"][label], played[f"{room}, light"][label]),
        )
        for label in ("active", "vision")
        for room in ROOMS
        if label in played[f"{room}, dark"]
    ]
    return judged(
        "fig9.dark",
        "Active rendezvous is independent of visual conditions.",
        source="Sec. 7.2.2, Fig. 9",
        quantity="Err of the last ten iterations, in the dark over in the light, less 1",
        rule=_rules.within(0.1),
        goal="within 10 %",
        found=found,
    )


def _gain(played: Played) -> Claim:
    found = [
        Found(
            conditions=f"{where}; {label}",
            estimate=err_ratio(of[label], of["active"]),
            n=len(of["active"]),
            role=HEADLINE if label == "random" and where.endswith("dark") else BESIDE,
        )
        for where, of in played.items()
        for label in ("random", "random, every step")
        if label in of
    ]
    return judged(
        "fig9.gain",
        "Active rendezvous keeps the error low in extreme low light.",
        source="Fig. 9 (b)",
        quantity="Err of the last ten iterations, other over active",
        unit="x",
        rule=_rules.at_least(6.0, 1.0, "x"),
        found=found,
    )


def _blind(played: Played) -> Claim:
    found = [
        Found(
            conditions=where,
            estimate=err_ratio(of["vision"], of["random"]),
            n=len(of["vision"]),
            role=HEADLINE if where.endswith("dark") else BESIDE,
        )
        for where, of in played.items()
    ]
    return judged(
        "fig9.vision",
        "Vision-based rendezvous fails in the dark.",
        source="Fig. 9 (caption)",
        quantity="Err of the last ten iterations, vision-based over random",
        unit="x",
        rule=_rules.no_better(),
        goal="no better than random in the dark",
        found=found,
    )
