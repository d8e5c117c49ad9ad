"""The version of the package: of the checkout that is run, else of what is installed."""

import tomllib

from wifipgo.command.checkout import checkout


def version() -> str:
    """Version of ``wifipgo``: in a checkout that of ``pyproject.toml``; an installation may be older."""
    root = checkout()
    if root is None:
        from importlib import metadata  # noqa: PLC0415 (takes longer to load than all of ``wifipgo --help``)

        return metadata.version("wifipgo")
    with (root / "pyproject.toml").open("rb") as file:
        return str(tomllib.load(file)["project"]["version"])


def __getattr__(name: str) -> str:
    """``__version__``, found when it is asked for."""
    if name == "__version__":
        return version()
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
