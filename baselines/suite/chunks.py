"""Work of a suite in pieces: one policy in some worlds of one scenario, kept in a file of its own."""

import json
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

from rich.console import Console

from baselines.evaluation.batches import worlds_at_once
from baselines.evaluation.drivers import try_policy
from baselines.evaluation.episodes import Episode, run_episodes
from baselines.evaluation.executors import Executor
from baselines.evaluation.jobs import missing, raise_if_failed
from baselines.evaluation.progress import run_shown
from baselines.policies import make_policy
from baselines.policies.registry import source_digest
from baselines.policies.specs import Spec
from baselines.suite.definition import Part, Suite
from baselines.suite.results import rounded
from wifipgo.command.terminal import say
from wifipgo.errors import BadInputError
from wifipgo.files.atomic_files import read_sealed, write_sealed
from wifipgo.scenarios import Scenario


class Piece(NamedTuple):
    """Worlds that are played together, and the file of what is kept of them."""

    column: str
    scenario: Scenario
    name: str
    spec: str
    trials: range
    seeds: tuple[int, ...]
    path: Path

    @property
    def label(self) -> str:
        """Which worlds."""
        return f"policy {self.name} in {self.column}, worlds {self.trials.start} to {self.trials[-1]}"

    def played(self) -> list[Episode]:
        """Their episodes."""
        return run_episodes(self.scenario, self.spec, self.seeds, trials=self.trials, label=self.name)


class Chunk(Piece):
    """Worlds of which the scores are kept."""

    __slots__ = ()

    def compute(self) -> list[float]:
        """Play them: mapped share at the end of each."""
        return [rounded(episode.figures["mapped_share"]) for episode in self.played()]

    def keep(self, result: Sequence[float]) -> None:
        """Write the scores down."""
        write_sealed(self.path, json.dumps(list(result)).encode())

    def scores(self) -> tuple[float, ...]:
        """What was written."""
        return tuple(json.loads(read_sealed(self.path)))


def chunks_of(column: str, part: Part, spec: Spec, trials: range, folder: Path) -> list[Chunk]:
    """Pieces of which the scores are kept."""
    return [Chunk(*piece) for piece in pieces_of(column, part, spec, trials, folder=folder, suffix=".scores")]


def pieces_of(
    column: str, part: Part, spec: Spec, trials: range, *, folder: Path, suffix: str
) -> list[Piece]:
    """Worlds of one policy in one scenario in pieces that are played at once.

    Args:
        column: Short name of the scenario.
        part: The scenario and its worlds.
        spec: The policy.
        trials: Numbers of the worlds.
        folder: Of the files.
        suffix: Of their names.
    """
    n_pieces = max(1, -(-len(trials) // worlds_at_once(part.scenario)))
    size = max(1, -(-len(trials) // n_pieces))
    pieces = [trials[begin : begin + size] for begin in range(0, len(trials), size)]
    whose = sha256(f"{spec} {source_digest(spec)} {spec.label}".encode()).hexdigest()[:12]
    return [
        Piece(column, part.scenario, spec.label, str(spec), piece, tuple(part.seeds(piece)), path)
        for piece in pieces
        for path in [folder / f"{column}-{whose}-{piece.start:05d}-{len(piece)}{suffix}"]
    ]


def play_missing(
    pieces: Sequence[Piece], *, title: str, where: Executor, out: Path, console: Console
) -> None:
    """Play what is not there yet.

    Args:
        pieces: All that belong to it.
        title: What is played.
        where: Where episodes run.
        out: Folder in which failures are written down.
        console: Where it is said how much there is to do.

    Raises:
        EpisodesFailedError: Some raised; their traces are in ``failures.txt``.
    """
    todo = missing(pieces)
    n_episodes = sum(len(piece.trials) for piece in todo)
    say(console, f"{title}: {n_episodes} episodes to play; jobs: {where.slots(len(todo))}")
    raise_if_failed(run_shown("batches", todo, executor=where, console=console), out)


def check_policies(suite: Suite, names: Sequence[str], specs: Sequence[Spec]) -> None:
    """Refuse, before anything runs, a policy that cannot play a scenario.

    Raises:
        BadInputError: Names the scenario, the policy and what does not fit.
    """
    for name in names:
        part = suite.parts[name]
        for spec in specs:
            try:
                driver = make_policy(str(spec), part.scenario, label=spec.label)
                if spec.where:
                    try_policy(part.scenario, driver, part.seeds(range(1))[0])
            except BadInputError as problem:
                raise BadInputError(
                    f"policy {spec.label} cannot play {name} of {suite.name}: {problem}"
                ) from problem
