"""Policies with parameters as text: ``active:err_threshold=0.5``."""

import inspect
from collections.abc import Callable, Mapping
from typing import Any

from wifipgo.errors import UnknownNameError
from wifipgo.settings import fitted, key_value


def split_spec(spec: str) -> tuple[str, dict[str, Any]]:
    """Name and parameters of ``name:key=value:key=value``."""
    name, *pairs = spec.strip().split(":")
    return name, dict(map(key_value, pairs))


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
