"""Worlds of which the conduct is kept, in pieces that are played together."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path

from baselines.conduct.conduct import Conduct, conduct_of, joined
from baselines.evaluation.kept_arrays import Arrays, KeptArrays
from baselines.evaluation.plan import versions
from baselines.policies.specs import Spec
from baselines.suite.chunks import Piece, pieces_of
from baselines.suite.definition import Part


class Watched(KeptArrays, Piece):
    """Worlds of one policy in one scenario."""

    __slots__ = ()

    def compute(self) -> Arrays:
        """Play them."""
        return conduct_of(self.played(), self.scenario.n_steps)._asdict()


def watched(column: str, part: Part, spec: Spec, n_worlds: int, folder: Path) -> list[Watched]:
    """All worlds of a policy in a scenario; files of other worlds, policies and code have other names."""
    decides = [asdict(part.scenario), part.root, versions()]
    key = sha256(json.dumps(decides, sort_keys=True).encode()).hexdigest()[:12]
    found = pieces_of(column, part, spec, range(n_worlds), folder=folder, suffix=f"-{key}.npz")
    return [Watched(*piece) for piece in found]


def conduct_in(pieces: Sequence[Watched]) -> Conduct:
    """What was kept."""
    return joined([Conduct(**piece.load()) for piece in pieces])
