"""Scores of trainings side by side: from the folders of runs, or from a file of those that are gone."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from baselines.policies.learned.network import load_network
from baselines.policies.learned.run_files import POLICY
from train._checkpoints import Checkpoints
from train._config import TrainConfig
from train._config_files import read_yaml
from train._learning_curve import COLUMNS as CURVE_COLUMNS
from wifipgo.errors import require
from wifipgo.files.atomic_files import appearing
from wifipgo.files.parquet_files import read_parquet

# One row for each evaluation of a policy in a scenario; `trials` and `seed` say which worlds these were.
COLUMNS = ("recipe", "run", "policy", "agent_steps", "scenario", "trials", "seed", "mapped_share")


def curves_of(texts: Sequence[str]) -> tuple[pd.DataFrame, tuple[str, ...]]:
    """Scores of all runs, with the columns `COLUMNS`: means over the worlds of a scenario.

    A run that began with the network of another goes on where that one was.

    Args:
        texts: NAME=FOLDER of a run, NAME=FOLDER+FOLDER of several seeds, or a FILE.parquet of `save_scores`.

    Returns:
        The scores, and the scenarios that all runs were judged on, in the order of the first.

    Raises:
        ValueError: A run was judged on other worlds than the first; a file that holds no such scores.
        OSError: A folder without a curve.
    """
    parts = [part for text in texts for part in _parts(text)]
    wanted = _worlds(parts[0])
    for part in parts:
        rule = f"of the worlds of the first run, (trials, seed) {wanted}"
        require(_worlds(part) == wanted, f"selection of {part['run'].iloc[0]}", rule, _worlds(part))
    played = [tuple(dict.fromkeys(part["scenario"])) for part in parts]
    shared = tuple(name for name in played[0] if all(name in each for each in played))
    require(bool(shared), "runs", "judged on scenarios in common", played)
    scores = pd.concat(parts, ignore_index=True)
    return scores[scores["scenario"].isin(shared)], shared


def save_scores(scores: pd.DataFrame, path: Path) -> None:
    """Keep scores when the folders of their runs go."""
    with appearing(path) as unfinished:
        scores.to_parquet(unfinished, index=False)


def _parts(text: str) -> list[pd.DataFrame]:
    """Scores of each run that a text names."""
    name, named, folders = text.partition("=")
    if named:
        return [_scores(Path(folder)).assign(recipe=name) for folder in folders.split("+")]
    kept = read_parquet(Path(text), COLUMNS)
    require(len(kept) > 0, text, "of one score or more", "none")
    return [part for _, part in kept.groupby(["recipe", "run"], sort=False)]


def _scores(folder: Path) -> pd.DataFrame:
    """Of one run."""
    config, table = read_yaml(folder / "config.yaml"), read_parquet(folder / "curve.parquet", CURVE_COLUMNS)
    played, before = played_of(config), played_before(folder) if config.start else 0
    judged = config.selection
    n_worlds, there = len(played) * judged.trials, int(table["trial"].max()) + 1
    rule = f"<= {n_worlds}, as its config.yaml says"
    require(there <= n_worlds, f"{folder / 'curve.parquet'}: number of trials", rule, there)
    table = table.assign(scenario=[played[trial // judged.trials] for trial in table["trial"]])
    keys = ["policy", "agent_steps", "scenario"]
    means = table.groupby(keys, sort=False)["mapped_share"].mean().reset_index()
    return means.assign(
        agent_steps=means["agent_steps"] + before, run=str(folder), trials=judged.trials, seed=judged.seed
    )


def _worlds(part: pd.DataFrame) -> tuple[int, int]:
    """How many, and of which root."""
    return int(part["trials"].iloc[0]), int(part["seed"].iloc[0])


def played_before(folder: Path) -> int:
    """Agent-steps of the trainings whose network a run began with."""
    origin, steps = load_network(Checkpoints(folder).path() / POLICY).origin.get("begun_with"), 0
    while origin:
        steps += origin["agent_steps"] + origin["imitated"]
        origin = origin.get("begun_with")
    return steps


def played_of(config: TrainConfig) -> tuple[str, ...]:
    """Scenarios that checkpoints are judged on."""
    return config.selection.scenarios or (config.envs.scenario,)
