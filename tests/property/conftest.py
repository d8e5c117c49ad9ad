"""A synthetic run of the WSR toolbox, written once, and copies of it to be damaged."""

import shutil
from pathlib import Path

import pytest
from support.synthetic_run import SPOTS_M, write_run


@pytest.fixture(scope="session")
def synthetic_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A receiver that moves and three transmitters."""
    folder = tmp_path_factory.mktemp("recordings") / "synthetic"
    write_run(folder, transmitters_m=SPOTS_M, seed=1)
    return folder


@pytest.fixture
def damaged(synthetic_run: Path, tmp_path: Path) -> Path:
    """A copy of the run, to be damaged."""
    return shutil.copytree(synthetic_run, tmp_path / "run")
