"""Whose pose a key of a g2o file names, refused where it could be two robots'.

======================  =======================================================================
key                     robot
======================  =======================================================================
plain number            the one whose file it is in: 7 in ``7.g2o``, 0 in a file of another name
gtsam ``Symbol``        its letter, in the top byte: 'a' to 'z' from 0, then 'A' to 'Z'
gtsam ``LabeledSymbol`` its label, in the byte below, by the same count; the letter tells nothing
======================  =======================================================================

All poses of a graph have keys of one kind: beside symbols, a plain number could be anybody's.
"""

import string
from collections.abc import Sequence
from typing import NamedTuple

from wifipgo.errors import GraphFileError
from wifipgo.graph.files._g2o_lines import FileLines, Line

LETTERS = string.ascii_lowercase + string.ascii_uppercase
INDEX_BITS = 56  # of a symbol
LABEL_BITS = 48  # below the label
_MOST = 1 << LABEL_BITS  # numbers of poses are smaller, so what is above is a letter


class Key(NamedTuple):
    """A key taken apart; the robot of a plain number is left open."""

    kind: str
    robot: int | None
    pose: int


class Named(NamedTuple):
    """A key, the line that it was found in, and the robot of the file."""

    key: int
    line: Line
    robot: int | None


def taken_apart(key: int, line: Line) -> Key:
    """Robot and number of a key.

    Raises:
        GraphFileError: It is of no kind that is known; names the line.
    """
    letter, label, index = key >> INDEX_BITS, key >> LABEL_BITS & 0xFF, key & (_MOST - 1)
    of_letter, of_label = robot_of_letter(letter), robot_of_letter(label)
    if 0 <= key < _MOST:
        return Key("plain numbers", None, index)
    if of_letter is not None and label == 0:
        return Key("symbols", of_letter, index)
    if of_letter is not None and of_label is not None:
        return Key("labelled symbols", of_label, index)
    expected = "keys below 2^48 or gtsam symbols, whose top byte, and label if there is one, are letters"
    raise GraphFileError(line.source, line.number, expected, str(key))


def robot_of_letter(byte: int) -> int | None:
    """Number of the robot that a letter stands for."""
    return LETTERS.index(chr(byte)) if 0 < byte < 128 and chr(byte) in LETTERS else None


def places(named: Sequence[Named]) -> dict[int, tuple[int, int]]:
    """(robot, index) of every key.

    Args:
        named: Keys of poses, each with where it was found first.

    Raises:
        GraphFileError: Keys are of two kinds, or two of them name one pose.
    """
    out: dict[int, tuple[int, int]] = {}
    owners: dict[tuple[int, int], int] = {}
    kinds: dict[str, Named] = {}
    for one in named:
        key = taken_apart(one.key, one.line)
        kinds.setdefault(key.kind, one)
        if len(kinds) > 1:
            kind, first = next(iter(kinds.items()))
            expected = f"{kind} as keys, like {first.key} in {_at(first.line)}"
            raise GraphFileError(one.line.source, one.line.number, expected, str(one.key))
        place = (one.robot or 0) if key.robot is None else key.robot, key.pose
        if owners.setdefault(place, one.key) != one.key:
            expected = f"one key for pose {place[1]} of robot {place[0]}, {owners[place]}"
            raise GraphFileError(one.line.source, one.line.number, expected, str(one.key))
        out[one.key] = place
    return out


def vertices_named(files: Sequence[FileLines], *, by_robot: bool) -> list[Named]:
    """The poses of all files, each once.

    A pose that another robot's file repeats, with the same numbers, counts once; a plain number does
    not say whose it is.

    Args:
        files: What they hold.
        by_robot: Whether each is a robot's own; a lone file is of all robots.

    Raises:
        GraphFileError: A file has a pose twice, two have it with other numbers, or it is in none that
            its robot's number names.
    """
    seen: dict[int, Named] = {}
    for file in files:
        for line in file.vertices:
            one = Named(line.keys[0], line, file.robot)
            first = seen.setdefault(one.key, one)
            if first is not one:
                _repeated(first, one)
                if _is_at_home(one):
                    seen[one.key] = one
    for one in seen.values() if by_robot else ():
        if not _is_at_home(one):
            expected = f"poses of robot {one.robot} ({_letter(one.robot)}), as the file's name says"
            raise GraphFileError(one.line.source, one.line.number, expected, _owner(one))
    return list(seen.values())


def ends_named(files: Sequence[FileLines]) -> list[Named]:
    """Keys at the ends of all measurements, each once: the poses of files without any.

    Raises:
        GraphFileError: A plain number is in two robots' files, which does not say whose it is.
    """
    seen: dict[int, Named] = {}
    for file in files:
        for line in file.edges:
            for key in line.keys:
                first = seen.setdefault(key, Named(key, line, file.robot))
                if first.robot != file.robot and taken_apart(key, line).robot is None:
                    expected = f"a vertex that says whose pose {key} is, which is in {_at(first.line)} too"
                    raise GraphFileError(line.source, line.number, expected, "none")
    return list(seen.values())


def _repeated(first: Named, again: Named) -> None:
    """Refuse a second vertex, unless another robot's file tells the same of a key that says whose it is."""
    line = again.line
    plain = taken_apart(again.key, line).robot is None
    if plain or first.line.source == line.source or first.line.values != line.values:
        got = f"vertex {again.key} again, as in {_at(first.line)}"
        raise GraphFileError(line.source, line.number, "each vertex once", got)


def _is_at_home(one: Named) -> bool:
    """Whether a key's robot is the one whose file it is in."""
    robot = taken_apart(one.key, one.line).robot
    return robot is None or one.robot is None or robot == one.robot


def _owner(one: Named) -> str:
    robot = taken_apart(one.key, one.line).robot
    return f"{one.key} of robot {robot} ({_letter(robot)}), which has no such pose in a file of its own"


def _letter(robot: int | None) -> str:
    return repr(LETTERS[robot]) if robot is not None and robot < len(LETTERS) else "no letter"


def _at(line: Line) -> str:
    return f"{line.source}:{line.number}"
