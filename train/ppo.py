"""Train a policy with shared parameters: ``wifipgo train --config train/configs/paper-sim-2.yaml``.

The trainer itself is `train.training`, loaded once the settings are read: torch is slow to load, or absent.
"""

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from rich.console import Console

from baselines.evaluation.command import exit_code
from wifipgo.command.extras import load_extra

if TYPE_CHECKING:
    from train.training import Run, digest, train

__all__ = ["Run", "digest", "main", "train"]


def _load(*modules: str) -> None:
    """Load packages of the extra, matplotlib under our settings before any of them loads it."""
    import wifipgo.command.figures  # noqa: F401, PLC0415 (torch's users load matplotlib, which refuses some back-ends)

    load_extra("wifipgo train", "train", *modules)


def _job(args: Sequence[str] | None, console: Console) -> None:
    """Read the settings, then load what trains, then train."""
    from train._config_files import parsed  # noqa: PLC0415

    config = parsed(args)
    _load("yaml", "torch", "stable_baselines3", "tensorboard", "cloudpickle")
    from train.training import train  # noqa: PLC0415

    train(config, console=console)


def __getattr__(name: str) -> Any:
    """What trains, loaded when it is asked for."""
    if name in ("Run", "digest", "train"):
        _load("torch", "stable_baselines3")
        from train import training  # noqa: PLC0415

        return getattr(training, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def main(args: Sequence[str] | None = None) -> int:
    """Run from the command line; 0 done, 2 refused, 130 interrupted."""
    kept = "interrupted; with a checkpoint saved, the same command with --resume continues from the last"
    return exit_code(lambda console: _job(args, console), interrupted=kept)


if __name__ == "__main__":
    sys.exit(main())
