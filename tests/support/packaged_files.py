"""Files of a wheel, by the rules of pyproject.toml: without building one."""

import functools
import tomllib

from support.project_files import ROOT


@functools.cache
def packaged_files() -> frozenset[str]:
    """Modules and package data, by path in the checkout; a package has ``__init__`` at every level."""
    rules = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["setuptools"]
    tops = [pattern.removesuffix("*") for pattern in rules["packages"]["find"]["include"]]
    found = set()
    for init in (path for top in tops for path in (ROOT / top).rglob("__init__.py")):
        package = init.parent.relative_to(ROOT)
        if all((ROOT / folder / "__init__.py").is_file() for folder in (package, *package.parents[:-1])):
            patterns = ["*.py", *rules["package-data"].get(".".join(package.parts), [])]
            found |= {path for pattern in patterns for path in init.parent.glob(pattern) if path.is_file()}
    return frozenset(path.relative_to(ROOT).as_posix() for path in found)
