"""Scenarios as text: TOML files with flat keys or tables, and values written as TOML.

This module knows text and names; what a scenario is stands in `wifipgo.scenarios`.
"""

import json
import re
import tomllib
import warnings
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from wifipgo.errors import BadInputError, quoted, require
from wifipgo.files.text_files import read_text
from wifipgo.scenarios.letters import check_field, field_of, require_once

SUFFIX = ".toml"
BASE = "base"
MOST_BYTES = 2**24
_FORMER_TABLE = {"graph": "rendezvous"}  # of keys that stood in another part, for one version
_DECIMAL_COMMA = re.compile(r"(?m)^[^#\n\"\'\[\]]*=\s*[-+]?\d+,\d+\s*(?:#.*)?$")
# A dotted key of 32 parts or more: the parser's time grows with their number squared.
_LONG_KEY = re.compile(r"""(?<![\w.-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){32}""")


def read_toml(path: Path) -> dict[str, Any]:
    """Tables and keys of a file.

    Raises:
        BadInputError: It is not TOML, or nested too deep; the message names the file and the place in it.
        OSError: It cannot be read.
    """
    text = read_text(path, most_bytes=MOST_BYTES)
    if _LONG_KEY.search(text):
        raise BadInputError(f"{path} is not TOML: nested too deep")
    try:
        return tomllib.loads(text)
    except (RecursionError, MemoryError):
        raise BadInputError(f"{path} is not TOML: nested too deep") from None
    except ValueError as problem:
        raise BadInputError(f"{path} is not TOML: {problem}{_hint(text)}") from problem


def _hint(text: str) -> str:
    """What is probably meant where a number has a decimal comma."""
    found = _DECIMAL_COMMA.search(text)
    return f"; numbers have a decimal point, got {quoted(found[0].strip())}" if found else ""


def flattened(values: Mapping[str, Any], owners: Mapping[str, str], where: str) -> dict[str, Any]:
    """Fields without their tables; a key stands at the top or in the table of the part that holds it.

    Args:
        values: Keys and tables.
        owners: Part that holds each field, '' for the scenario itself.
        where: File, for messages.

    Raises:
        ValueError: A table or key that does not exist, a key in another's table, or one given twice.
    """
    tables = sorted({part for part in owners.values() if part})
    flat: dict[str, Any] = {}
    spelled: dict[str, str] = {}
    for table, written, value in _entries(values, tables, where):
        key = field_of(written)
        if key not in owners:
            here = [name for name, part in owners.items() if table in {"", part}]
            known = [*here, *tables, BASE] if table == "" else here
            check_field(written, known, _place(table, where))
        require_once(f"{key} in {where}", spelled.setdefault(key, written), written)
        home = f"at the top of {where}" + (f" or in its table [{owners[key]}]" if owners[key] else "")
        if table and table == _FORMER_TABLE.get(owners[key]):
            _warn_of_former_table(key, table, owners[key], where)
        else:
            require(table in {"", owners[key]}, key, home, f"[{table}]")
        require(key not in flat, key, f"given once in {where}", f"[{table}]" if table else key)
        flat[key] = value
    return flat


def _warn_of_former_table(key: str, table: str, now: str, where: str) -> None:
    """Say to whoever wrote the file where a key belongs now."""
    message = f"{key} in {where}, table [{table}], belongs to [{now}]; the next version refuses it there"
    warnings.warn(message, FutureWarning, stacklevel=2)


def _entries(values: Mapping[str, Any], tables: Iterable[str], where: str) -> Iterator[tuple[str, str, Any]]:
    """Table ('' for the top), key and value of everything but the base."""
    for key, value in values.items():
        if key in tables and isinstance(value, Mapping):
            yield from ((key, inner, content) for inner, content in value.items())
        elif key in tables:
            require(False, f"{key} in {where}", f"a table, [{key}]", value)
        elif key != BASE:
            yield "", key, value


def _place(table: str, where: str) -> str:
    return f"key in {where}" + (f", table [{table}]:" if table else ":")


def toml_text(values: Mapping[str, Any]) -> str:
    """Values as TOML: what is no mapping first, then a table for each mapping."""
    top = [_line(key, value) for key, value in values.items() if not isinstance(value, Mapping)]
    tables = ((key, table) for key, table in values.items() if isinstance(table, Mapping))
    rest = [f"\n[{key}]\n" + "".join(map(_line, table, table.values())) for key, table in tables]
    return "".join([*top, *rest])


def _line(key: str, value: Any) -> str:
    """A key and its value; a table of rows has a line for each."""
    if isinstance(value, list | tuple) and any(isinstance(row, list | tuple) for row in value):
        rows = "".join(f"  {_literal(row)},\n" for row in value)
        return f"{key} = [\n{rows}]\n"
    return f"{key} = {_literal(value)}\n"


def _literal(value: Any) -> str:
    """One value; every float is written so that it reads back to the same bits."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):  # JSON escapes all that TOML does, but DEL
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, int | float):
        return repr(value + 0)  # numpy's scalars print as calls
    return f"[{', '.join(map(_literal, value))}]"
