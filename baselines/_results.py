"""Results on disk: finished episodes are kept as they come, the rest appears whole or not at all.

An evaluation into ``out`` works in ``out.partial`` beside it, which holds a ``config.json``, one file
for each finished episode and, at the end, the results, which are then renamed to ``out``.
"""

import os
import shutil
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from baselines._episodes import Episode
from baselines._plan import differences, read_record
from baselines._statistics import Summary
from wifipgo.errors import BadInputError, require
from wifipgo.whole_files import write_json

PICTURES = ("err.png", "arena.png")
FILES = ("episodes.parquet", "steps.parquet", "summary.json", "config.json", *PICTURES)


def partial_of(out: Path) -> Path:
    """Folder beside ``out`` in which an evaluation works."""
    return out.with_name(f"{out.name}.partial")


def is_complete(out: Path) -> bool:
    """Whether a folder holds an evaluation."""
    return all((out / name).is_file() for name in FILES)


def claim(out: Path, record: Mapping[str, Any], *, overwrite: bool, resume: bool) -> Path:
    """Make the working folder, or take up that of an interrupted run.

    Raises:
        ValueError: There are results or an interrupted run, and no leave to replace or continue them.
        OSError: The folder cannot be made.
    """
    partial = partial_of(out)
    _may_replace(out, overwrite=overwrite)
    if partial.exists() and not resume:
        n_done = len(list(partial.glob("*.npz")))
        if not overwrite:
            kept = f"{partial} holds {n_done} episodes of an interrupted run"
            raise BadInputError(f"{kept}: --resume continues it, --overwrite starts over")
        _remove(partial)
    if partial.exists():
        _same(partial, record)
    partial.mkdir(parents=True, exist_ok=True)
    write_json(partial / "config.json", record)
    return partial


def _may_replace(out: Path, *, overwrite: bool) -> None:
    """Refuse to replace what is there, and ever to replace what is not an evaluation."""
    if not out.exists():
        return
    require(out.is_dir(), "out", "a folder", str(out))
    found = {path.name for path in out.iterdir()}
    if found:
        require(overwrite, "out", "new or empty (--overwrite replaces what is there)", str(out))
        others = sorted(found - set(FILES))
        require(not others, "out", f"an evaluation to be replaced, but it also holds {others[:3]}", str(out))


def _same(partial: Path, record: Mapping[str, Any]) -> None:
    """Refuse to mix two evaluations."""
    saved = partial / "config.json"
    if saved.exists():
        refuse_other(saved, record, "to continue an evaluation, its settings must stay")


def refuse_other(saved: Path, record: Mapping[str, Any], rule: str) -> None:
    """Raise unless a saved record is this one; names the fields that differ."""
    there, here = ({k: v for k, v in r.items() if k != "command"} for r in (read_record(saved), record))
    differing = list(differences(there, here))
    if differing:
        fields = "; ".join(f"{name} ({old!r} there, {new!r} now)" for name, old, new in differing[:3])
        raise BadInputError(f"{rule}: {saved} differs in {fields}")


def _remove(partial: Path) -> None:
    """Remove an interrupted run, and nothing else."""
    require((partial / "config.json").is_file(), "out", "clear of a folder that is not ours", str(partial))
    shutil.rmtree(partial)


def episode_path(partial: Path, policy: int, trial: int) -> Path:
    """File of one finished episode; the policy by its place in the list."""
    return partial / f"{policy:02d}-{trial:05d}.npz"


def is_done(path: Path) -> bool:
    """Whether an episode was finished and its file is sound."""
    return zipfile.is_zipfile(path)


def episodes_frame(episodes: Sequence[Episode]) -> pd.DataFrame:
    """One row for each policy and trial."""
    return pd.DataFrame(
        [{"policy": e.policy, "trial": e.trial, "seed": e.seed, **e.figures} for e in episodes]
    )


def steps_frame(episodes: Sequence[Episode]) -> pd.DataFrame:
    """One row for each policy, trial, iteration (from 1) and robot."""
    return pd.concat([_steps(episode) for episode in episodes], ignore_index=True)


def _steps(episode: Episode) -> pd.DataFrame:
    n_steps, n_robots = episode.steps["err"].shape
    iteration, robot = np.indices((n_steps, n_robots)).reshape(2, -1)
    keys = {"policy": episode.policy, "trial": episode.trial, "iteration": iteration + 1, "robot": robot}
    return pd.DataFrame(keys | {name: column.ravel() for name, column in episode.steps.items()})


def write_tables(
    folder: Path, episodes: Sequence[Episode], summary: Summary, record: Mapping[str, Any]
) -> None:
    """Write all but the pictures."""
    episodes_frame(episodes).to_parquet(folder / "episodes.parquet", index=False)
    steps_frame(episodes).to_parquet(folder / "steps.parquet", index=False)
    write_json(folder / "summary.json", asdict(summary))
    write_json(folder / "config.json", record)


def clean_staging(partial: Path) -> Path:
    """Empty folder for results that are not complete yet."""
    staging = partial / "results"
    shutil.rmtree(staging, ignore_errors=True)
    staging.mkdir()
    return staging


def publish(staging: Path, out: Path) -> None:
    """Rename complete results to ``out``; what was there goes only then, and the working folder last."""
    if out.exists():
        os.replace(out, staging.with_name("replaced"))
    os.replace(staging, out)
    shutil.rmtree(partial_of(out))
