r"""Policies as text: ``active:err_threshold=0.5``, ``mine=own.py:Policy:gain=2``.

==============================  ==================================================================
``NAME``                        a policy of ours
``my.module:Policy``            a class, or a function that makes a policy, of an importable module
``path/file.py:Policy``         the same of a file
``...:key=value:key=value``     its parameters
``LABEL=...``                   its name in tables, pictures and films
==============================  ==================================================================

A colon separates only where a class or ``key=`` follows, and a comma of a list only where another policy
begins, so most paths need no quotes.  In quotes, single or double, a label, a file or a value may hold
anything: ``'my run, 2'=ppo:path='C:\\a=b:c.npz'``.
"""

import json
import os
import re
from collections.abc import Iterable, Sequence
from pathlib import PurePath
from typing import Any, NamedTuple

from wifipgo.coerce import settings
from wifipgo.errors import require

_QUOTED = r"""'(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*\""""
_LABEL = rf"\s*(?:{_QUOTED}|[^:=,'\"/\\]+?)\s*=(?=\s*[^\s=])"
_MODULE, _NAME = r"[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*", r"[A-Za-z_]\w*"
_ENDS = r"(?=\s*(?::|,|$))"
# A class of a file or a module; a file or a dotted module alone is told what it lacks where it is loaded.
_OWN = re.compile(
    rf"\s*(?:(?P<file>{_QUOTED}|.+?\.py)(?::(?P<of_file>{_NAME}){_ENDS})?"
    rf"|(?P<module>{_MODULE}):(?P<of_module>{_NAME}){_ENDS}"
    rf"|(?P<alone>{_NAME}\.{_MODULE}))(?=\s*(?::|$))"
)
_OWN_IN_LIST = rf"(?:{_QUOTED}|[^,'\"]+?\.py|{_MODULE}):{_NAME}{_ENDS}|(?:{_QUOTED}|[^,'\"]+?\.py)\s*(?=,|$)"
_NEXT_PARAMETER = re.compile(r":(?=\s*[A-Za-z_]\w*\s*=|\s*$|[^/\\\d][^/\\:]*$)")
_MOST_PARTS = 32  # of a path that is needed to tell it from another
_PATH = "path"  # parameter whose value is a path


class Spec(NamedTuple):
    """A policy as text, in its parts.

    Attributes:
        label: Its name in tables and pictures; empty where none was given.
        where: Module or file of a policy of the user's own; empty for one of ours.
        name: Of ours, or of the class or function there.
        pairs: Parameters, each ``key=value``.
    """

    label: str
    where: str
    name: str
    pairs: tuple[str, ...]

    @property
    def parameters(self) -> dict[str, Any]:
        """Parameters by name."""
        return settings(self.pairs)

    @property
    def is_file(self) -> bool:
        """Whether a file holds it, rather than an importable module."""
        return self.where.endswith(".py")

    def __str__(self) -> str:
        """Text that `parse_spec` reads, without the label."""
        where = [_shielded(self.where)] if self.where else []
        return ":".join([*where, *([self.name] if self.name else []), *self.pairs])

    @property
    def labelled(self) -> str:
        """The same with the label where there is one that says more."""
        plain = self.label in {"", str(self)}
        return str(self) if plain else f"{_shielded(self.label)}={self}"

    def short(self, n_parts: int) -> str:
        """Text whose paths have their last parts only."""
        where = _tail(self.where, n_parts) if self.is_file else self.where
        pairs = [_short_pair(pair, n_parts) for pair in self.pairs]
        return ":".join([*([where] if where else []), self.name, *pairs])


def parse_spec(text: str, known: Iterable[str] = ()) -> Spec:
    """Parts of a policy's text.

    Args:
        text: As in this module's head.
        known: Names of ours, which are never taken for modules.

    Raises:
        BadInputError: A label that cannot be printed.
    """
    label, rest = _without_label(text)
    own = None if re.split(r"[:\s]", rest.lstrip(), maxsplit=1)[0] in set(known) else _OWN.match(rest)
    if own is None:
        name, *pairs = _split(rest.strip(), _NEXT_PARAMETER)
        return Spec(label, "", name, _trimmed(pairs))
    where = _bare(own["file"] or own["module"] or own["alone"])
    pairs = _split(rest[own.end() :].strip(), _NEXT_PARAMETER)[1:]
    return Spec(label, where, own["of_file"] or own["of_module"] or "", _trimmed(pairs))


