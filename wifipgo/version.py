"""The version of the package: of what is installed, else of the checkout that is run."""

import tomllib
from importlib import metadata
from pathlib import Path


def version() -> str:
    """Version of ``wifipgo``: from its installation, in a bare checkout from ``pyproject.toml``."""
    try:
        return metadata.version("wifipgo")
    except metadata.PackageNotFoundError:
        with (Path(__file__).parents[1] / "pyproject.toml").open("rb") as file:
            return str(tomllib.load(file)["project"]["version"])
