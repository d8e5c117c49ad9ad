"""Learned policies on the same environment.

The names below load what they need, torch among it, when they are asked for: importing `train` does not.
"""

import importlib
import sys
from typing import TYPE_CHECKING, Any

try:  # first: Ctrl-C ends a command that loads; and names of packages may be taken by others
    from wifipgo.command.own_packages import check_floors
except ImportError as problem:
    shadow = getattr(sys.modules.get("wifipgo"), "__file__", None) or "another package"
    advice = "rename it, or work in another folder"
    raise ImportError(f"{shadow} shadows the package 'wifipgo': {advice}") from problem

check_floors("wifipgo", "envs", "baselines")

if TYPE_CHECKING:
    from train._config import EnvsConfig, TrainConfig
    from train._config_files import read_yaml
    from train._interface_env import TranslatedEnv
    from train._rollouts import environments
    from train._vec_env import TeamVecEnv, rendezvous_vec_env

__all__ = [
    "EnvsConfig",
    "TeamVecEnv",
    "TrainConfig",
    "TranslatedEnv",
    "environments",
    "read_yaml",
    "rendezvous_vec_env",
]

_HOMES = {
    "EnvsConfig": "_config",
    "TeamVecEnv": "_vec_env",
    "TrainConfig": "_config",
    "TranslatedEnv": "_interface_env",
    "environments": "_rollouts",
    "read_yaml": "_config_files",
    "rendezvous_vec_env": "_vec_env",
}


def __getattr__(name: str) -> Any:
    """A public name, from the module that has it."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"train.{_HOMES[name]}"), name)
