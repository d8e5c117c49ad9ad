"""Checkpoints: whole or not at all, and only for what they were trained on.

A checkpoint is a folder of its own; ``last.json`` and ``best.json`` say which. A save that is interrupted
leaves a folder that nobody points to, and the last good one stays.
"""

import json
import os
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

from baselines._network import Network, load_network, plain, refuse_other_layout
from baselines._plan import differences
from wifipgo.errors import BadInputError, require
from wifipgo.scenarios import Scenario
from wifipgo.whole_files import write_json

_FILES = ("model.zip", "vecnormalize.pkl", "policy.npz", "state.json")


@dataclass(frozen=True, slots=True, kw_only=True)
class State:
    """Where a run stands.

    Attributes:
        agent_steps: Played by PPO.
        imitated: Played before, while a scripted policy was imitated.
        updates: Updates of PPO.
    """

    agent_steps: int = 0
    imitated: int = 0
    updates: int = 0


class Checkpoints:
    """Checkpoints of one run.

    Args:
        out: Folder of the run.
    """

    def __init__(self, out: Path) -> None:
        """Nothing is written yet."""
        self.folder = out / "checkpoints"

    def save(
        self, model: PPO, norm: VecNormalize, network: Network, state: State, *, best: bool = False
    ) -> Path:
        """Write a checkpoint, then point to it, then remove those that nobody points to."""
        name = f"step-{state.imitated + state.agent_steps:09d}"
        unfinished = self.folder / f"{name}.partial"
        shutil.rmtree(unfinished, ignore_errors=True)
        unfinished.mkdir(parents=True)
        model.save(unfinished / "model.zip")
        norm.save(str(unfinished / "vecnormalize.pkl"))
        network.save(unfinished / "policy.npz")
        notes = {field: getattr(state, field) for field in State.__slots__}
        write_json(unfinished / "state.json", notes)
        final = self.folder / name
        shutil.rmtree(final, ignore_errors=True)
        os.replace(unfinished, final)
        for pointer in ("last", "best") if best else ("last",):
            write_json(self.folder / f"{pointer}.json", {"checkpoint": name})
        self._tidy()
        return final

    def path(self, which: str = "last") -> Path:
        """Folder of the last or the best checkpoint.

        Raises:
            ValueError: There is none, or a file of it is missing; the message names it.
        """
        pointer = self.folder / f"{which}.json"
        require(pointer.is_file(), str(pointer), f"there: no {which} checkpoint was saved", "nothing")
        folder = self.folder / str(json.loads(pointer.read_text(encoding="utf-8"))["checkpoint"])
        for name in _FILES:
            rule = "there: a checkpoint without it cannot be continued or run"
            require((folder / name).is_file(), str(folder / name), rule, "nothing")
        return folder

    def statistics(self, venv: VecEnv) -> VecNormalize:
        """Environments with the last checkpoint's statistics."""
        return VecNormalize.load(str(self.path() / "vecnormalize.pkl"), venv)

    def restore(self, model: PPO) -> State:
        """Put the last checkpoint's weights and optimiser in place, and say where it stood."""
        folder = self.path()
        model.set_parameters(str(folder / "model.zip"), device="cpu")
        return State(**json.loads((folder / "state.json").read_text(encoding="utf-8")))

    def check(self, scenario: Scenario) -> None:
        """Refuse to continue a run on another scenario.

        Raises:
            ValueError: The layout or the scenario is another; names what differs.
        """
        folder = self.path()
        network = load_network(folder / "policy.npz")
        refuse_other_layout(network, scenario, str(folder))
        refuse_other_scenario(network.scenario, plain(scenario), str(folder))

    def _tidy(self) -> None:
        kept = {self.path(which).name for which in ("last", "best") if self._points(which)}
        for folder in self.folder.glob("step-*"):
            if folder.name not in kept:
                shutil.rmtree(folder, ignore_errors=True)

    def _points(self, which: str) -> bool:
        return (self.folder / f"{which}.json").is_file()


def refuse_other_scenario(saved: Mapping[str, Any], now: Mapping[str, Any], where: str) -> None:
    """Raise unless a checkpoint's scenario is this one.

    Raises:
        ValueError: Names the fields that differ.
    """
    ignored = {"name", "source"}
    rows = [row for row in differences(saved, now) if row[0] not in ignored]
    fields = "; ".join(f"{name} ({old!r} there, {new!r} now)" for name, old, new in rows[:3])
    if rows:
        raise BadInputError(f"{where} is a checkpoint of another scenario, {saved.get('name')!r}: {fields}")
