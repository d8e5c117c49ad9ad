"""Fig. 9: in the light and in the dark, active rendezvous against one that needs to see."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from baselines.evaluation.episodes import Episode
from baselines.evaluation.intervals import Estimate
from baselines.evaluation.jobs import Task
from baselines.reproduce import _draw, _rules
from baselines.reproduce._claims import BESIDE, HEADLINE, Claim, Found, Sentence, judged, row
from baselines.reproduce._measures import err_ratio
from baselines.reproduce._runs import TRIALS, Run, Setting, changed, tasks_of, write_data

__all__ = ["SENTENCES", "TITLE", "TRIALS", "claims", "make", "tasks"]

TITLE = "2 robots in the light and in the dark: active against vision-based rendezvous"
DARK = Sentence("fig9.dark", "Active rendezvous is independent of visual conditions.", "Sec. 7.2.2, Fig. 9")
GAIN = Sentence("fig9.gain", "Active rendezvous keeps the error low in extreme low light.", "Fig. 9 (b)")
BLIND = Sentence("fig9.vision", "Vision-based rendezvous fails in the dark.", "Fig. 9 (caption)")
SENTENCES = (DARK, GAIN, BLIND)
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
    played = _played(setting)
    write_data(folder, {f"{where}, {label}": e for where, of in played.items() for label, e in of.items()})
    _draw_lights(folder / "fig9.png", played, setting)
    return _judged(played)


def claims(setting: Setting) -> list[Claim]:
    """Judge only."""
    return _judged(_played(setting))


def _played(setting: Setting) -> Played:
    return {
        where: {label: run.episodes(setting) for label, run in policies.items()}
        for where, policies in runs().items()
    }


def _judged(played: Played) -> list[Claim]:
    return [_dark_as_light(played), _gain(played), _blind(played)]


def _draw_lights(path: Path, played: Played, setting: Setting) -> None:
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
                _draw.threshold_line(axes, setting.of(changed(ROOMS[room])).rendezvous.err_threshold)
                _draw.err_axes(axes, left=left)
        _draw.from_zero(figure)
        _draw.key(figure)


def _relative(dark: Sequence[Episode], light: Sequence[Episode]) -> Estimate:
    """By which part the error in the dark is more than in the light."""
    found = err_ratio(dark, light)
    return Estimate(*(None if end is None else end - 1.0 for end in (found.value, found.low, found.high)))


def _same(dark: list[Episode], light: list[Episode]) -> str:
    """Whether the robots drove the same way, to the bit."""
    equal = all(
        np.array_equal(one.reference, other.reference) for one, other in zip(dark, light, strict=True)
    )
    return "every trajectory is the same to the bit" if equal and dark else ""


def _not_judged(found: Found) -> Found:
    """A row beside a claim that is so by construction."""
    return replace(found, verdict=_rules.UNJUDGED)


def _dark_as_light(played: Played) -> Claim:
    def compared(room: str, label: str, role: str) -> Found:
        dark, light = (played[f"{room}, {way}"][label] for way in ("dark", "light"))
        return row(f"{room}, {label}", _relative, dark, light, role=role, note=_same(dark, light))

    return judged(
        DARK,
        quantity="Err of the last ten iterations, in the dark over in the light, less 1",
        rule=_rules.by_construction(0.0, "no policy but vision reads the camera, so nothing can differ"),
        found=[
            *(compared(room, "active", HEADLINE) for room in ROOMS),
            *(_not_judged(compared(room, "vision", BESIDE)) for room in ROOMS),
        ],
    )


def _gain(played: Played) -> Claim:
    found = [
        row(
            f"{where}; {label}",
            err_ratio,
            of[label],
            of["active"],
            role=HEADLINE if label == "random" and where.endswith("dark") else BESIDE,
        )
        for where, of in played.items()
        for label in ("random", "random, every step")
    ]
    return judged(
        GAIN,
        quantity="Err of the last ten iterations, other over active",
        unit="x",
        rule=_rules.at_least(6.0, 1.0, "x"),
        found=found,
    )


def _blind(played: Played) -> Claim:
    found = [
        row(where, err_ratio, of["vision"], of["random"], role=HEADLINE if where.endswith("dark") else BESIDE)
        for where, of in played.items()
    ]
    return judged(
        BLIND,
        quantity="Err of the last ten iterations, vision-based over random",
        unit="x",
        rule=_rules.by_construction(1.0, "a policy that sees nobody walks as random does"),
        found=[one if one.role == HEADLINE else _not_judged(one) for one in found],
    )
