"""One short training for all tests that read its results."""

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from train.training import Run


@pytest.fixture(scope="session")
def done(tmp_path_factory: pytest.TempPathFactory) -> "Run":
    """A run that imitated, then improved, to its end."""
    pytest.importorskip("stable_baselines3")
    from support.short_training import taught  # noqa: PLC0415

    return taught(tmp_path_factory.mktemp("train") / "done")
