"""What an installed wheel has: every module and everything that a module reads, and nothing else."""

import subprocess

import pytest
from support.packaged_files import packaged_files
from support.project_files import FLOORS, ROOT, python_files


def test_every_module_is_in_it() -> None:
    assert set(python_files(*FLOORS)) == {name for name in packaged_files() if name.endswith(".py")}


def test_everything_beside_the_modules_is_in_it() -> None:
    """Settings, trained policies, example data: whatever git keeps in the packages' folders."""
    listing = subprocess.run(
        ["git", "ls-files", "-z", *FLOORS], cwd=ROOT, capture_output=True, text=True, check=False
    )
    if listing.returncode != 0:
        pytest.skip("not a git checkout")
    assert set(filter(None, listing.stdout.split("\0"))) - packaged_files() == set()


def test_nothing_else_is_in_it() -> None:
    assert {name.split("/")[0] for name in packaged_files()} == set(FLOORS)
