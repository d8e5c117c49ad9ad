"""Snapshots: an episode to come back to, in this process or another."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from envs._cohorts import Cohort
from envs._episode import Episode
from envs._observation import Field
from wifipgo.errors import BadInputError, require
from wifipgo.scenarios import Scenario, field_owners

FORMAT = 2  # of what a snapshot holds; another one is refused


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EpisodeSnapshot:
    """Where an episode stands, chance included; it pickles, and can be restored any number of times.

    Attributes:
        format: `FORMAT` of the version that took it.
        scenario: That of the environment, before options of a reset.
        blocks: Name and size of each block of the observation.
        episode: The episode.
        agents: Those that are live.
        wrappers: State of the generator that wrappers draw from.
    """

    format: int
    scenario: Scenario
    blocks: tuple[tuple[str, int], ...]
    episode: Episode
    agents: tuple[str, ...]
    wrappers: dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VectorSnapshot:
    """Where many worlds stand, chance included; it pickles, and can be restored any number of times.

    Attributes:
        format: `FORMAT` of the version that took it.
        scenario: That of the environment, before options of a reset.
        blocks: Name and size of each block of the observation.
        cohorts: Worlds that began together, and where they stand.
        seeds: Of each world: root of its chance and number of its episode.
        last: What the last reset or step gave.
    """

    format: int
    scenario: Scenario
    blocks: tuple[tuple[str, int], ...]
    cohorts: tuple[Cohort, ...]
    seeds: tuple[tuple[int, int] | None, ...]
    last: dict[str, np.ndarray]


Snapshot = TypeVar("Snapshot", EpisodeSnapshot, VectorSnapshot)


def blocks_of(layout: Sequence[Field]) -> tuple[tuple[str, int], ...]:
    """Name and size of each block."""
    return tuple((block.name, block.size) for block in layout)


def check_snapshot(
    snapshot: object, kind: type[Snapshot], scenario: Scenario, layout: Sequence[Field]
) -> Snapshot:
    """Refuse what is no snapshot of such an environment.

    Raises:
        ValueError: No snapshot, one of another format, scenario or layout; names what differs.
    """
    if not isinstance(snapshot, kind):
        rule = f"what snapshot() returned, one of {kind.__name__}"
        raise BadInputError(f"snapshot must be {rule}, got {type(snapshot).__name__}")
    require(snapshot.format == FORMAT, "snapshot.format", f"{FORMAT}, that of this version", snapshot.format)
    for name, part in field_owners().items():
        own, theirs = (
            getattr(getattr(one, part) if part else one, name) for one in (scenario, snapshot.scenario)
        )
        require(own == theirs, f"snapshot.scenario.{name}", f"that of the environment, {own!r}", theirs)
    own_blocks = blocks_of(layout)
    for ours, theirs in zip(own_blocks, snapshot.blocks, strict=False):
        require(ours == theirs, "snapshot.blocks", f"those of the environment, {ours}", theirs)
    size = len(snapshot.blocks)
    require(len(own_blocks) == size, "snapshot.blocks", f"{len(own_blocks)} blocks of the observation", size)
    return snapshot
