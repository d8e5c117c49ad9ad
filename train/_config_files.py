"""Settings of a training run from a YAML file and the command line, and their record."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields, is_dataclass, replace
from pathlib import Path
from typing import Any, get_type_hints

import tyro

from train._config import TrainConfig
from wifipgo.coerce import fitted
from wifipgo.command.checkout import recorded
from wifipgo.command.docstrings import documented
from wifipgo.command.extras import load_extra
from wifipgo.errors import BadInputError, UnknownNameError, pick, require

# What may change when a run is continued; ``ppo.agent_steps`` says how far to go.
_FREE = {"out", "overwrite", "resume", "config", "ppo.agent_steps", "envs.n_workers"}
_FREE |= {"selection.every", "selection.trials", "selection.policies", "selection.seed"}
_KEY = "key"
_SHIPPED = Path(__file__).parent / "configs"
_HERE = ("out", "overwrite", "resume", "config")


def parsed(args: Sequence[str] | None = None, *, prog: str = "wifipgo train") -> TrainConfig:
    """Read the command line; a YAML file stands in for the defaults.

    Raises:
        ValueError: A key or value that is refused; the message names the file.
        OSError: The file cannot be read.
        SystemExit: The command line is not understood, or asks for help.
    """
    config = tyro.cli(documented(TrainConfig), prog=prog, args=args)
    if config.config is None:
        return config
    return tyro.cli(
        documented(TrainConfig), prog=prog, args=args, default=read_yaml(settings_file(config.config))
    )


def settings_file(path: Path) -> Path:
    """The file that is meant: one that ships may be called by its name, or as in a checkout, from anywhere.

    Raises:
        ValueError: A name without an ending that none of ours has.
    """
    if path.exists() or path.parent not in (Path(), Path("train/configs")):
        return path
    shipped = {file.stem: file for file in _SHIPPED.glob("*.yaml")}
    return shipped.get(path.stem, path) if path.suffix else pick(shipped, path.name, "training settings")


def read_yaml(path: Path) -> TrainConfig:
    """Settings in a file; what it does not name has its default.

    Raises:
        ValueError: It is not YAML, names a key that does not exist, or a value is refused.
        MissingExtraError: The extra ``train`` is not installed.
        OSError: It cannot be read.
    """
    load_extra("a training file", "train", "yaml")
    from train._yaml import read_settings  # noqa: PLC0415 (so that --help does without the extra)

    values, lines = read_settings(path)
    try:
        return _filled(TrainConfig(), values, "")
    except UnknownNameError as problem:
        if problem.kind != _KEY:
            raise BadInputError(f"{_place(path, lines, str(problem))}: {problem}") from problem
        raise UnknownNameError(f"key in {path}:", problem.name, problem.known) from problem
    except ValueError as problem:
        raise BadInputError(f"{_place(path, lines, str(problem))}: {problem}") from problem


def _place(path: Path, lines: Mapping[str, int], message: str) -> str:
    """File, and the line of the key that a message names first."""
    found = {key: re.search(rf"(?<![\w.]){re.escape(key)}(?![\w.])", message) for key in lines}
    named = [(place.start(), -len(key), key) for key, place in found.items() if place]
    return f"{path}:{lines[min(named)[-1]]}" if named else str(path)


def _filled(default: Any, values: Mapping[str, Any], where: str) -> Any:
    """Copy of a dataclass with the values of a file; tables fill its parts."""
    kinds = get_type_hints(type(default))
    known = [f.name for f in fields(default) if where or f.name not in _HERE]
    new: dict[str, Any] = {}
    for key, value in values.items():
        if key not in known:
            raise UnknownNameError(_KEY, f"{where}{key}", [f"{where}{name}" for name in known])
        part = getattr(default, key)
        if is_dataclass(part):
            require(isinstance(value, Mapping), f"{where}{key}", "a table of keys and values", value)
            new[key] = _filled(part, value, f"{where}{key}.")
        else:
            new[key] = fitted(value, kinds[key], f"{where}{key}")
    return replace(default, **new)


def record_of(config: TrainConfig) -> dict[str, Any]:
    """All settings that a file may hold, as plain values."""
    values = asdict(config)
    return _plain({name: value for name, value in values.items() if name not in _HERE})


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _plain(inner) for key, inner in value.items()}
    return list(value) if isinstance(value, tuple) else value


def changed_fields(there: Mapping[str, Any], here: Mapping[str, Any]) -> list[str]:
    """Settings in which two records differ although they shape what is learned, with both values.

    What a record does not name was no setting yet when it was written, and did what is the default now.
    """
    default = _flat(record_of(TrainConfig()))
    old, new = (default | _flat(record) for record in (there, here))
    names = sorted((old.keys() | new.keys()) - _FREE)
    return [
        f"{name} ({old.get(name)!r} there, {new.get(name)!r} now)"
        for name in names
        if old.get(name) != new.get(name)
    ]


def _flat(values: Mapping[str, Any], above: str = "") -> dict[str, Any]:
    out: dict[str, Any] = {}
    for key, value in values.items():
        out |= _flat(value, f"{above}{key}.") if isinstance(value, Mapping) else {f"{above}{key}": value}
    return out


def command_of(config: TrainConfig) -> str:
    """Command line that runs a configuration again, from the record that the run keeps."""
    return recorded("train", "--config", str(config.out / "config.yaml"), "--out", "OTHER")
