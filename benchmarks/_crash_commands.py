"""Small runs of the commands that leave results, for `benchmarks.crash_trials`."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

Left = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Command:
    """A command, and what of its results counts.

    Attributes:
        name: Of the command.
        module: Where its ``main`` is.
        arguments: Of a small run, given a folder for its input.
        left: What a finished run leaves, by name.
        agrees: Whether what a disturbed run left is as good as what an undisturbed one did.
        precious: Files of an unfinished run that its continuation reads.
        take_up: Option that takes up a disturbed run.
        nothing_there: What the refusal says where the run had not left anything to take up.
    """

    name: str
    module: str
    arguments: Callable[[Path], list[str]]
    left: Callable[[Path], Left]
    agrees: Callable[[Left, Left], bool]
    precious: Callable[[Path], list[Path]]
    take_up: str
    nothing_there: str


def _same(there: Left, here: Left) -> bool:
    return there == here


def _evaluation(folder: Path) -> list[str]:
    what = ["--policies", "random,active", "--trials", "4", "--set", "n_steps=3"]
    return [*what, "--executor", "serial"]


def _tables(out: Path) -> Left:
    return {name: (out / name).read_bytes() for name in ("episodes.parquet", "steps.parquet", "summary.json")}


def _episodes(out: Path) -> list[Path]:
    return sorted(out.with_name(f"{out.name}.partial").glob("*.npz"))


def _optimisation(folder: Path) -> list[str]:
    """Two robots on a ring each, with four loop closures between them."""
    path = folder / "team.g2o"
    if not path.exists():
        path.write_text(_two_rings(40), encoding="ascii")
    return [str(path)]


def _two_rings(n: int) -> str:
    rng, lines, turn = np.random.default_rng(0), [], 2.0 * np.pi / n
    for first in (0, n):
        lines += [
            f"VERTEX_SE2 {first + k} {np.cos(turn * k):.6f} {np.sin(turn * k):.6f} {turn * k:.6f}"
            for k in range(n)
        ]
    pairs = [(first + k, first + k + 1, turn) for first in (0, n) for k in range(n - 1)]
    pairs += [(k, n + k, 0.0) for k in range(0, n, n // 4)]
    for tail, head, angle in pairs:
        x, y, w = np.array([np.sin(angle), 1.0 - np.cos(angle), angle]) + rng.normal(0.0, 0.02, 3)
        lines.append(f"EDGE_SE2 {tail} {head} {x:.6f} {y:.6f} {w:.6f} 100 0 0 100 0 100")
    return "\n".join(lines) + "\n"


def _graphs(out: Path) -> Left:
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    report.pop("seconds", None)
    files = [path for path in sorted(out.rglob("*")) if path.suffix in {".g2o", ".txt"}]
    return {str(path.relative_to(out)): path.read_bytes() for path in files} | {"report": str(report)}


def _training(folder: Path) -> list[str]:
    path = folder / "tiny.yaml"
    path.write_text(
        "envs: {scenario: paper-sim-2, n_envs: 2, overrides: ['n_steps=5']}\n"
        "ppo: {agent_steps: 160, n_steps: 10, batch_size: 20, n_epochs: 1, hidden: [8]}\n"
        "selection: {every: 40, trials: 1, policies: [random]}\n",
        encoding="utf-8",
    )
    return ["--config", str(path)]


def _learnt(out: Path) -> Left:
    """Learning curve, best score, and the digest of the best policy as its checkpoint has it."""
    pointers = {
        name: json.loads((out / f"checkpoints/{name}.json").read_text(encoding="utf-8"))["checkpoint"]
        for name in ("last", "best")
    }
    states = {
        name: json.loads((out / f"checkpoints/{step}/state.json").read_text(encoding="utf-8"))
        for name, step in pointers.items()
    }
    return {"curve": pd.read_parquet(out / "curve.parquet"), **states}


def _as_good(there: Left, here: Left) -> bool:
    """Whether a training that was taken up went as far, and its best checkpoint is its curve's best.

    A continued run plays other worlds than one in one piece, so its weights are others.
    """
    scores, expected = _scores(there["curve"]), _scores(here["curve"])
    best = there["best"]["agent_steps"] + there["best"]["imitated"]
    return bool(
        there["last"]["agent_steps"] == here["last"]["agent_steps"]
        and scores.index.equals(expected.index)
        and abs(scores.max() - there["best"]["score"]) < 1e-12
        and abs(scores[best] - there["best"]["score"]) < 1e-12
    )


def _scores(curve: pd.DataFrame) -> "pd.Series[float]":
    """Mean score of the learned policy, by agent-steps."""
    return curve[curve["policy"] == "learned"].groupby("agent_steps")["mapped_share"].mean()


COMMANDS = (
    Command(
        name="evaluate",
        module="baselines.evaluate",
        arguments=_evaluation,
        left=_tables,
        agrees=_same,
        precious=_episodes,
        take_up="--resume",
        nothing_there="\0",
    ),
    Command(
        name="optimise",
        module="wifipgo.graph.optimise",
        arguments=_optimisation,
        left=_graphs,
        agrees=_same,
        precious=lambda out: [],
        take_up="--overwrite",
        nothing_there="\0",
    ),
    Command(
        name="train.ppo",
        module="train.ppo",
        arguments=_training,
        left=_learnt,
        agrees=_as_good,
        precious=lambda out: sorted(path for path in (out / "checkpoints").rglob("*") if path.is_file()),
        take_up="--resume",
        nothing_there="no last checkpoint was saved",
    ),
)
