"""What figures are made of: a policy in a scenario on every seed, each episode run once for all figures."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from hashlib import sha256
from pathlib import Path

import pandas as pd

from baselines.evaluation.episodes import Episode, trial_seed
from baselines.evaluation.jobs import Task
from baselines.evaluation.run_folder import episodes_frame, steps_frame
from wifipgo.scenarios import Scenario, scenario_named

MANY_ROBOTS = 10
TRIALS, TRIALS_MANY = 60, 10  # unless asked for otherwise: with two robots, with fifty


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """What all figures of a run share.

    Attributes:
        trials: Seeds of every figure; 0: 60 with two robots, 10 with fifty.
        seed: Root of all seeds.
        cache: Folder of finished episodes.
    """

    trials: int
    seed: int
    cache: Path

    def trials_of(self, scenario: Scenario) -> int:
        """Seeds for a scenario."""
        return self.trials or (TRIALS if scenario.n_robots < MANY_ROBOTS else TRIALS_MANY)


@dataclass(frozen=True, slots=True)
class Run:
    """One policy in one scenario."""

    scenario: Scenario
    policy: str

    @property
    def key(self) -> str:
        """The same for two runs exactly if they give the same results."""
        values = {k: v for k, v in asdict(self.scenario).items() if k not in ("name", "source")}
        text = json.dumps([values, self.policy], sort_keys=True)
        return sha256(text.encode()).hexdigest()[:16]

    def tasks(self, setting: Setting) -> list[Task]:
        """Its episodes."""
        trials = range(setting.trials_of(self.scenario))
        return [
            Task(self.scenario, self.policy, k, trial_seed(setting.seed, k), self._path(setting, k))
            for k in trials
        ]

    def episodes(self, setting: Setting) -> list[Episode]:
        """Its finished episodes, trial by trial."""
        return [Episode.load(task.path) for task in self.tasks(setting)]

    def _path(self, setting: Setting, trial: int) -> Path:
        return setting.cache / f"{self.key}-{trial:05d}.npz"


def tasks_of(runs: Sequence[Run], setting: Setting) -> list[Task]:
    """Episodes of some runs, each once."""
    return list({task.path: task for run in runs for task in run.tasks(setting)}.values())


def changed(scenario: str | Scenario, **overrides: object) -> Scenario:
    """A scenario with other values."""
    found = scenario_named(scenario) if isinstance(scenario, str) else scenario
    return found.with_overrides(**overrides) if overrides else found


def write_data(folder: Path, runs: dict[str, list[Episode]]) -> None:
    """Write ``episodes.parquet`` and ``steps.parquet``, the run named in the first column."""
    for name, frame in (("episodes", episodes_frame), ("steps", steps_frame)):
        parts = [frame(episodes).assign(run=run) for run, episodes in runs.items() if episodes]
        whole = pd.concat(parts, ignore_index=True)
        whole = whole[["run", *(column for column in whole if column != "run")]]
        whole.to_parquet(folder / f"{name}.parquet", index=False)
