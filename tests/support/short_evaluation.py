"""A short evaluation: four iterations, two policies, three trials, in this process."""

from dataclasses import replace
from pathlib import Path

from baselines.evaluate import EvaluateConfig

SHORT = ("n_steps=4",)


def short(out: Path, **changes: object) -> EvaluateConfig:
    """Its settings, with changes."""
    config = EvaluateConfig(trials=3, overrides=SHORT, out=out, jobs=1)
    return replace(config, **changes)  # type: ignore[arg-type]
