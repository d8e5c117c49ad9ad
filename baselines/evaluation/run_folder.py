"""Results on disk: finished episodes are kept as they come, the rest appears whole or not at all.

An evaluation into ``out`` works in ``out.partial`` beside it, which holds a ``config.json``, one file
for each finished episode and, at the end, the results, which are then renamed to ``out``. Pictures
are drawn after that, from the tables and from ``median-trial/``, the whole episodes of one trial.
"""

import shutil
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from baselines.evaluation.episodes import Episode
from baselines.evaluation.jobs import FAILURES
from baselines.evaluation.plan import differences, read_record, refuse_differing
from baselines.evaluation.statistics import Summary
from wifipgo.errors import BadInputError
from wifipgo.files import results_folder
from wifipgo.files.atomic_files import write_json
from wifipgo.files.parquet_files import read_parquet

PICTURES = ("score.png", "err.png", "arena.png")
MEDIAN = "median-trial"
FILES = ("episodes.parquet", "steps.parquet", "summary.json", "config.json")
KIND = "evaluate"
_NOT_PLAYED = ("command", "reference")  # in a record, and no matter to episodes


class Tables(NamedTuple):
    """Results in rows, policy by policy in the order of the plan, then trial by trial."""

    episodes: pd.DataFrame
    steps: pd.DataFrame


def is_complete(out: Path) -> bool:
    """Whether a folder holds an evaluation; its pictures are drawn last and may be missing."""
    return all((out / name).is_file() for name in FILES)


def clear_away(out: Path, record: Mapping[str, Any]) -> None:
    """Remove what a run left that ended after its results had their name."""
    partial = results_folder.partial_of(out)
    if results_folder.is_of(partial, KIND):
        saved = partial / "config.json"
        if not saved.exists() or not list(_differing(saved, record)):
            results_folder.remove(partial, KIND)


def claim(
    out: Path, record: Mapping[str, Any], names: Sequence[str], *, overwrite: bool, resume: bool
) -> Path:
    """Make the working folder, or take up that of an interrupted run.

    Args:
        out: Folder of the results.
        record: What decides them.
        names: Files of the episodes that will be in the working folder.
        overwrite: Whether results and interrupted runs may go.
        resume: Whether to take up an interrupted run.

    Raises:
        BadInputError: There are results or an interrupted run, and no leave to replace or continue
            them, or files that no evaluation wrote.
        OSError: The folder cannot be made.
    """
    partial = results_folder.partial_of(out)
    results_folder.check_free(out, KIND, overwrite=overwrite)
    if partial.exists() and not resume:
        n_done = len(list(partial.glob("*.npz")))
        if not overwrite:
            kept = f"{partial} holds {n_done} episodes of an interrupted run"
            raise BadInputError(f"{kept}: --resume continues it, --overwrite starts over")
        results_folder.remove(partial, KIND)
    if partial.exists():
        _same(partial, record)
    results_folder.begin(partial, KIND)
    results_folder.note(partial, ["config.json", FAILURES, "results/", *names])
    write_json(partial / "config.json", record)
    return partial


def trials_there(out: Path, record: Mapping[str, Any], *, overwrite: bool) -> int:
    """How many trials a finished evaluation holds; 0 if an interrupted run is to replace it.

    Raises:
        BadInputError: They are of other settings, or there are more than the record asks for.
    """
    if not is_complete(out) or (overwrite and (results_folder.partial_of(out) / "config.json").exists()):
        return 0
    saved = out / "config.json"
    there = int(read_record(saved)["trials"])
    fewer = {"trials": min(there, record["trials"])}
    refuse_other(saved, {**record, **fewer}, "the results there are of other settings")
    return there


def _same(partial: Path, record: Mapping[str, Any]) -> None:
    """Refuse to mix two evaluations."""
    saved = partial / "config.json"
    if saved.exists():
        fewer = {"trials": min(read_record(saved)["trials"], record["trials"])}  # more trials are new files
        refuse_other(saved, {**record, **fewer}, "to continue an evaluation, its settings must stay")


