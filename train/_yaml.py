"""Settings in YAML that mean to every reader what they mean here.

YAML 1.1 (PyYAML's), YAML 1.2 and people take ``0123``, ``1:30``, ``yes`` or ``2026-01-01`` for different
things. Such words are refused where they stand without quotes, and so is all by which something that was
said would be lost or grow: a key twice, a second document, tags, aliases, which let 300 bytes spell out to
gigabytes.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from wifipgo.errors import BadInputError, quoted
from wifipgo.files.text_files import MOST_DIGITS, read_text

MOST_BYTES = 1 << 20
MOST_LEVELS = 32

_TEXT = "tag:yaml.org,2002:str"
_WORDS: Mapping[str, Any] = {
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
}
_WHOLE = re.compile(r"[-+]?(?:0|[1-9][0-9]*|[1-9][0-9]{0,2}(?:_[0-9]{3})+)")
_FLOAT = re.compile(r"[-+]?(?:\.[0-9]+|(?:0|[1-9][0-9]*)(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")
_DOUBTFUL = {
    re.compile(pattern): meant
    for pattern, meant in (
        (r"[-+]?0[0-9_]+(?:[.eE].*)?", "a number without zeros ahead (YAML 1.1 takes it for octal)"),
        (r"[-+]?0[boxBOX]\w*", "a decimal number"),
        (r"[-+]?[0-9][0-9_]*(?::[0-5]?[0-9])+(?:\.[0-9_]*)?", "a number (YAML 1.1 takes it to base 60)"),
        (r"[0-9]{4}-[0-9]{1,2}-[0-9]{1,2}.*", "something that YAML 1.1 does not take for a date"),
        (r"[-+]?\.?[0-9][0-9_]*\.?[0-9_]*_[0-9_.]*(?:[eE].*)?", "a number, in threes if with _ (500_000)"),
        (r"[-+]?[0-9]+(?:\.[0-9]+)?,[0-9]+(?:[eE].*)?", "a number with a decimal point"),
        (r"(?i:[-+]?\.inf|\.nan)", "a finite number"),
        (r"(?i:y|n|yes|no|on|off)", "true or false"),
        (r"=|<<", "a word"),
    )
}


class Settings(NamedTuple):
    """What a file says.

    Attributes:
        values: Keys and values; tables hold keys of their own.
        lines: Line of each key, by its dotted name.
    """

    values: dict[str, Any]
    lines: dict[str, int]


def read_settings(path: Path) -> Settings:
    """Keys and values of a file.

    Raises:
        BadInputError: It is not YAML, or says something that is lost or read in two ways; names the line.
        OSError: It cannot be read.
    """
    text = read_text(path, most_bytes=MOST_BYTES)
    try:
        _check_events(text, path)
        node = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.MarkedYAMLError as problem:
        line = problem.problem_mark.line + 1 if problem.problem_mark else 1
        raise _refusal(path, line, f"is not YAML: {problem.problem}") from None
    except yaml.reader.ReaderError as problem:
        line = text.count("\n", 0, problem.position) + 1
        raise _refusal(path, line, f"is not YAML: character {problem.character:#06x}") from None
    if node is None:
        return Settings({}, {})
    if not isinstance(node, yaml.MappingNode):
        raise _refusal(path, _line(node), f"must be keys and values, got {quoted(node.value)}")
    lines: dict[str, int] = {}
    return Settings(_table(node, path, "", lines), lines)


def written(values: Mapping[str, Any]) -> str:
    """Values as YAML that `read_settings` reads back."""
    return str(yaml.dump(dict(values), Dumper=_Dumper, sort_keys=False))


def _refusal(path: Path, line: int, what: str) -> BadInputError:
    """A refusal that begins with the place."""
    return BadInputError(f"{path}:{line}: {what}")


def _line(node: yaml.Node) -> int:
    """Where a node begins, from 1."""
    return int(node.start_mark.line) + 1


def _check_events(text: str, path: Path) -> None:
    """Refuse, before anything follows the nesting, what is too deep, tags, aliases and a second document."""
    depth, documents = 0, 0
    for event in yaml.parse(text, Loader=yaml.SafeLoader):
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        documents += isinstance(event, yaml.DocumentStartEvent)
        for holds, what in (
            (depth <= MOST_LEVELS, f"nesting must be <= {MOST_LEVELS} levels deep, got more"),
            (documents <= 1, "must be one document, got a second one (---)"),
            (not isinstance(event, yaml.AliasEvent), "must be written out, got an alias (*)"),
            (not getattr(event, "tag", None), "must be without tags (!)"),
        ):
            if not holds:
                raise _refusal(path, event.start_mark.line + 1 if event.start_mark else 1, what)


def _table(node: yaml.MappingNode, path: Path, above: str, lines: dict[str, int]) -> dict[str, Any]:
    """A table; notes the line of each key."""
    table: dict[str, Any] = {}
    for key, value in node.value:
        name = _value(key, path, "a key", lines)
        if not isinstance(name, str):
            raise _refusal(path, _line(key), f"a key must be a word, got {quoted(name)}")
        where = f"{above}{name}"
        if name in table:
            raise _refusal(path, _line(key), f"{where} must be given once, got it in line {lines[where]} too")
        lines[where] = _line(key)
        table[name] = _value(value, path, where, lines)
    return table


def _value(node: yaml.Node, path: Path, where: str, lines: dict[str, int]) -> Any:
    """A table, a list or a word."""
    if isinstance(node, yaml.MappingNode):
        return _table(node, path, f"{where}.", lines)
    if isinstance(node, yaml.SequenceNode):
        return [_value(item, path, f"{where}[{k}]", lines) for k, item in enumerate(node.value)]
    if not isinstance(node, yaml.ScalarNode) or node.style is not None:  # in quotes
        return node.value
    if meant := _doubt(node.value):
        rule = f"{meant}, or in quotes if it is a word"
        raise _refusal(path, _line(node), f"{where} must be {rule}, got {quoted(node.value)}")
    return _plain(node.value)


def _doubt(word: str) -> str:
    """What somebody who writes a word without quotes probably means, if it is read in two ways."""
    if _WHOLE.fullmatch(word):
        return ""
    return next((meant for pattern, meant in _DOUBTFUL.items() if pattern.fullmatch(word)), "")


def _plain(word: str) -> Any:
    """What a word without quotes stands for."""
    if word in _WORDS:
        return _WORDS[word]
    if len(word) <= MOST_DIGITS:
        if _WHOLE.fullmatch(word):
            return int(word)
        if _FLOAT.fullmatch(word):
            return float(word)
    return word


class _Dumper(yaml.SafeDumper):
    """Puts a string in quotes where YAML 1.1 or this module would read something else without."""

    def ignore_aliases(self, data: Any) -> bool:
        """Write everything out."""
        return True

    def resolve(self, kind: Any, value: Any, implicit: Any) -> str:
        """Tag of a word: as YAML 1.1 has it, or one that no string has where it is read otherwise here."""
        tag = str(super().resolve(kind, value, implicit))  # type: ignore[no-untyped-call]
        plain = kind is yaml.ScalarNode and implicit[0] and tag == _TEXT
        return f"{_TEXT}-in-quotes" if plain and (_doubt(value) or _plain(value) != value) else tag
