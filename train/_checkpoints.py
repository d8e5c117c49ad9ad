"""Checkpoints: whole or not at all, only for what they were trained on, and numbers only.

A checkpoint is a folder ``step-N``: ``training.npz`` (all that a continued run needs, the learning curve
included), ``policy.npz`` (what a robot needs) and ``state.json`` with the digests of both. ``last.json`` and
``best.json`` beside it say which. A save that is interrupted leaves a folder that nobody points to, and the
last good one stays. Nothing in it is a program: see docs/security.md.
"""

import json
import os
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from baselines.evaluation.plan import differences
from baselines.policies.learned.interfaces import names_read
from baselines.policies.learned.network import (
    Network,
    layout_of,
    load_network,
    plain,
    refuse_other_layout,
)
from baselines.policies.learned.run_files import CHECKPOINTS, POLICY, STEP, pointed_to
from wifipgo.errors import BadInputError, require
from wifipgo.files.atomic_files import appearing, write_json
from wifipgo.files.npz_files import read_npz
from wifipgo.files.results_folder import note
from wifipgo.files.text_files import read_json
from wifipgo.scenarios import Scenario

TRAINING, STATE = "training.npz", "state.json"
_FILES = (TRAINING, POLICY, STATE)


@dataclass(frozen=True, slots=True, kw_only=True)
class State:
    """Where a run stands.

    Attributes:
        agent_steps: Played by PPO.
        imitated: Played before, while a scripted policy was imitated.
        updates: Updates of PPO.
        score: Mean mapped share on the worlds of the selection.
    """

    agent_steps: int = 0
    imitated: int = 0
    updates: int = 0
    score: float = -1.0


class Checkpoints:
    """Checkpoints of one run.

    Args:
        out: Folder of the run.
    """

    def __init__(self, out: Path) -> None:
        """Nothing is written yet."""
        self.folder = out / CHECKPOINTS

    def save(
        self, arrays: Mapping[str, np.ndarray], network: Network, state: State, *, best: bool = False
    ) -> Path:
        """Write a checkpoint, then point to it, then remove those that nobody needs."""
        name = f"step-{state.imitated + state.agent_steps:09d}"
        unfinished = self.folder / f"{name}.partial"
        pointers = ("last", "best") if best else ("last",)
        names = (f"{unfinished.name}/", f"{name}/", *(f"{pointer}.json" for pointer in pointers))
        note(self.folder.parent, [f"checkpoints/{name}" for name in names])
        shutil.rmtree(unfinished, ignore_errors=True)
        unfinished.mkdir(parents=True)
        with appearing(unfinished / TRAINING) as path, path.open("wb") as file:
            np.savez(file, allow_pickle=False, **arrays)
        network.save(unfinished / POLICY)
        notes: dict[str, Any] = {field: getattr(state, field) for field in State.__slots__}
        notes["sha256"] = {name: _digest(unfinished / name) for name in (TRAINING, POLICY)}
        write_json(unfinished / STATE, notes | {"seal": _digest_of(notes)})
        final = self.folder / name
        shutil.rmtree(final, ignore_errors=True)
        os.replace(unfinished, final)
        for pointer in pointers:
            self.point(pointer, final)
        self._tidy()
        return final

    def point(self, which: str, folder: Path) -> None:
        """Let ``last.json`` or ``best.json`` name a checkpoint."""
        write_json(self.folder / f"{which}.json", {"checkpoint": folder.name})

    def path(self, which: str = "last") -> Path:
        """Folder of the last or the best checkpoint.

        Raises:
            BadInputError: There is none, the pointer is damaged or leads elsewhere, or a file is missing.
        """
        folder = pointed_to(self.folder / f"{which}.json")
        _check_files(folder)
        return folder

    def intact(self, which: str = "last") -> Path:
        """The same, its digests compared.

        Raises:
            BadInputError: See `path`; or a file was changed since.
        """
        folder = self.path(which)
        _check_digests(folder)
        return folder

    def latest_intact(self) -> tuple[Path, str]:
        """The last checkpoint, or the latest one before it that is whole; and what is wrong with the last.

        Raises:
            BadInputError: The pointer is damaged, or no checkpoint is whole.
        """
        last = self.path()
        try:
            return self.intact(), ""
        except BadInputError as problem:
            for folder in sorted(self.folder.glob("step-*"), reverse=True):
                if STEP.fullmatch(folder.name) and folder.name < last.name and _is_intact(folder):
                    return folder, str(problem)
            raise

    def check(self, folder: Path, scenario: Scenario) -> None:
        """Refuse to continue a run on another scenario.

        Raises:
            BadInputError: The layout or the scenario is another; names what differs.
        """
        network = load_network(folder / POLICY)
        blocks = dict([*network.layout, *layout_of(scenario)])  # training shows all that there is now
        reads = names_read(network.interface, list(blocks), scenario)
        refuse_other_layout(network, scenario, str(folder), reads=reads)
        refuse_other_scenario(network.scenario, plain(scenario), str(folder))

    def mend_best(self, folder: Path) -> float:
        """Let ``best.json`` name the better of the best checkpoint and this one; the score of that.

        A run that was killed between its two pointers has a better last one; a damaged best one is none.
        """
        best, score = folder, read_state(folder).score
        if (self.folder / "best.json").exists():
            try:
                there = self.intact("best")
            except BadInputError:
                there = folder
            if read_state(there).score >= score:
                best, score = there, read_state(there).score
        self.point("best", best)
        return score

    def _tidy(self) -> None:
        """Keep what is pointed to, and the one before the last, in case that is damaged."""
        whole = sorted((p for p in self.folder.glob("step-*") if STEP.fullmatch(p.name)), reverse=True)
        kept = {
            self.path(which).name for which in ("last", "best") if (self.folder / f"{which}.json").is_file()
        }
        kept |= {folder.name for folder in [p for p in whole if p.name < self.path().name][:1]}
        for folder in self.folder.glob("step-*"):
            if folder.name not in kept:
                shutil.rmtree(folder, ignore_errors=True)