def refuse_other(saved: Path, record: Mapping[str, Any], rule: str) -> None:
    """Raise unless a saved record is this one; names the fields that differ."""
    refuse_differing(_differing(saved, record), f"{rule}: {saved}")


def _differing(saved: Path, record: Mapping[str, Any]) -> Iterable[tuple[str, Any, Any]]:
    there, here = ({k: v for k, v in r.items() if k not in _NOT_PLAYED} for r in (read_record(saved), record))
    return differences(there, here)


def episode_path(partial: Path, policy: int, trial: int) -> Path:
    """File of one finished episode; the policy by its place in the list."""
    return partial / f"{policy:02d}-{trial:05d}.npz"


def episodes_frame(episodes: Sequence[Episode]) -> pd.DataFrame:
    """One row for each policy and trial."""
    return pd.DataFrame(
        [{"policy": e.policy, "trial": e.trial, "seed": e.seed, **e.figures} for e in episodes]
    )


def steps_frame(episodes: Sequence[Episode]) -> pd.DataFrame:
    """One row for each policy, trial, iteration (from 1) and robot."""
    shapes = [episode.steps["err"].shape for episode in episodes]
    sizes = [n_steps * n_robots for n_steps, n_robots in shapes]
    iteration, robot = np.concatenate([np.indices(shape).reshape(2, -1) for shape in shapes], axis=1)
    keys = {
        "policy": np.repeat(np.array([episode.policy for episode in episodes], dtype=object), sizes),
        "trial": np.repeat([episode.trial for episode in episodes], sizes),
        "iteration": iteration + 1,
        "robot": robot,
    }
    columns = {
        name: np.concatenate([episode.steps[name].ravel() for episode in episodes])
        for name in episodes[0].steps
    }
    return pd.DataFrame(keys | columns)


def tables_of(episodes: Sequence[Episode]) -> Tables:
    """Rows of episodes that are in order."""
    return Tables(episodes_frame(episodes), steps_frame(episodes))


def read_tables(folder: Path) -> Tables:
    """Rows of finished results."""
    return Tables(*(read_parquet(folder / f"{name}.parquet") for name in Tables._fields))


def joined(parts: Sequence[Tables], policies: Sequence[str]) -> Tables:
    """Rows of parts whose trials follow each other, as one run has them."""
    return Tables(*(_in_order(frames, policies) for frames in zip(*parts, strict=True)))


def _in_order(frames: Sequence[pd.DataFrame], policies: Sequence[str]) -> pd.DataFrame:
    whole = pd.concat(frames, ignore_index=True)
    return pd.concat([whole[whole["policy"] == policy] for policy in policies], ignore_index=True)


def compare_anew(out: Path, summary: Summary, record: Mapping[str, Any]) -> None:
    """Rewrite what finished results say of a comparison, if another is asked for now."""
    if read_record(out / "config.json").get("reference", "") != record.get("reference", ""):
        write_json(out / "summary.json", asdict(summary))
        write_json(out / "config.json", record)


def write_tables(folder: Path, tables: Tables, summary: Summary, record: Mapping[str, Any]) -> None:
    """Write all but the pictures."""
    for name, table in tables._asdict().items():
        table.to_parquet(folder / f"{name}.parquet", index=False)
    write_json(folder / "summary.json", asdict(summary))
    write_json(folder / "config.json", record)


def keep_episodes(staging: Path, names: Iterable[str], folders: Sequence[Path]) -> None:
    """Keep whole episodes that are in one of some folders; those that are in none are missing."""
    (staging / MEDIAN).mkdir()
    for name in names:
        there = [folder / name for folder in folders if (folder / name).is_file()]
        if there:
            shutil.copyfile(there[0], staging / MEDIAN / name)


def later(names: Iterable[str]) -> list[str]:
    """Files that appear after the results: pictures, and the episodes that these show."""
    return [*PICTURES, *(f"{MEDIAN}/{name}" for name in names)]


def clean_staging(partial: Path) -> Path:
    """Empty folder for results that are not complete yet."""
    return results_folder.emptied(partial / "results")
