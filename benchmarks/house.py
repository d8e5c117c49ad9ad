"""Sizes of the house beside its limits: files, functions, classes, parameters, private imports.

    python -m benchmarks.house            # the table, and who is over
    python -m benchmarks.house --largest  # the five largest of each

What `tests/house/test_sizes.py` excepts, with the reason, is shown too.
"""

import argparse
import ast
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
FLOORS = ("wifipgo", "envs", "baselines", "train")
FOLDERS = (*FLOORS, "benchmarks", "examples")
CONFIGURATION = ("Config", "Scenario")  # last words of names of classes that are configuration
Function = ast.FunctionDef | ast.AsyncFunctionDef


class Size(NamedTuple):
    """How large something is, and where it stands."""

    where: str
    size: int


class Rule(NamedTuple):
    """What is counted, the most that it may be, and what was found."""

    what: str
    most: float
    found: list[Size]

    def over(self) -> list[Size]:
        """What is larger than it may be."""
        return [size for size in self.found if size.size > self.most]


def modules(folders: Sequence[str] = FOLDERS) -> dict[str, ast.Module]:
    """Syntax trees of the Python files of some folders, by their path in the project."""
    paths = sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))
    return {path.relative_to(ROOT).as_posix(): ast.parse(path.read_text("utf-8")) for path in paths}


def body_lines(function: Function) -> int:
    """Lines from the first statement after the docstring to the last."""
    body = function.body[1:] if ast.get_docstring(function) is not None else function.body
    return (function.end_lineno or 0) - body[0].lineno + 1 if body else 0


def parameters(function: Function) -> int:
    """Parameters that a caller can give; what a method is called on is none."""
    args = function.args
    names = [arg.arg for arg in (*args.posonlyargs, *args.args, *args.kwonlyargs)]
    return len([name for name in names if name not in {"self", "cls"}])


def attributes(node: ast.ClassDef) -> int:
    """Fields of a tuple or dataclass, and what methods set on ``self``."""
    fields = {
        of.target.id for of in node.body if isinstance(of, ast.AnnAssign) and isinstance(of.target, ast.Name)
    }
    own = {
        of.attr
        for of in ast.walk(node)
        if isinstance(of, ast.Attribute) and isinstance(of.ctx, ast.Store)
        if isinstance(of.value, ast.Name) and of.value.id == "self"
    }
    return len(fields | own)


def private_imports(name: str, tree: ast.Module) -> Iterator[str]:
    """Modules with an underscore that a file imports from outside of the package that they are in."""
    package = name.rsplit("/", 1)[0].replace("/", ".")
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            wholes = [f"{node.module}.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.Import):
            wholes = [alias.name for alias in node.names]
        else:
            continue
        yield from (whole for whole in wholes if _is_private(whole, package))


def _is_private(whole: str, package: str) -> bool:
    """Whether an import goes through an underscored module of another package."""
    parts = whole.split(".")
    if parts[0] not in FOLDERS:
        return False
    at = next((n for n, part in enumerate(parts) if part.startswith("_") and not part.startswith("__")), None)
    if at is None or not _is_module(parts[: at + 1]):
        return False
    owner = ".".join(parts[:at])
    return package != owner and not package.startswith(owner + ".")


def _is_module(parts: Sequence[str]) -> bool:
    """Whether a dotted name is a file or folder of the project."""
    path = ROOT.joinpath(*parts)
    return path.with_suffix(".py").is_file() or path.is_dir()


def _lines(names: Mapping[str, ast.Module]) -> list[Size]:
    """Lines of files."""
    return [Size(name, (ROOT / name).read_text("utf-8").count("\n")) for name in names]


def rules(trees: Mapping[str, ast.Module]) -> list[Rule]:
    """All figures of some modules."""
    nodes = [(name, node) for name, tree in trees.items() for node in ast.walk(tree)]
    functions = [(f"{name}:{node.name}", node) for name, node in nodes if isinstance(node, Function)]
    classes = [(f"{name}:{node.name}", node) for name, node in nodes if isinstance(node, ast.ClassDef)]
    private = [f"{name} imports {one}" for name, tree in trees.items() for one in private_imports(name, tree)]
    lines = _lines(trees)
    return [
        Rule("lines of a file, median", 120, [Size("", int(median(size.size for size in lines)))]),
        Rule("lines of a file", 300, lines),
        Rule("lines of a function's body", 30, [Size(where, body_lines(node)) for where, node in functions]),
        Rule("parameters of a function", 7, [Size(where, parameters(node)) for where, node in functions]),
        Rule(
            "attributes of a class that is no configuration",
            10,
            [Size(where, attributes(node)) for where, node in classes if not where.endswith(CONFIGURATION)],
        ),
        Rule("imports of private modules of other packages", 0, [Size(where, 1) for where in private]),
    ]


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--largest", action="store_true", help="show the five largest of each")
    chosen = parser.parse_args()
    found = rules(modules())
    for rule in found:
        largest = max((size.size for size in rule.found), default=0)
        print(f"{rule.what:48} {largest:5} of at most {rule.most:.0f}; {len(rule.over())} over")
        ranked = sorted(rule.found, key=lambda size: -size.size)
        for size in ranked[:5] if chosen.largest else rule.over():
            print(f"    {size.size:5} {size.where}")


if __name__ == "__main__":
    main()
