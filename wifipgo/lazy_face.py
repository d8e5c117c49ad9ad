"""A package whose names load what they need when they are asked for (PEP 562)."""

import importlib
import sys
from collections.abc import Callable, Mapping
from importlib.util import find_spec

from wifipgo.former_names import of_face


def face(package: str, homes: Mapping[str, str]) -> tuple[Callable[[str], object], Callable[[], list[str]]]:
    """``__getattr__`` and ``__dir__`` of a package.

    Args:
        package: Its name.
        homes: Names of its face, and the module below it that each is in; the first time that one is asked
            for it becomes an attribute like any other. Its modules and former names answer as well.
    """
    former = of_face(package)

    def attribute(name: str) -> object:
        """What a name means."""
        if name in homes:
            found = getattr(importlib.import_module(f"{package}.{homes[name]}"), name)
            setattr(sys.modules[package], name, found)
            return found
        if not name.startswith("_") and find_spec(f"{package}.{name}") is not None:
            return importlib.import_module(f"{package}.{name}")
        return former(name)

    def names() -> list[str]:
        """All that can be asked for without a warning."""
        return sorted({*vars(sys.modules[package]), *homes})

    return attribute, names
