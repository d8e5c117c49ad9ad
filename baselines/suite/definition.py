"""Suites by version: which scenarios, which worlds of each, and between what scores are normalised.

A version never changes: another scenario, root or number of worlds is another version. `digest_of` is that of
all that decides the worlds; results and the anchors in ``suite-v1.json`` carry it, so none are mixed.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from hashlib import sha256
from importlib.resources import files
from types import MappingProxyType
from typing import Any, NamedTuple

from baselines.evaluation.episodes import trial_seed
from baselines.evaluation.plan import differences
from wifipgo.errors import BadInputError
from wifipgo.scenarios import SCENARIOS, Scenario

# Near-perfect localisation: hardly any noise of odometry and of what is measured between places.
SURE: Mapping[str, float] = MappingProxyType({"sigma_t_m": 1e-3, "sigma_r_rad": 1e-3})
# What plays the ceiling: the plan of a team that never has to meet or go back.
CEILING = "team_plan:spread_m=1e9:err_threshold=1e9:last_steps=0:loop_worth=0"
FLOOR = "random"


class Part(NamedTuple):
    """One scenario of a suite.

    Attributes:
        scenario: What is played.
        root: Root of the seeds of its worlds, as ``--seed`` of ``wifipgo evaluate``.
        command: Its words there.
    """

    scenario: Scenario
    root: int
    command: tuple[str, ...]

    def seeds(self, trials: range) -> list[int]:
        """Seed of each world."""
        return [trial_seed(self.root, k) for k in trials]

    @property
    def sure(self) -> Scenario:
        """The same with near-perfect localisation."""
        return self.scenario.with_overrides(**SURE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Suite:
    """A version of the suite.

    Attributes:
        name: Version.
        parts: Scenarios by the short name of their column.
        worlds: Of each scenario.
    """

    name: str
    parts: Mapping[str, Part]
    worlds: int


def _part(root: int, name: str, **changes: Any) -> Part:
    """A scenario of that name with some fields changed."""
    sets = [f"{key}={value}" for key, value in changes.items()]
    words = ("--scenario", name, *(["--set", *sets] if sets else []), "--seed", str(root))
    return Part(SCENARIOS[name].with_overrides(**changes), root, words)


_V1 = {
    "sim": _part(6021, "paper-sim-2"),
    "hw": _part(6022, "paper-hw-2"),
    "boxes": _part(6023, "paper-hw-2-obstacles"),
    "density": _part(6024, "paper-hw-2", obstacle_density=0.1),
    "hetero": _part(6025, "paper-hw-2-hetero"),
    "four": _part(6026, "paper-sim-2", n_robots=4),
    "eight": _part(6027, "paper-sim-2", n_robots=8, size_m=40.0),
    "fifty": _part(6028, "paper-sim-50"),
    "real": _part(6029, "radio-real-2"),
    "hard": _part(6030, "radio-hard"),
}
SUITES: Mapping[str, Suite] = MappingProxyType(
    {"suite-v1": Suite(name="suite-v1", parts=MappingProxyType(_V1), worlds=100)}
)
# Root of worlds in which `wifipgo bench why` looks closely at what a policy does.
CLOSE_UP = 6100
# Roots that nothing is trained or chosen on.
ROOTS = (*(part.root for suite in SUITES.values() for part in suite.parts.values()), CLOSE_UP)


class Anchors(NamedTuple):
    """Mean mapped share of the floor and of the ceiling by scenario: 0 and 1 of the normalised score."""

    floor: Mapping[str, float]
    ceiling: Mapping[str, float]


@cache
def digest_of(name: str) -> str:
    """Digest of all that decides the worlds of a version; fields that have their defaults do not count."""
    suite, plain = SUITES[name], asdict(Scenario(name="", source=""))
    said: dict[str, Any] = {"worlds": suite.worlds}
    for column, part in suite.parts.items():
        values = asdict(part.scenario) | {"name": "", "source": ""}
        said[column] = [part.root, {field: now for field, _, now in differences(plain, values)}]
    return sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()[:16]


def anchors_of(name: str) -> Anchors:
    """What scores of a version are normalised between, as it was published.

    Raises:
        BadInputError: The scenarios are no longer those of the version.
    """
    there = json.loads((files("baselines.suite") / f"{name}.json").read_text(encoding="utf-8"))
    refuse_other_version(there, name, f"baselines/suite/{name}.json")
    return Anchors(there["floor"], there["ceiling"])


def refuse_other_version(there: Mapping[str, Any], name: str, where: str) -> None:
    """Raise unless what was written is of this version, and of the worlds that it has here.

    Raises:
        BadInputError: Names what differs.
    """
    wanted = {"suite": name, "digest": digest_of(name)}
    for field, now in wanted.items():
        if there.get(field) != now:
            told = f"{there.get(field)!r} there, {now!r} now"
            raise BadInputError(f"{where}: must be of the same version of the suite, got {field} {told}")
