"""Types and shapes of every call in a test run, at less than half the price.

``--jaxtyping-packages`` writes ``@jaxtyping.jaxtyped(typechecker=...)`` before each function of the project.
That decorator binds the arguments, checks them, calls, and checks arguments and answer again; and it compiles
three functions for each one that is imported. The one below checks arguments and answer once, with the same
memory of shapes, and compiles what is called.
"""

import dataclasses
import functools
from collections.abc import Callable
from typing import Any

import jaxtyping
from beartype import BeartypeConf, beartype

CONTEXT = jaxtyping.jaxtyped
CHECKED = beartype(conf=BeartypeConf(violation_type=TypeError))


def checked(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, which raises `TypeError` for arguments or an answer that are not as it says."""
    typed: Callable[..., Any] | None = None

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        nonlocal typed
        __tracebackhide__ = True
        if typed is None:
            typed = CHECKED(function)
        with CONTEXT("context"):
            return typed(*args, **kwargs)

    return call


def checked_class(cls: type) -> type:
    """The class; a dataclass is made of checked fields. Methods have been seen to one by one."""
    if dataclasses.is_dataclass(cls) and "__init__" in vars(cls):
        cls.__init__ = checked(cls.__init__)  # type: ignore[method-assign]
    return cls


def checked_thing(thing: Any) -> Any:
    """What the import hook may decorate: a function or a class."""
    return checked_class(thing) if isinstance(thing, type) else checked(thing)


def jaxtyped(*, typechecker: object) -> Callable[[Any], Any]:
    """Stands in for `jaxtyping.jaxtyped`, as the import hook calls it."""
    return checked_thing


def install() -> None:
    """From here on the import hook decorates so."""
    jaxtyping.jaxtyped = jaxtyped  # type: ignore[assignment]