def split_list(specs: str, known: Iterable[str]) -> tuple[str, ...]:
    """Specs of a list ``a,b:key=value,c``: a comma separates only where a policy begins.

    Where nothing known follows, and no parameter is before it, it separates too: a name that is
    not known is refused where the policy is made, not taken for a part of the last.
    """
    names = "|".join(map(re.escape, sorted(known, key=len, reverse=True)))
    begins = rf",(?=(?:{_LABEL})?\s*(?:(?:{names})\s*(?:[:,]|$)|{_OWN_IN_LIST})|\s*$)"
    parts = _split(specs, re.compile(begins))
    plain = [piece for part in parts for piece in (_split(part, _COMMA) if ":" not in part else [part])]
    return tuple(piece.strip() for piece in plain if piece.strip())


def with_labels(specs: Sequence[Spec]) -> tuple[Spec, ...]:
    """Specs that all have a label, those that were given or the shortest text that tells them apart.

    Raises:
        BadInputError: A label twice, or the same policy twice without labels.
    """
    labels = [spec.label or spec.short(1) for spec in specs]
    for n_parts in range(2, _MOST_PARTS):
        unclear = {label for label in labels if labels.count(label) > 1}
        longer = (spec.label or spec.short(n_parts) for spec in specs)
        labels = [new if old in unclear else old for old, new in zip(labels, longer, strict=True)]
    twice = next((label for k, label in enumerate(labels) if label in labels[:k]), None)
    require(twice is None, "policies", "all different, or each with a label of its own: LABEL=POLICY", twice)
    return tuple(spec._replace(label=label) for spec, label in zip(specs, labels, strict=True))


def placed(spec: Spec) -> Spec:
    """The same with absolute paths, so that it means the same wherever it is read."""
    where = _absolute(spec.where) if spec.is_file else spec.where
    return spec._replace(where=where, pairs=tuple(map(_placed_pair, spec.pairs)))


def learned_at(path: str) -> Spec:
    """The trained policy of a file or of the folder of a run."""
    return Spec("", "", "ppo", (_path_pair(_absolute(path)),))


def _placed_pair(pair: str) -> str:
    key, _, value = (part.strip() for part in pair.partition("="))
    return _path_pair(_absolute(_bare(value))) if key == _PATH and value else pair


def _path_pair(path: str) -> str:
    """A path as a parameter that is read as this path."""
    plain = re.fullmatch(r"/[\w./+-]*", path)
    return f"{_PATH}={path if plain else _in_quotes(path)}"


def _absolute(path: str) -> str:
    return os.path.abspath(os.path.expanduser(path))


def _without_label(text: str) -> tuple[str, str]:
    found = re.match(_LABEL, text)
    if found is None:
        return "", text
    label = _bare(found[0].rstrip()[:-1].strip())
    fits = bool(label) and label.isprintable() and not {"'", '"'} & set(label)
    require(fits, "label of a policy", "printable, without quotes", label)
    return label, text[found.end() :]


def _split(text: str, separator: re.Pattern[str]) -> list[str]:
    """Split where a separator stands outside of quotes; these stay."""
    places, at = [], 0
    while at < len(text):
        quoted = _A_QUOTED.match(text, at) if text[:at].rstrip()[-1:] in {"", "=", ","} else None
        if quoted is None and separator.match(text, at):
            places.append(at)
        at = quoted.end() if quoted else at + 1
    begins, ends = [0, *(at + 1 for at in places)], [*places, len(text)]
    return [text[begin:end] for begin, end in zip(begins, ends, strict=True)]


_A_QUOTED, _COMMA = re.compile(_QUOTED), re.compile(",")


def _trimmed(pairs: Iterable[str]) -> tuple[str, ...]:
    return tuple(pair.strip() for pair in pairs)


def _bare(text: str) -> str:
    """Text without its quotes."""
    return re.sub(r"\\([\\'\"])", r"\1", text[1:-1]) if _A_QUOTED.fullmatch(text) else text


def _shielded(text: str) -> str:
    """Text in quotes where it holds what could separate."""
    return text if re.fullmatch(r"[\w./+-]+", text) else _in_quotes(text)


def _in_quotes(text: str) -> str:
    """Text in double quotes: single ones would need a shell's own quotes to be broken up."""
    return json.dumps(text, ensure_ascii=False)


def _short_pair(pair: str, n_parts: int) -> str:
    key, _, value = pair.partition("=")
    return f"{key}={_tail(_bare(value), n_parts)}" if key.strip() == _PATH else pair


def _tail(path: str, n_parts: int) -> str:
    """Last parts of a path."""
    return "/".join(PurePath(path).parts[-n_parts:])
