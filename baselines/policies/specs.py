"""Policies with parameters as text: ``active:err_threshold=0.5``."""

import inspect
import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from wifipgo.coerce import fitted, settings
from wifipgo.errors import UnknownNameError


def split_spec(spec: str) -> tuple[str, dict[str, Any]]:
    r"""Name and parameters of ``name:key=value:key=value``.

    A colon separates only where ``key=`` follows, so paths with a time or a drive letter need
    no quotes; in quotes, single or double, a value may hold anything: ``ppo:path='C:\\a=b:c.npz'``.
    """
    name, *pairs = _split(spec.strip(), _NEXT_PARAMETER)
    return name, settings(pairs)


def split_list(specs: str, known: Iterable[str]) -> tuple[str, ...]:
    """Specs of a list ``a,b:key=value,c``: a comma separates only where a known name follows.

    Where nothing known follows, and no parameter is before it, it separates too: a name that is
    not known is refused where the policy is made, not taken for a part of the last.
    """
    names = "|".join(map(re.escape, sorted(known, key=len, reverse=True)))
    parts = _split(specs, re.compile(rf",(?=\s*(?:(?:{names})\s*(?:[:,]|$)|$))"))
    plain = [piece for part in parts for piece in (part.split(",") if ":" not in part else [part])]
    return tuple(piece.strip() for piece in plain if piece.strip())


def _split(text: str, separator: re.Pattern[str]) -> list[str]:
    """Split where a separator stands outside of quotes; these stay."""
    places, quote = [], ""
    for at, sign in enumerate(text):
        if quote:
            quote = "" if sign == quote else quote
        elif sign in "'\"" and text[at - 1 : at] == "=":
            quote = sign
        elif separator.match(text, at):
            places.append(at)
    begins, ends = [0, *(at + 1 for at in places)], [*places, len(text)]
    return [text[begin:end] for begin, end in zip(begins, ends, strict=True)]


_NEXT_PARAMETER = re.compile(r":(?=\s*[A-Za-z_]\w*\s*=|\s*$|[^/\\\d][^/\\:]*$)")


def parameters_of(policy: Callable[..., object]) -> dict[str, Any]:
    """Parameters that a policy takes besides the scenario, with their defaults."""
    found = inspect.signature(policy).parameters
    return {name: found[name].default for name in found if name != "scenario"}


def fitting(policy: str, parameters: Mapping[str, Any], known: Mapping[str, Any]) -> dict[str, Any]:
    """Check parameters against those that a policy takes; an int stands for a float.

    Raises:
        ValueError: An unknown name (the message lists the known), or a value of another type.
    """
    return {
        name: _fitting(f"{policy}:{name}", value, _default(policy, name, known))
        for name, value in parameters.items()
    }


def _default(policy: str, name: str, known: Mapping[str, Any]) -> Any:
    if name not in known:
        raise UnknownNameError(f"parameter of policy {policy!r}:", name, known or ["none"])
    return known[name]


def _fitting(name: str, value: Any, default: Any) -> Any:
    free = default is None or default is inspect.Parameter.empty
    return value if free else fitted(value, type(default), name)
