"""Floors and wings: an import only goes down, and two libraries stay in one room each."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest
from support.project_files import FLOORS, ROOT, nodes, python_files

import train

ONLY_IMPORTER = {"pymunk": "wifipgo/world/arena.py", "gtsam": "wifipgo/graph/solvers/"}
WITH_PRIVATE = (*FLOORS, "benchmarks")
LEARNING = {"gymnasium", "pettingzoo", "stable_baselines3", "torch", "ray"}
CONTRACTS = (
    "import importlinter.cli as lint; raise SystemExit(lint.lint_imports(no_cache=True, no_logo=True))"
)


def imported(path: Path) -> set[str]:
    """Top-level names of everything that a module imports, wherever in it."""
    found = list(nodes(path))
    plain = {alias.name for node in found if isinstance(node, ast.Import) for alias in node.names}
    whole = {node.module for node in found if isinstance(node, ast.ImportFrom) and node.module}
    return {name.split(".")[0] for name in plain | whole}


def test_import_contracts_hold() -> None:
    """The contracts of pyproject.toml: four floors, three wings."""
    command = [sys.executable, "-c", CONTRACTS]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr


@pytest.mark.parametrize("library", ONLY_IMPORTER)
def test_one_place_imports_the_library(library: str) -> None:
    importers = [name for name, path in python_files(*FLOORS).items() if library in imported(path)]
    assert not [name for name in importers if not name.startswith(ONLY_IMPORTER[library])]


def test_library_knows_no_learning() -> None:
    found = {name: LEARNING & imported(path) for name, path in python_files("wifipgo").items()}
    assert not {name: libraries for name, libraries in found.items() if libraries}


def private_imports(name: str, path: Path) -> list[str]:
    """Modules with an underscore that a file imports from another folder than its own."""
    folder = tuple(name.split("/")[:-1])
    found = []
    for node in nodes(path):
        modules = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom) and node.module:
            modules = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        for parts in (tuple(module.split(".")) for module in modules):
            private = [k for k, part in enumerate(parts) if part.startswith("_")]
            if parts[0] in WITH_PRIVATE and private and parts[: private[0]] != folder:
                found.append(".".join(parts))
    return found


def test_private_modules_are_imported_in_their_own_folder_only() -> None:
    files = python_files(*WITH_PRIVATE, "examples")
    found = {name: private_imports(name, path) for name, path in files.items()}
    assert not {name: modules for name, modules in found.items() if modules}


def test_pages_name_no_private_module_to_import() -> None:
    """What a user is told to import has a public name."""
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    told = re.compile(r"^\s*(?:from|import) (?:\w+\.)*_(?!_)\w+.*$|`train\._(?!yaml)\w+", re.MULTILINE)
    found = {page.name: told.findall(page.read_text(encoding="utf-8")) for page in pages}
    assert not {name: lines for name, lines in found.items() if lines}


def test_the_library_loads_neither_tables_nor_pictures_nor_learning() -> None:
    """Its face and wings, and what they need; a name of the face loads no more than that."""
    modules = "wifipgo, wifipgo.world, wifipgo.radio, wifipgo.graph, wifipgo.loop, wifipgo.scenarios"
    heavy = LEARNING | {"pandas", "matplotlib", "pyarrow", "rich", "tyro"}
    code = f"import sys; import {modules}; [getattr(wifipgo, name) for name in wifipgo.__all__]"
    code = f"{code}; print(sorted({heavy} & sys.modules.keys()))"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_the_face_loads_what_is_asked_for() -> None:
    """Modules below it are found as before, without an import of their own."""
    code = "import sys, wifipgo; print('numpy' in sys.modules, wifipgo.scenarios.__name__, *dir(wifipgo))"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    loaded, module, *names = done.stdout.split()
    assert (loaded, module) == ("False", "wifipgo.scenarios")
    assert {"Scenario", "solve", "__version__"} <= set(names)


def test_importing_train_loads_no_torch() -> None:
    """Its public names do, when they are asked for; a name that does not exist is an AttributeError."""
    code = "import sys, train; assert not hasattr(train, 'TeamVec'); assert 'torch' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)
    assert all(hasattr(train, name) for name in train.__all__)
