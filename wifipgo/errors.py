"""The few failures that a caller can act on, and the checks that raise them."""

import reprlib
from collections.abc import Iterable, Mapping
from typing import Protocol, TypeVar, runtime_checkable

T = TypeVar("T")


_QUOTED_CHARACTERS = 300
_LONGEST_NAME = 100
_NEAR = 0.6  # of the letters of two names that are the same and in the same order, difflib's default


@runtime_checkable
class Holds(Protocol):
    """A bool, of Python or of numpy, which this module does without."""

    def __bool__(self) -> bool:
        """Whether it holds."""


class BadInputError(ValueError):
    """What the user gave cannot be used; the message names the field, the rule and the value got."""


class DoubtfulError(RuntimeError):
    """Results are there, but not all of them or not to be trusted; the message says what is missing."""


class NumericalError(RuntimeError):
    """A computation that failed on input that was well formed; names the pose and the measurement."""


class UnknownNameError(BadInputError):
    """A name that nothing answers to; the message lists those that exist."""

    def __init__(self, kind: str, name: object, known: Iterable[str]) -> None:
        """Build the message from the kind of thing, the name got and the known names."""
        self.kind, self.name, self.known = kind, name, sorted(known)
        listed, near = ", ".join(self.known), nearest(name, self.known)
        hint = f"; did you mean {near!r}?" if near else ""
        super().__init__(f"unknown {kind} {name!r}; known: {listed}{hint}")

    def __reduce__(self) -> tuple[type, tuple[object, ...]]:
        """Travel between processes: Python would rebuild it from the message alone."""
        return type(self), (self.kind, self.name, self.known)


class MissingExtraError(BadInputError):
    """Something was asked for that needs packages that are not installed; names their extra."""


class RecordingError(BadInputError):
    """A CSI recording that cannot be read; says at which byte and what was expected."""

    def __init__(self, source: str, offset: int, expected: str, got: str) -> None:
        """Build the message from the file, the byte offset, what was expected and found."""
        self._given = (source, offset, expected, got)
        self.source, self.offset = source, offset
        super().__init__(f"{source}: at byte {offset}: expected {expected}, got {got}")

    def __reduce__(self) -> tuple[type, tuple[object, ...]]:
        """Travel between processes."""
        return type(self), self._given


class TextFileError(BadInputError):
    """A text file that cannot be read; says in which line and what was expected."""

    def __init__(self, source: str, line: int, expected: str, got: str) -> None:
        """Build the message from the file, the line (0: the whole file), what was expected and found."""
        self._given = (source, line, expected, got)
        self.source, self.line = source, line
        place = f"{source}:{line}" if line else source
        super().__init__(f"{place}: expected {expected}, got {got}")

    def __reduce__(self) -> tuple[type, tuple[object, ...]]:
        """Travel between processes."""
        return type(self), self._given


class GraphFileError(TextFileError):
    """A file of a pose graph or a trajectory whose text says what cannot be."""


def nearest(name: object, known: Iterable[str]) -> str:
    """The known name that was probably meant; empty if none is near, or two as near as each other."""
    if not isinstance(name, str):
        return ""
    best = _likest(name.casefold(), {each: each.casefold() for each in known})
    if len(best) > 1:  # names that differ in capitals alone
        best = _likest(name, {each: each for each in best})
    return best[0] if len(best) == 1 else ""


def _likest(name: str, known: Mapping[str, str]) -> list[str]:
    """Keys of the texts that are most like a name, if they are near it at all."""
    from difflib import SequenceMatcher  # noqa: PLC0415 (only who mistypes waits for it)

    matcher = SequenceMatcher(b=name[:_LONGEST_NAME])
    shares = {}
    for key, text in known.items():
        matcher.set_seq1(text[:_LONGEST_NAME])
        shares[key] = matcher.ratio()
    return [key for key, share in shares.items() if share == max(shares.values()) and share >= _NEAR]


def pick(table: Mapping[str, T], name: object, kind: str) -> T:
    """Look ``name`` up, or raise `UnknownNameError` that lists what ``table`` holds."""
    if not isinstance(name, str) or name not in table:  # a list has no hash
        raise UnknownNameError(kind, name, table)
    return table[name]


def require(holds: Holds, field: str, rule: str, value: object) -> None:
    """Raise `BadInputError` naming the field, the rule and the value unless ``holds``."""
    if not holds:
        raise BadInputError(f"{field} must be {rule}, got {quoted(value)}")


def require_within(config: object, limits: Mapping[str, tuple[int | float, int | float]]) -> None:
    """Raise `BadInputError` at the first field of a configuration that is outside its limits."""
    for name, (low, high) in limits.items():
        value = getattr(config, name)
        require(bool(low <= value <= high), f"{type(config).__name__}.{name}", f"in {low:g}..{high:g}", value)


def quoted(value: object) -> str:
    """A value as it is printed in a message: whole if short, with its middle left out if long.

    A few hundred bytes of YAML with aliases can spell out to gigabytes, so the value is
    never spelled out first and cut afterwards.
    """
    return " ".join(line.strip() for line in _QUOTER.repr(value).splitlines())  # arrays take several


_QUOTER = reprlib.Repr()
_QUOTER.maxlevel = 4
_QUOTER.maxdict = _QUOTER.maxlist = _QUOTER.maxtuple = _QUOTER.maxset = _QUOTER.maxfrozenset = 40
_QUOTER.maxstring = _QUOTER.maxother = _QUOTED_CHARACTERS
_QUOTER.maxlong = 80
