"""Where the third-party reference data lies; tests that need it are skipped without it."""

import os
from pathlib import Path

import pytest


def data_dir(name: str) -> Path:
    """Folder ``name`` of the data: in ``$WIFIPGO_DATA``, else in ``shared/data`` beside the checkout."""
    beside = Path(__file__).resolve().parents[3] / "shared" / "data"
    folder = Path(os.environ.get("WIFIPGO_DATA", beside)) / name
    if not folder.is_dir():
        pytest.skip(f"no reference data {name!r}: {folder} is not there; set WIFIPGO_DATA")
    return folder
