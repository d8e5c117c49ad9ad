"""The class or the function that a policy's text names in a module or a file, and a digest of its source."""

import importlib
import importlib.util
import itertools
import sys
from collections.abc import Callable, Iterator
from hashlib import sha256
from pathlib import Path
from types import ModuleType
from typing import Any

from baselines.policies.own_errors import told
from baselines.policies.specs import Spec
from wifipgo.errors import BadInputError, UnknownNameError, require

_OURS = frozenset({"wifipgo", "envs", "baselines", "train"})
_INSTALLED = frozenset({"site-packages", "dist-packages"})
_INIT = "__init__.py"


def own_maker(spec: Spec) -> Callable[..., Any]:
    """The class or function that makes a policy.

    Raises:
        BadInputError: No such module, file or name in it (the message lists the classes it has), something
            that cannot be called, or code that raises when it is loaded.
    """
    module = _module_of(spec)
    found = getattr(module, spec.name, None) if spec.name else None
    if found is None:
        _see_that_ours_hides_none(spec.where)
        raise UnknownNameError(f"policy in {spec.where}:", spec.name, _makers(module) or ["no class"])
    require(callable(found), f"{spec.where}:{spec.name}", "a class, or a function that makes a policy", found)
    maker: Callable[..., Any] = found
    return maker


def own_digest(spec: Spec) -> str:
    """Digest of the source: of the module, and of those beside it, or in its package, that it uses."""
    module = _module_of(spec)
    file = Path(str(module.__file__))
    root = _root(module, file)
    paths = sorted(set(_sources(module, root, set())) | {file})
    return sha256(b"\0".join(path.read_bytes() for path in paths)).hexdigest()[:16]


def _module_of(spec: Spec) -> ModuleType:
    return _of_file(Path(spec.where)) if spec.is_file else _of_name(spec.where)


def _of_file(path: Path) -> ModuleType:
    """A file as a module, loaded once as long as it stays the same."""
    beside = sorted(p.name for p in path.parent.glob("*.py")) if path.parent.is_dir() else []
    there = (
        f"its folder has {', '.join(beside[:5]) or 'no file .py'}"
        if path.parent.is_dir()
        else "its folder is not"
    )
    rule = f"a file that is there; {there}"
    require(path.is_file(), "policy", rule, str(path))
    path = path.resolve()
    name = f"_{path.stem}_{sha256(bytes(path) + path.read_bytes()).hexdigest()[:16]}"
    top = _package_of(path)
    with told(f"loading {path}"):
        if top is None:
            _findable(path.parent)
            module = _executed(name, path)
        else:
            _findable(top.parent)
            _findable(path.parent)
            _executed(name, top / _INIT, package=True)
            module = importlib.import_module(".".join([name, *path.relative_to(top).with_suffix("").parts]))
    _see_that_its_own_are_found(module, path.parent)
    return module


def _package_of(path: Path) -> Path | None:
    """Folder of the outermost package that a file is in, so that ``from .helper import ...`` works in it."""
    folders = list(itertools.takewhile(lambda folder: (folder / _INIT).is_file(), path.parents))
    return folders[-1] if folders and path.name != _INIT else None


def _executed(name: str, path: Path, *, package: bool = False) -> ModuleType:
    """A file, or a package by its ``__init__.py``, as a module of this name."""
    if name in sys.modules:
        return sys.modules[name]
    inside = [str(path.parent)] if package else None
    made = importlib.util.spec_from_file_location(name, path, submodule_search_locations=inside)
    if made is None or made.loader is None:
        raise BadInputError(f"policy must be a file of Python, got {str(path)!r}")
    module = importlib.util.module_from_spec(made)
    sys.modules[name] = module
    try:
        made.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _see_that_its_own_are_found(module: ModuleType, folder: Path) -> None:
    """Refuse a module that got another folder's ``net.py`` though one is beside it.

    Python keeps one module a name, so that of the policy loaded first would quietly play in both.
    """
    for used in _used(module):
        name, file = used.__name__, Path(getattr(used, "__file__", None) or "/")
        own = [path for path in (folder / f"{name}.py", folder / name / _INIT) if path.is_file()]
        if own and own[0] != file and not _is_ours(used) and _INSTALLED.isdisjoint(file.parts):
            rule = f"{own[0]}; rename one of the two, or give their folders {_INIT} and import .{name} there"
            require(name in sys.stdlib_module_names, f"module {name!r} of {module.__file__}", rule, str(file))


def _of_name(name: str) -> ModuleType:
    """A module that can be imported, also from the current folder."""
    _findable(Path.cwd())
    importlib.invalidate_caches()
    try:
        with told(f"loading module {name}"):
            return importlib.import_module(name)
    except BadInputError as problem:
        missing = problem.__cause__
        absent = isinstance(missing, ModuleNotFoundError) and f"{name}.".startswith(f"{missing.name}.")
        _see_that_ours_hides_none(name)
        rule = f"a module that can be imported from here ({Path.cwd()}), or a file: path/file.py:CLASS"
        require(not absent, "policy", rule, name)
        raise


def _see_that_ours_hides_none(name: str) -> None:
    """Say where a module of the current folder is missed as a package of ours has its name."""
    top, _, _ = name.partition(".")
    mine = [path for path in (Path(f"{top}.py"), Path(top)) if path.exists()]
    if top not in _OURS or not mine:
        return
    if Path(top, _INIT).resolve() != Path(str(importlib.import_module(top).__file__)).resolve():
        hides = f"as {top!r} is a package of wifipgo and hides {mine[0].absolute()}"
        raise BadInputError(f"policy must be a file here, path/file.py:CLASS, {hides}, got {name!r}")


def _findable(folder: Path) -> None:
    """Let what stands in a folder be imported, after everything else: it shadows nothing."""
    if str(folder) not in sys.path:
        sys.path.append(str(folder))


def _makers(module: ModuleType) -> list[str]:
    """Classes that a module defines, and functions where it has no class."""
    mine = {n: v for n, v in vars(module).items() if getattr(v, "__module__", None) == module.__name__}
    return [name for name, value in mine.items() if isinstance(value, type)] or list(mine)


def _root(module: ModuleType, file: Path) -> Path:
    """Folder whose sources count: that of the whole package, or of the file."""
    depth = module.__name__.count(".") + hasattr(module, "__path__")
    return file.parents[max(depth - 1, 0)]


def _sources(module: ModuleType, root: Path, seen: set[str]) -> Iterator[Path]:
    """Files under a folder that a module uses, and that those use; what is installed there does not count."""
    seen.add(module.__name__)
    for other in (used for used in _used(module) if used.__name__ not in seen):
        file = Path(getattr(other, "__file__", None) or "/")
        if file.is_relative_to(root) and _counts(other, file.relative_to(root)):
            yield file
            yield from _sources(other, root, seen)


def _used(module: ModuleType) -> Iterator[ModuleType]:
    """Modules that a module has by name, and those that something in it was defined in."""
    homes = (v if isinstance(v, ModuleType) else _home(v) for v in list(vars(module).values()))
    return (home for home in homes if home is not None)


def _counts(module: ModuleType, path: Path) -> bool:
    return path.suffix == ".py" and _INSTALLED.isdisjoint(path.parts) and not _is_ours(module)


def _is_ours(module: ModuleType) -> bool:
    return module.__name__.partition(".")[0] in _OURS


def _home(value: object) -> ModuleType | None:
    """Module that something was defined in."""
    name = getattr(value, "__module__", None)
    return sys.modules.get(name) if isinstance(name, str) else None
