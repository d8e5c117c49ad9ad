"""What an evaluation runs: scenario, policies, trials and seed; and its record on disk."""

import json
import platform
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from functools import cache
from hashlib import sha256
from importlib import metadata
from importlib.resources import files
from pathlib import Path
from typing import Any

from baselines.evaluation.drivers import try_policy
from baselines.evaluation.episodes import trial_seed
from baselines.policies import make_policy
from baselines.policies.registry import remarks, source_digest
from baselines.policies.specs import Spec
from envs.rendezvous_v0 import parallel_env
from wifipgo.errors import BadInputError, pick, require
from wifipgo.files.text_files import read_json
from wifipgo.scenarios import SCENARIOS, Scenario
from wifipgo.version import version

_RECORD: Mapping[str, type] = {"scenario": dict, "policies": list, "trials": int, "seed": int}
_ENOUGH = 10  # trials from which an interval is one
_OPTIONAL = ("reference", "sources")  # stand in a record only if there are any
_PACKAGES = ("numpy", "gtsam", "pymunk", "pettingzoo")


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """Every policy on every trial; trial k has the same seed for all policies.

    Attributes:
        scenario: What is played.
        specs: Policies, all labelled, in the order of tables and pictures.
        trials: Worlds that every policy meets.
        seed: Root of the seeds of all trials.
        trials_from: Number of the first trial: the others of a job array belong to other jobs.
        against: Label of the policy that the others are compared with; empty: ``active``, or the first.
    """

    scenario: Scenario
    specs: tuple[Spec, ...]
    trials: int
    seed: int
    trials_from: int = 0
    against: str = ""

    def __post_init__(self) -> None:
        """Refuse, before anything runs, what could not run."""
        require(self.trials >= 1, "trials", ">= 1", self.trials)
        require(self.seed >= 0, "seed", ">= 0", self.seed)
        require(self.trials_from >= 0, "trials-from", ">= 0", self.trials_from)
        require(bool(self.policies), "policies", "one or more, separated by commas", self.policies)
        if self.against:
            pick(dict(zip(self.policies, self.specs, strict=True)), self.against, "reference")
        drivers = [make_policy(str(spec), self.scenario, label=spec.label) for spec in self.specs]
        first = trial_seed(self.seed, self.trials_from)
        parallel_env(scenario=self.scenario).reset(seed=first)
        for spec, driver in zip(self.specs, drivers, strict=True):
            if spec.where:
                try_policy(self.scenario, driver, first)

    @property
    def policies(self) -> tuple[str, ...]:
        """Labels of the policies."""
        return tuple(spec.label for spec in self.specs)

    @property
    def remarks(self) -> list[str]:
        """What is to be said of the policies before they play: those that were trained on something else."""
        return remarks(self.specs, self.scenario)

    @property
    def title(self) -> str:
        """Name of the scenario, and what was changed in it."""
        named = SCENARIOS.get(self.scenario.name)
        if named is None or named == self.scenario:
            return self.scenario.name
        changed = [
            f"{n.split('.')[-1]}={now}" for n, _, now in differences(asdict(named), asdict(self.scenario))
        ]
        return f"{self.scenario.name} ({', '.join(changed[:3])}{', ...' if len(changed) > 3 else ''})"

    @property
    def numbers(self) -> range:
        """Numbers of the trials."""
        return range(self.trials_from, self.trials_from + self.trials)

    def after(self, trials: int) -> "Plan":
        """The same without its first trials."""
        return replace(self, trials=self.trials - trials, trials_from=self.trials_from + trials)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Why the results are to be taken with care."""
        few = f"{self.trials_in_words}: with fewer than {_ENOUGH}, intervals are too narrow to be relied on"
        return (few,) if self.trials < _ENOUGH else ()

    @property
    def trials_in_words(self) -> str:
        """For titles."""
        return f"{self.trials} trial{'s' if self.trials > 1 else ''}"

    @property
    def reference(self) -> str:
        """Policy that the others are compared with: the one asked for, else ``active``, or the first."""
        return self.against or ("active" if "active" in self.policies else self.policies[0])

    def record(self) -> dict[str, Any]:
        """All that decides the results, as plain JSON values."""
        values = asdict(self) | {"versions": versions()}
        values["reference"] = values.pop("against")
        values["policies"] = [spec.labelled for spec in values.pop("specs")]
        digests = {spec.label: source_digest(spec) for spec in self.specs}
        values["sources"] = {label: digest for label, digest in digests.items() if digest}
        values = {name: value for name, value in values.items() if name not in _OPTIONAL or value}
        return json.loads(json.dumps(values, allow_nan=False))


def versions() -> dict[str, str]:
    """Versions of what computes the results, and a digest of the project's own code."""
    versions = {"python": platform.python_version(), "wifipgo": version()}
    versions |= {name: metadata.version(name) for name in _PACKAGES}
    return {**versions, "code_sha256": code_digest()}


@cache
def code_digest() -> str:
    """Digest of the project's own code as this process found it first."""
    code = sha256()
    for package in ("baselines", "envs", "wifipgo"):
        for path in sorted(Path(str(files(package))).rglob("*.py")):
            code.update(path.read_bytes())
    return code.hexdigest()[:16]


def read_record(path: Path) -> dict[str, Any]:
    """Read a ``config.json``.

    Raises:
        ValueError: It is not one; the message names the file.
    """
    record = read_json(path)
    found = record if isinstance(record, dict) else {}
    fits = all(isinstance(found.get(name), kind) for name, kind in _RECORD.items())
    require(fits, str(path), f"a config.json with {', '.join(_RECORD)}", sorted(found))
    return found


def differences(one: Any, other: Any, name: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Dotted names of the fields in which two records differ, with both values."""
    if isinstance(one, dict) and isinstance(other, dict):
        for key in sorted(one.keys() | other.keys()):
            yield from differences(one.get(key), other.get(key), f"{name}.{key}" if name else key)
    elif one != other:
        yield name, one, other


def refuse_differing(differing: Iterable[tuple[str, Any, Any]], what: str) -> None:
    """Raise where two records differ; names the first fields, with what was there and what is now.

    Raises:
        BadInputError: There is a difference.
    """
    fields = [f"{name} ({old!r} there, {new!r} now)" for name, old, new in differing]
    if fields:
        raise BadInputError(f"{what} differs in {'; '.join(fields[:3])}")
