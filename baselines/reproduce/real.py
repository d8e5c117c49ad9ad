"""The paper's two ideas on a recorded team: meeting to optimise, and directions against outliers.

The run is one of UTIAS MRCLAM. Where it is not there, nothing is run, and the rows say so.
"""

import json
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from baselines.evaluation.episodes import trial_seed
from baselines.evaluation.intervals import Estimate, ratio, reduction
from baselines.reproduce import _draw_real, _folder, _rules
from baselines.reproduce._claim_sections import claim_section, summary
from baselines.reproduce._claims import BESIDE, HEADLINE, Claim, Found, Sentence, judged, missing
from baselines.reproduce._recordings import ABSENT
from baselines.reproduce._runs import Setting
from baselines.reproduce._tables import about
from baselines.reproduce.real_outliers import TREATMENTS, WIFI, Draws
from baselines.reproduce.real_windows import N_WINDOWS, SOLVED, TOLD, Window, data_folder, run_in
from wifipgo.files.text_files import read_json

__all__ = ["TITLE", "TRIALS", "claims", "make", "page", "tasks"]

TITLE = "Real odometry, real sightings, real errors of bearings"
TRIALS = 5  # draws of each root in each window
SIGHTINGS = Sentence(
    "real.bearings",
    "Bearings alone cut the position error of dead reckoning (Eq. 12) by 75 %.",
    "goal of this project, on UTIAS MRCLAM",
)
ENCOUNTERS = Sentence(
    "real.encounters",
    "Robots that tell what they know when they see each other, and optimise then, end as well as those that "
    "share everything at every step.",
    "Secs. 5 and 6, on UTIAS MRCLAM",
)
REDUCTION = Sentence(
    "real.reduction",
    "AOA weighting of outliers (Eq. 11) cuts the ground-truth error by 32 %, on real odometry.",
    "Abstract, Sec. 7.3, on UTIAS MRCLAM",
)
FACTORS = Sentence(
    "real.factors",
    "AOA information cuts it by 32 % as bearings of their own (our method), on real odometry.",
    "Abstract, on UTIAS MRCLAM",
)
SENTENCES = (SIGHTINGS, ENCOUNTERS, REDUCTION, FACTORS)
NO_RUN = "no run of MRCLAM: docs/datasets.md says what it is; --data or WIFIPGO_DATA where it lies"
ENDS = ("at the end", "as believed when new")
GOAL, CLAIMED, SAME = 75.0, 32.0, 1.25  # per cent, per cent, ratio
CALLED = {
    "in_sight": ("AOA errors of recordings in sight", HEADLINE),
    "beyond": ("AOA errors of recordings beyond sight", HEADLINE),
    "camera": ("the robots' own cameras", BESIDE),
    **{
        name: (f"Wi-Fi-like, correlated, median {median:g} deg, {100 * beyond:.0f} % beyond 20 deg", BESIDE)
        for name, (median, beyond) in WIFI.items()
    },
}

_INTRODUCTION = f"""\
Five small robots with wheels and cameras, recorded with motion capture (UTIAS MRCLAM,
[recorded teams](datasets.md)). The run is cut into {N_WINDOWS} windows that share no step; each is one world
and begins at the true poses, and intervals are over windows. What was drawn by chance is first averaged over
the draws of a window. Verdicts are by the rules of [the claims](claims.md).

- **Sightings**: directions, distances, or both, as robust factors beside odometry, all at once. Over the
  whole run, in which drift has time to grow, there is one world and so no verdict: its figure is in the note.
- **Encounters**: robots that see each other tell all that they know and optimise it; against everybody who
  tells everything at every step. "As believed when new" scores each pose by what its robot thought when it
  was its last.
- **Outliers**: as in the paper, nine relative poses of two robots, the truth with noise of 0.2 m and 5 deg,
  three of them with 2 to 3 sigma of it in every component; but odometry, and where and when robots see each
  other, are real. Directions are those of the cameras, or the truth with errors of CSI recordings, or with
  errors like those of robots that hear access points: Student's t with the median and tails named, of which
  neighbours a second apart, cut off at 30 deg, correlate by 0.3 to 0.5. *Equal information matrices* is the
  literal reading of `fig10_literal`."""
