"""Make a policy of a class or a function and parameters, which are checked against what it takes."""

import inspect
from collections.abc import Callable, Mapping
from typing import Any

from wifipgo.coerce import fitted
from wifipgo.errors import BadInputError, UnknownNameError
from wifipgo.scenarios import Scenario

_SCENARIO = "scenario"
_CHECKED = (bool, int, float, str, tuple)  # types of defaults that say what a value has to be
_MANY = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)


def arguments(
    policy: str, make: Callable[..., object], parameters: Mapping[str, Any], scenario: Scenario
) -> dict[str, Any]:
    """Keywords to call a class or a function with: the parameters, and the scenario if it asks for it.

    Args:
        policy: Its name, for messages.
        make: What is going to be called.
        parameters: As they were given.
        scenario: What is played.

    Raises:
        BadInputError: An unknown parameter (the message lists the known), a value of another type than its
            default, or none for one that has no default.
    """
    found = _parameters(make)
    known = {name: p.default for name, p in found.items() if name != _SCENARIO and p.kind not in _MANY}
    anything = any(p.kind is inspect.Parameter.VAR_KEYWORD for p in found.values())
    given = {
        name: _fitting(f"{policy}:{name}", value, _default(policy, name, known, anything=anything))
        for name, value in parameters.items()
    }
    lacking = [name for name, default in known.items() if default is inspect.Parameter.empty]
    for name in lacking:
        if name not in given:
            raise BadInputError(f"policy {policy} must be given {name}: {policy}:{name}=VALUE, got nothing")
    return ({_SCENARIO: scenario} if _SCENARIO in found else {}) | given


def _parameters(make: Callable[..., object]) -> Mapping[str, inspect.Parameter]:
    """Parameters of a call; none where Python cannot tell."""
    try:
        return inspect.signature(make).parameters
    except ValueError:
        return {}


def _default(policy: str, name: str, known: Mapping[str, Any], *, anything: bool) -> Any:
    if name not in known and not anything:
        raise UnknownNameError(f"parameter of policy {policy!r}:", name, known or ["none"])
    return known.get(name)


def _fitting(name: str, value: Any, default: Any) -> Any:
    """A value of the type of its default; an int stands for a float."""
    return fitted(value, type(default), name) if type(default) in _CHECKED else value
