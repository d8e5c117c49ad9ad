"""Versions of what a training depends on."""

import platform
from importlib import metadata

from wifipgo.version import version

_PACKAGES = ("numpy", "gtsam", "pymunk", "pettingzoo", "gymnasium", "stable-baselines3", "torch")


def versions() -> dict[str, str]:
    """Python's and each package's, those that are not installed left out."""
    found = {"python": platform.python_version(), "wifipgo": version()}
    for name in _PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found