def read_training(folder: Path) -> dict[str, np.ndarray]:
    """Arrays of a checkpoint, by name."""
    return read_npz(folder / TRAINING, max_bytes=1 << 32)


def read_state(folder: Path) -> State:
    """Where the run stood.

    Raises:
        BadInputError: The file does not say so.
    """
    path = folder / STATE
    notes = _notes(path)
    for name in ("agent_steps", "imitated", "updates"):
        require(
            type(notes.get(name)) is int and notes[name] >= 0,
            f"{path}: {name}",
            "an int >= 0",
            notes.get(name),
        )
    score = notes.get("score")
    require(type(score) is float and -1.0 <= score <= 1.0, f"{path}: score", "a share", score)
    return State(**{name: notes[name] for name in State.__slots__})


def _notes(path: Path) -> dict[str, Any]:
    """Content of a ``state.json``."""
    notes = read_json(path)
    require(isinstance(notes, dict), str(path), "a table", notes)
    return dict(notes)


def _check_files(folder: Path) -> None:
    """Raise unless a folder beside the pointers holds the files of a checkpoint, and no links."""
    require(not folder.is_symlink(), str(folder), "a folder, not a link", "a link")
    old = folder / "vecnormalize.pkl"
    rule = (
        "absent: a pickle is a program, so checkpoints with one are not continued; train anew (--overwrite)"
    )
    require(not old.exists(), str(old), rule, "it there")
    for name in _FILES:
        path = folder / name
        whole = path.is_file() and not path.is_symlink()
        require(whole, str(path), "there: a checkpoint without it cannot be continued or run", "nothing")


def _check_digests(folder: Path) -> None:
    """Raise unless the files are those that were written."""
    _check_files(folder)
    read_state(folder)
    notes = _notes(folder / STATE)
    seal = notes.pop("seal", None)
    noted: Any = notes.get("sha256")
    whole = isinstance(noted, dict) and seal == _digest_of(notes)
    require(whole, str(folder / STATE), "as it was written: it was damaged or changed since", "other content")
    for name in (TRAINING, POLICY):
        rule = "as it was written: it was damaged or changed since, its digest is another than in state.json"
        if noted.get(name) != _digest(folder / name):
            raise BadInputError(f"{folder / name} must be {rule}, got another")


def _is_intact(folder: Path) -> bool:
    """Whether `_check_digests` has nothing to say."""
    try:
        _check_digests(folder)
    except BadInputError:
        return False
    return True


def _digest(path: Path) -> str:
    """SHA-256 of a file."""
    return sha256(path.read_bytes()).hexdigest()


def _digest_of(notes: Mapping[str, Any]) -> str:
    """SHA-256 of plain values."""
    return sha256(json.dumps(notes, sort_keys=True).encode()).hexdigest()


def refuse_other_scenario(saved: Mapping[str, Any], now: Mapping[str, Any], where: str) -> None:
    """Raise unless a checkpoint's scenario is this one.

    Raises:
        BadInputError: Names the fields that differ.
    """
    ignored = {"name", "source"}
    rows = [row for row in differences(saved, now) if row[0] not in ignored]
    fields = "; ".join(f"{name} ({old!r} there, {new!r} now)" for name, old, new in rows[:3])
    if rows:
        raise BadInputError(f"{where} is a checkpoint of another scenario, {saved.get('name')!r}: {fields}")
