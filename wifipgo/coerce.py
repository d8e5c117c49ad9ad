"""Settings from outside: ``KEY=VALUE`` as text, and whether a value is of the type that a field holds."""

import ast
import math
import types
from collections.abc import Iterable, Sequence
from numbers import Integral, Real
from typing import Any, get_args, get_origin

from wifipgo.errors import require


def key_value(text: str) -> tuple[str, Any]:
    """Split ``KEY=VALUE``: a Python literal, TOML's ``true`` or ``false``, or else a string.

    Raises:
        ValueError: There is no ``=``, or nothing before it, or a value that nests too deep.
    """
    key, sign, value = (part.strip() for part in text.partition("="))
    require(bool(sign and key), "a setting", "KEY=VALUE", text)
    if value in {"true", "false"}:
        return key, value == "true"
    try:
        return key, ast.literal_eval(value)
    except (RecursionError, MemoryError):
        require(False, key, "a value that nests less deep", value)
    except (ValueError, SyntaxError):
        pass
    return key, value


def settings(texts: Iterable[str]) -> dict[str, Any]:
    """Many ``KEY=VALUE``, each key once.

    Raises:
        BadInputError: One has no ``=``, or a key has two values.
    """
    found: dict[str, Any] = {}
    for key, value in map(key_value, texts):
        same = key not in found or repr(found[key]) == repr(value)
        require(same, f"setting {key}", f"given once, or each time as {found.get(key)!r}", value)
        found[key] = value
    return found


def fitted(value: Any, kind: Any, name: str) -> Any:
    """Value as a field of type ``kind`` holds it: an int as a float, a list as a tuple, nothing else.

    Args:
        value: Value from a command line, a file or a keyword.
        kind: ``bool``, ``int``, ``float``, ``str``, or tuples and sequences of these.
        name: Field, for the message.

    Raises:
        ValueError: A value of another type, or a number that is not finite.
    """
    if get_origin(kind) in {tuple, Sequence}:
        return _fitted_items(value, kind, name)
    rule = f"of type {type_name(kind)}"
    if kind is float:
        require(isinstance(value, Real) and not isinstance(value, bool), name, rule, value)
        number = _float_of(value)
        require(math.isfinite(number), name, "finite", value)
        return number
    if kind is int:
        require(isinstance(value, Integral) and not isinstance(value, bool), name, rule, value)
        return int(value)
    require(isinstance(value, kind), name, rule, value)
    return value


def _float_of(value: Real) -> float:
    """Nearest float; infinite where a whole number is larger than all."""
    try:
        return float(value)
    except OverflowError:
        return math.inf


def _fitted_items(value: Any, kind: Any, name: str) -> tuple[Any, ...]:
    """The same for each item of a tuple; a message names the item by its index."""
    require(isinstance(value, list | tuple), name, f"of type {type_name(kind)}", value)
    kinds = [item for item in get_args(kind) if item is not Ellipsis]
    nested = not any(map(get_args, kinds)) and any(isinstance(item, list | tuple) for item in value)
    rule = f"of type {type_name(kind)}: there is one level of brackets too many"
    require(not nested, name, rule, value)
    if get_origin(kind) is Sequence or Ellipsis in get_args(kind):
        kinds = kinds[:1] * len(value)
    require(len(kinds) == len(value), name, f"{len(kinds)} numbers long", value)
    pairs = enumerate(zip(value, kinds, strict=True))
    return tuple(fitted(item, of, f"{name}[{k}]") for k, (item, of) in pairs)


def type_name(kind: Any) -> str:
    """A type in the words of this project: ``float``, ``tuple of float``, ``tuple of (float, float)``."""
    if not isinstance(kind, types.GenericAlias) and get_origin(kind) is None:
        return str(kind.__name__)
    items = get_args(kind)
    if get_origin(kind) is Sequence or Ellipsis in items:
        return f"tuple of {type_name(items[0])}"
    return f"({', '.join(map(type_name, items))})"
