"""House style that no linter checks: sizes, names, docstrings, chance, no trace of a machine."""

import ast
import re
import subprocess
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import pytest
from support.project_files import FLOORS, ROOT, nodes, python_files, syntax

SHIPPED = (*FLOORS, "benchmarks", "examples")
ALL = (*SHIPPED, "tests")
MAX_FILE_LINES = 300
NAMELESS_ROOMS = {"utils", "util", "common", "helpers", "helper", "core", "misc"}
NAMELESS_ANGLES = {"theta", "phi", "thetas", "phis"}
SEEDED = {"Generator", "BitGenerator", "PCG64", "Philox", "SeedSequence", "default_rng"}
# Neither draws: a state is saved, and put back.
STATES = {"get_state", "set_state"}
# Absolute paths of a machine, and settings or hosts of a package index.
MACHINE = re.compile(r"(?<![\w.~-])/(?:work|home|root|Users|opt)\b(?!-)")
INDEX = re.compile(r"\bpy(?:pi|thonhosted)\.(?:org|io)\b|--(?:(?:extra-)?index-url|find-links)\b")

Function = ast.FunctionDef | ast.AsyncFunctionDef
Documented = Function | ast.ClassDef


def public(body: list[ast.stmt]) -> Iterator[Documented]:
    """Public functions and classes of a module, and the public methods of those classes."""
    for node in body:
        if isinstance(node, Documented) and not node.name.startswith("_"):
            yield node
            if isinstance(node, ast.ClassDef):
                yield from public(node.body)


def bound_names(node: ast.AST) -> list[str]:
    """Names that a node gives to something; names that it only uses are not ours to choose."""
    match node:
        case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef():
            return [node.name]
        case ast.arg():
            return [node.arg]
        case ast.alias() if node.asname:
            return [node.asname]
        case ast.Name(ctx=ast.Store()):
            return [node.id]
        case ast.Attribute(ctx=ast.Store()):
            return [node.attr]
        case _:
            return []


def global_chance(node: ast.AST) -> bool:
    """Whether a node draws from a generator that nobody seeded."""
    match node:
        case ast.Import():
            return any(alias.name == "random" for alias in node.names)
        case ast.ImportFrom(module="random"):
            return True
        case ast.ImportFrom(module="numpy.random"):
            return any(alias.name not in SEEDED for alias in node.names)
        case ast.Attribute(value=ast.Attribute(value=ast.Name(id="np" | "numpy"), attr="random"), attr=name):
            return name not in SEEDED | STATES
        case ast.Call(func=ast.Name(id=name) | ast.Attribute(attr=name), args=args, keywords=keywords):
            given = [*args, *(keyword.value for keyword in keywords)]
            unseeded = not given or (isinstance(given[0], ast.Constant) and given[0].value is None)
            return name == "default_rng" and unseeded
        case _:
            return False


def offenders(rule: Callable[[Path], Iterable[object]], *folders: str) -> dict[str, list[object]]:
    """What a rule finds in the files of some folders, by file; files without a finding are left out."""
    found = {name: list(rule(path)) for name, path in python_files(*folders).items()}
    return {name: things for name, things in found.items() if things}


def test_files_of_tests_are_short() -> None:
    """Sizes of all else are in `house.test_sizes`."""
    lines = {name: path.read_text("utf-8").count("\n") for name, path in python_files("tests").items()}
    assert not {name: count for name, count in lines.items() if count > MAX_FILE_LINES}


def test_public_names_are_documented() -> None:
    def undocumented(path: Path) -> Iterator[str]:
        tree = syntax(path)
        if not ast.get_docstring(tree):
            yield "the module"
        yield from (node.name for node in public(tree.body) if not ast.get_docstring(node))

    assert not offenders(undocumented, *SHIPPED)


def test_angles_have_names() -> None:
    """Azimuth and elevation: the two Greek letters change places from one text to the next."""

    def greek(path: Path) -> set[str]:
        names = {name for node in nodes(path) for name in bound_names(node)}
        return {name for name in names if NAMELESS_ANGLES & set(name.lower().split("_"))}

    assert not offenders(greek, *ALL)


def test_modules_have_names() -> None:
    named = {name: set(Path(name).with_suffix("").parts) for name in python_files(*ALL)}
    assert not [name for name, parts in named.items() if parts & NAMELESS_ROOMS]


def test_chance_is_seeded() -> None:
    def global_draws(path: Path) -> list[str]:
        return [f"line {getattr(node, 'lineno', 0)}" for node in nodes(path) if global_chance(node)]

    assert not offenders(global_draws, *ALL)


def test_annotations_stay_live() -> None:
    """Shapes are checked through annotations, so those must not be turned into strings."""

    def futures(path: Path) -> list[str]:
        imports = [node for node in nodes(path) if isinstance(node, ast.ImportFrom)]
        return [f"line {node.lineno}" for node in imports if node.module == "__future__"]

    assert not offenders(futures, *ALL)


def test_no_trace_of_a_machine() -> None:
    """Nothing that git tracks names a folder of one machine or a package index."""
    listing = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False)
    if listing.returncode != 0:
        pytest.skip("not a git checkout")
    found = []
    for name in filter(None, listing.stdout.split("\0")):
        raw = (ROOT / name).read_bytes() if (ROOT / name).is_file() else b""
        for number, line in enumerate(raw.decode("utf-8", "ignore").splitlines(), 1):
            if b"\0" not in raw and (MACHINE.search(line) or INDEX.search(line)):
                found.append(f"{name}:{number}: {line.strip()[:100]}")
    assert not found, "\n".join(found)


def test_colours_have_names() -> None:
    """One palette: no picture mixes colours of its own."""

    def mixed(path: Path) -> Iterator[str]:
        texts = (node.value for node in nodes(path) if isinstance(node, ast.Constant))
        yield from (t for t in texts if isinstance(t, str) and re.fullmatch(r"#[0-9a-fA-F]{6}", t))

    found = offenders(mixed, *ALL)
    assert set(found) == {"wifipgo/command/palette.py"}
