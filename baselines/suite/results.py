"""Scores of policies in the worlds of a suite: a JSON file that is read with care, and joined with others."""

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from baselines.suite.definition import SUITES, digest_of, refuse_other_version
from wifipgo.errors import BadInputError, pick, require
from wifipgo.files.atomic_files import write_text
from wifipgo.files.text_files import read_json

FILE = "suite.json"
_DIGITS = 6
_LISTS = re.compile(r"\[\s+([-\d.e,\s]+?)\s+\]")  # of numbers, which take a line each as json writes them
_NOTES = ("policy", "source", "versions")


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A policy and what it scored.

    Attributes:
        policy: Text that names it, e.g. ``active:err_threshold=0.5``.
        source: Digest of what it is made of beyond this package; empty if it is ours.
        versions: Of what computed the scores.
        scores: Mapped share in each world, by scenario.
    """

    policy: str
    source: str
    versions: Mapping[str, str]
    scores: Mapping[str, tuple[float, ...]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Results:
    """Scores of some policies in the same worlds.

    Attributes:
        suite: Version.
        first: Number of the first world.
        worlds: How many of each scenario.
        entries: By the label of the policy.
    """

    suite: str
    first: int
    worlds: int
    entries: Mapping[str, Entry]

    @property
    def scenarios(self) -> tuple[str, ...]:
        """Those that every policy has played, in the order of the suite."""
        played = [set(entry.scores) for entry in self.entries.values()]
        return tuple(name for name in SUITES[self.suite].parts if all(name in those for those in played))

    @property
    def numbers(self) -> range:
        """Numbers of the worlds."""
        return range(self.first, self.first + self.worlds)

    def scores(self, label: str) -> Float[np.ndarray, "scenarios worlds"]:
        """Mapped share of a policy in the scenarios that all have played."""
        return np.array([self.entries[label].scores[name] for name in self.scenarios])


def rounded(share: float) -> float:
    """A score as it is kept."""
    return round(share, _DIGITS)


def write_results(path: Path, results: Results) -> None:
    """Write a file that is there whole or not at all, the scores of a scenario in a line."""
    entries = {
        label: {
            **{name: getattr(entry, name) for name in _NOTES},
            "scores": {name: list(scores) for name, scores in entry.scores.items()},
        }
        for label, entry in results.entries.items()
    }
    head = {"suite": results.suite, "digest": digest_of(results.suite)}
    said = head | {"first": results.first, "worlds": results.worlds, "entries": entries}
    text = json.dumps(said, indent=1, allow_nan=False)
    write_text(path, _LISTS.sub(lambda found: f"[{' '.join(found[1].split())}]", text) + "\n")


def read_results(path: Path) -> Results:
    """Read what `write_results` wrote.

    Raises:
        BadInputError: It is no such file, of another version, or scores are missing; names the file.
        OSError: It cannot be read.
    """
    said, where = read_json(path), str(path)
    require(isinstance(said, dict), where, "the results of a suite, a table", said)
    name = str(said.get("suite"))
    pick(SUITES, name, f"suite of {where}:")
    refuse_other_version(said, name, where)
    most = SUITES[name].worlds
    for field, least in (("first", 0), ("worlds", 1)):
        number = said.get(field)
        fits = type(number) is int and least <= number <= most
        require(fits, f"{where}: {field}", f"an int in {least}..{most}", number)
    entries = said.get("entries")
    require(isinstance(entries, dict) and len(entries) > 0, f"{where}: entries", "one or more", entries)
    assert isinstance(entries, dict)
    read = {label: _entry(one, name, said["worlds"], f"{where}: {label}") for label, one in entries.items()}
    return Results(suite=name, first=said["first"], worlds=said["worlds"], entries=read)


def _entry(said: Any, suite: str, worlds: int, where: str) -> Entry:
    """One policy of a file."""
    whole = isinstance(said, dict) and {*_NOTES, "scores"} <= said.keys() and isinstance(said["scores"], dict)
    require(whole, where, f"a table with {', '.join(_NOTES)} and scores", said)
    for name, kind in zip(_NOTES, (str, str, dict), strict=True):
        require(isinstance(said[name], kind), f"{where}: {name}", f"a {kind.__name__}", said[name])
    for name, scores in said["scores"].items():
        pick(SUITES[suite].parts, name, f"scenario of {where}:")
        numbers = isinstance(scores, list) and all(type(x) in (int, float) and 0 <= x <= 1 for x in scores)
        require(numbers, f"{where}: {name}", "a list of shares in [0, 1]", scores)
        require(len(scores) == worlds, f"{where}: {name}", f"{worlds} scores, one a world", len(scores))
    scores = {name: tuple(map(float, found)) for name, found in said["scores"].items()}
    return Entry(scores=scores, **{name: said[name] for name in _NOTES})


def joined(parts: Sequence[Results], *, same_code: bool = True) -> Results:
    """Results of several runs as those of one: other policies, other scenarios or other worlds.

    Args:
        parts: In any order.
        same_code: Refuse parts that other versions of the code played.

    Raises:
        BadInputError: Versions, policies or sources that differ, a world twice or missing.
    """
    require(len(parts) > 0, "in", "one folder or more", [])
    of_one = sorted(parts, key=lambda part: part.first)
    for part in of_one[1:]:
        rule = "the same in all parts"
        require(part.suite == of_one[0].suite, "suite", rule, [of_one[0].suite, part.suite])
    found: dict[str, Entry] = {}
    ends: dict[tuple[str, str], tuple[int, int]] = {}
    for part in of_one:
        for label, entry in part.entries.items():
            found[label] = _with(found.get(label), entry, label)
            for name in entry.scores:
                ends[label, name] = _extended(ends.get((label, name)), part, f"{name} of {label}")
    spans = set(ends.values())
    require(len(spans) == 1, "worlds", "the same for every policy and scenario", sorted(spans)[:3])
    _check_same(found, same_code=same_code)
    ((first, end),) = spans
    return Results(suite=of_one[0].suite, first=first, worlds=end - first, entries=found)


def _with(before: Entry | None, more: Entry, label: str) -> Entry:
    """An entry with the scores of another part behind its own."""
    if before is None:
        return more
    for name in _NOTES:
        pair = getattr(before, name), getattr(more, name)
        if pair[0] != pair[1]:
            raise BadInputError(
                f"parts of {label} must be of one policy and code, got {name} {pair[0]} and {pair[1]}"
            )
    scores = {**before.scores, **{k: (*before.scores.get(k, ()), *v) for k, v in more.scores.items()}}
    return replace(before, scores=scores)


def _extended(span: tuple[int, int] | None, part: Results, what: str) -> tuple[int, int]:
    """First world and end of what is there, with those of one more part."""
    end = part.first + part.worlds
    if span is None:
        return part.first, end
    where = f"{what}: a part ends before world {span[1]}, the next begins with {part.first}"
    require(part.first >= span[1], "worlds", "in one part only", where)
    require(part.first == span[1], "worlds", "without a gap", where)
    return span[0], end


def _check_same(entries: Mapping[str, Entry], *, same_code: bool) -> None:
    """Refuse a policy without a scenario that others have, and codes that differ if that matters."""
    names = {name for entry in entries.values() for name in entry.scores}
    for label, entry in entries.items():
        rule = "with scores in every scenario that others have"
        require(
            set(entry.scores) == names, label, rule, f"none in {', '.join(sorted(names - {*entry.scores}))}"
        )
    codes = {entry.versions.get("code_sha256", "") for entry in entries.values()}
    require(not same_code or len(codes) == 1, "code_sha256", "the same in all parts", sorted(codes))


def in_order(results: Results, labels: Iterable[str]) -> Results:
    """The same with the policies in this order."""
    return replace(results, entries={label: results.entries[label] for label in labels})