_READING = """\
The noise of odometry and sightings is fitted to the truth of the whole run: it is what the maker of such
robots knows, not what a robot finds out. Cameras see half a radian to each side, so directions vary less
than those of an antenna that hears all round. Windows of one run have the same robots and room: intervals are
over times, not over robots."""


def tasks(setting: Setting) -> list[Window | Draws]:
    """All windows, the whole run, and the draws in every window; none without data."""
    folder = data_folder(setting.data)
    return [] if folder is None else [*_windows(folder, setting), *_draws(folder, setting)]


def _windows(folder: Path, setting: Setting) -> list[Window]:
    """The whole run, which takes longest, then all windows."""
    name = _named(folder)
    return [
        Window(folder, k, setting.cache / f"real-{name}-{'whole' if k is None else k}.npz")
        for k in (None, *range(N_WINDOWS))
    ]


def _draws(folder: Path, setting: Setting) -> list[Draws]:
    """Draws of every window."""
    n, name = setting.trials or TRIALS, _named(folder)
    seeds = tuple(trial_seed(root, k) for root in setting.numbers for k in range(n))
    return [
        Draws(folder, k, seeds, setting.cache / f"real-outliers-{name}-{k}-{len(seeds)}.npz")
        for k in range(N_WINDOWS)
    ]


def _named(folder: Path) -> str:
    """The run by its name and the sizes of its files: another one has another name in the cache."""
    sizes = sorted((path.name, path.stat().st_size) for path in folder.glob("*.dat"))
    return f"{folder.resolve().name}-{sha256(json.dumps(sizes).encode()).hexdigest()[:8]}"


def make(setting: Setting, folder: Path) -> list[Claim]:
    """Draw, write the data, judge."""
    data = data_folder(setting.data)
    if data is not None:
        errors, draws, whole = _errors(data, setting), _outliers(data, setting), _whole(data, setting)
        errors.to_parquet(folder / "windows.parquet", index=False)
        draws.to_parquet(folder / "draws.parquet", index=False)
        _draw_real.draw(folder / "real.png", run_in(data), errors, _by_window(draws), whole)
    return claims(setting)


def claims(setting: Setting) -> list[Claim]:
    """Judge only."""
    data = data_folder(setting.data)
    if data is None:
        return [_judged(sentence, [missing("a run of MRCLAM", NO_RUN)]) for sentence in SENTENCES]
    errors, draws = _errors(data, setting), _outliers(data, setting)
    by_window, each = _by_window(draws), int(draws.groupby("window").size().max()) if len(draws) else 0
    return [
        _judged(SIGHTINGS, _of_sightings(errors, _whole(data, setting))),
        _judged(ENCOUNTERS, _of_encounters(errors)),
        _judged(REDUCTION, _of_outliers("eq11", by_window, each)),
        _judged(FACTORS, _of_outliers("factors", by_window, each)),
    ]


def page(folder: Path, run: Mapping[str, Any], picture: str) -> str:
    """The page to read.

    Args:
        folder: Of `make`.
        run: Where the numbers come from.
        picture: Where the picture is.
    """
    found = read_json(folder / _folder.CLAIMS)["claims"]
    shown = [f"![{TITLE}]({picture})"] if (folder / "real.png").is_file() else []
    parts = ["# The paper's ideas on real robots", _INTRODUCTION, *shown, about(run)]
    parts += [summary({"real": {"claims": found}}), *map(claim_section, found), _READING]
    return "\n\n".join(parts) + "\n"


def _judged(sentence: Sentence, found: list[Found]) -> Claim:
    """Judge one sentence by its rule."""
    if sentence is ENCOUNTERS:
        rule, what, unit = _rules.at_most(SAME), "Eq. 12 at the end, at encounters over at every step", ""
    elif sentence is SIGHTINGS:
        rule, unit = _rules.at_least(GOAL, 0.0, " %"), " %"
        what = "Eq. 12, reduction against dead reckoning from true starts"
    else:
        rule, unit = _rules.at_least(CLAIMED, 0.0, " %"), " %"
        what = "ground-truth error (Eq. 12 + Eq. 13), reduction against no method"
    return judged(sentence, quantity=what, unit=unit, rule=rule, found=found)


