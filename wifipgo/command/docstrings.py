"""Docstrings that people read while the program runs: help texts and tables of fields.

``python -OO`` drops docstrings, and a dataclass without one gets its signature instead. They are
then taken from the source.
"""

import ast
import inspect
import sys
import textwrap
from collections.abc import Callable
from dataclasses import is_dataclass
from typing import Any, TypeVar, get_type_hints

T = TypeVar("T", bound=Callable[..., Any])
_DROPS = 2  # from which level of optimisation the interpreter keeps none


def docstring_of(thing: Callable[..., Any]) -> str:
    """Docstring of a class or function; empty if there is none, or no source to take it from."""
    if sys.flags.optimize < _DROPS:
        return thing.__doc__ or ""
    try:
        source = textwrap.dedent(inspect.getsource(thing))
    except (OSError, TypeError):
        return ""
    definition = ast.parse(source).body[0]
    kinds = (ast.ClassDef, ast.FunctionDef)
    return (ast.get_docstring(definition, clean=False) or "") if isinstance(definition, kinds) else ""


def documented(command: T) -> T:
    """A function or class that a command line is made from, its docstrings there, and those of its parts."""
    if sys.flags.optimize >= _DROPS:
        command.__doc__ = docstring_of(command)
        if is_dataclass(command):
            for part in get_type_hints(command).values():
                if is_dataclass(part) and isinstance(part, type):
                    documented(part)
    return command
