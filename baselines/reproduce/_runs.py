"""What figures are made of: a policy in a scenario on every seed, each episode run once for all figures."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from baselines.evaluation.episodes import Episode, trial_seed
from baselines.evaluation.jobs import Task
from baselines.evaluation.run_folder import episodes_frame, steps_frame
from wifipgo.errors import BadInputError
from wifipgo.scenarios import Scenario, scenario_named

MANY_ROBOTS = 10
ROOTS, TRIALS, TRIALS_MANY = 8, 60, 10  # unless asked for otherwise; worlds of a root with two robots, fifty


class World(NamedTuple):
    """A world of the pool: its number, and the seed of all that happens by chance in it."""

    number: int
    seed: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """What all figures of a run share.

    Attributes:
        trials: Worlds of each root; 0: 60 with two robots, 10 with fifty.
        seed: First root.
        roots: How many roots follow each other; the worlds of all are one pool.
        cache: Folder of finished episodes.
        changes: Other values for fields of every scenario.
        data: Folder of data that do not come with the package, if not that of $WIFIPGO_DATA.
        sensitivity: Whether numbers of ours are changed one at a time, too.
    """

    trials: int
    seed: int
    cache: Path
    roots: int = 1
    changes: Mapping[str, object] = field(default_factory=dict)
    sensitivity: bool = True
    data: Path | None = None

    def worlds(self, n_robots: int = 2) -> list[World]:
        """The pool, root after root."""
        n = self.trials or (TRIALS if n_robots < MANY_ROBOTS else TRIALS_MANY)
        return [
            World((root - self.seed) * n + k, trial_seed(root, k)) for root in self.numbers for k in range(n)
        ]

    @property
    def numbers(self) -> range:
        """Numbers of the roots."""
        return range(self.seed, self.seed + self.roots)

    def of(self, scenario: Scenario) -> Scenario:
        """A scenario as it is changed here; as it was if it refuses that."""
        return self.changed(scenario) or scenario

    def changed(self, scenario: Scenario) -> Scenario | None:
        """A scenario as it is changed here; none if it refuses that."""
        try:
            return scenario.with_overrides(**self.changes)
        except BadInputError:
            return None


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
        """Its episodes; none if its scenario refuses what is changed."""
        scenario = setting.changed(self.scenario)
        if scenario is None:
            return []
        key = Run(scenario, self.policy).key
        return [
            Task(scenario, self.policy, k, seed, setting.cache / f"{key}-{k:05d}.npz")
            for k, seed in setting.worlds(scenario.n_robots)
        ]

    def episodes(self, setting: Setting) -> list[Episode]:
        """Its finished episodes, world by world."""
        return [Episode.load(task.path) for task in self.tasks(setting)]


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