def _errors(data: Path, setting: Setting) -> pd.DataFrame:
    """One row for each window in which robots have a truth."""
    rows = [
        {
            "window": task.number,
            **dict(zip(("dead reckoning", *SOLVED), found["errors"].tolist(), strict=True)),
            **{
                f"{name}, {when}": found["online"][i, j]
                for i, name in enumerate(TOLD)
                for j, when in enumerate(ENDS)
            },
        }
        for task in _windows(data, setting)[1:]
        for found in (task.load(),)
    ]
    return pd.DataFrame(rows).dropna().reset_index(drop=True)


def _whole(data: Path, setting: Setting) -> dict[str, float]:
    """Errors over the whole run."""
    found = _windows(data, setting)[0].load()["errors"]
    return dict(zip(("dead reckoning", *SOLVED), found.tolist(), strict=True))


def _outliers(data: Path, setting: Setting) -> pd.DataFrame:
    """One row for each window and draw."""
    parts = [
        pd.DataFrame(task.load()["errors"], columns=list(TREATMENTS)).assign(window=task.number)
        for task in _draws(data, setting)
    ]
    return pd.concat(parts, ignore_index=True)


def _by_window(draws: pd.DataFrame) -> pd.DataFrame:
    """Mean over the draws of each window: what happened in one window is one world."""
    return draws.groupby("window").mean()


def _of_sightings(errors: pd.DataFrame, whole: dict[str, float]) -> list[Found]:
    """Every use of sightings in windows, and over the whole run."""
    found = []
    for name in SOLVED:
        kept = whole[name] / whole["dead reckoning"]
        note = f"whole run, one world: {100.0 * (1.0 - kept):.1f} %, {whole[name]:.2f} m2"
        gain = reduction(errors[name].to_numpy(float), errors["dead reckoning"].to_numpy(float))
        role = HEADLINE if name == "bearings, huber" else BESIDE
        where = f"{N_WINDOWS} windows, {name}"
        found.append(Found(conditions=where, estimate=gain, n=len(errors), role=role, note=note))
    return found


def _of_encounters(errors: pd.DataFrame) -> list[Found]:
    """At encounters against at every step, at the end and on the way."""
    found = []
    for when in ENDS:
        met, all_told = (errors[f"{name}, {when}"].to_numpy(float) for name in TOLD)
        bare = errors["dead reckoning"].mean()
        note = f"m2: dead reckoning {bare:.3f}, encounters {met.mean():.3f}, every step {all_told.mean():.3f}"
        role = HEADLINE if when == ENDS[0] else BESIDE
        estimate = ratio(met, all_told)
        found.append(
            Found(conditions=f"bearings, {when}", estimate=estimate, n=len(met), role=role, note=note)
        )
    return found


def _of_outliers(method: str, by_window: pd.DataFrame, each: int) -> list[Found]:
    """A method under bearings of every source, and by equal information matrices."""
    found = []
    for alike in ("", "alike_") if method == "eq11" else ("",):
        for source, (called, role) in CALLED.items():
            column = f"{alike}{method}_{source}"
            where = f"{called}, equal information matrices" if alike else called
            part = BESIDE if alike else role
            if by_window[column].isna().any() or not len(by_window):
                found.append(missing(where, ABSENT, part))
            else:
                bare = by_window[f"{alike}nothing"].to_numpy(float)
                most = _share(by_window[f"{alike}removed"].to_numpy(float), bare)
                found.append(
                    Found(
                        conditions=f"3 outliers of 9, {where}",
                        estimate=reduction(by_window[column].to_numpy(float), bare),
                        n=len(by_window),
                        role=part,
                        note=f"{each} draws a window; true outliers removed: {most:.1f} %",
                        verdict=_rules.NO_POWER if most < CLAIMED else "",
                    )
                )
    return found


def _share(after: np.ndarray, before: np.ndarray) -> float:
    """Reduction of the mean, per cent."""
    found: Estimate = reduction(after, before)
    return found.value or 0.0
