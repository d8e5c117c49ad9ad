"""What an installed wheel has: every module and everything that a module reads, and nothing else."""

import os
import re
import subprocess
import tomllib

import pytest
from support.packaged_files import packaged_files
from support.project_files import FLOORS, ROOT, python_files

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
WORKFLOW = ROOT / ".github" / "workflows" / "ci.yml"


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


def test_its_description_needs_nothing_beside_it() -> None:
    """A page of a package index has no files of the project: links and pictures are whole addresses."""
    text = (ROOT / PROJECT["readme"]).read_text("utf-8")
    targets = re.findall(r"\]\(([^)]*)\)|(?:src|href)=\"([^\"]*)\"", text)
    assert not [one for pair in targets for one in pair if one and not one.startswith(("https://", "#"))]


def test_pythons_of_the_classifiers_are_those_that_are_checked() -> None:
    """One list: what is said of the package, what the forge runs."""
    said = re.findall(r"Python :: (3\.\d+)'", str(PROJECT["classifiers"]))
    assert f">={said[0]}" == PROJECT["requires-python"]
    (matrix,) = re.findall(r"python: \[(.*)\]", WORKFLOW.read_text("utf-8"))
    assert re.findall(r"\"(.*?)\"", matrix) == said


def test_the_forges_file_is_yaml_with_known_targets() -> None:
    """Every step that is ours is a target of the Makefile or a script in .ci."""
    yaml = pytest.importorskip("yaml")
    workflow = yaml.safe_load(WORKFLOW.read_text("utf-8"))
    assert workflow["jobs"].keys() == {"lint", "tests", "docs", "wheel"}
    targets = set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE))
    runs = [
        step["run"].split() for job in workflow["jobs"].values() for step in job["steps"] if "run" in step
    ]
    assert len(runs) == len(workflow["jobs"])
    for program, word, *_ in runs:
        assert word in targets if program == "make" else os.access(ROOT / program, os.X_OK)


def test_the_versions_of_a_release_agree() -> None:
    """What the package, its citation and the newest section of the changelog say."""
    newest = re.findall(
        r"^## \[(\d.*?)\] - \d{4}-\d\d-\d\d$", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE
    )[0]
    cited = re.findall(r"^version: (.*)$", (ROOT / "CITATION.cff").read_text("utf-8"), re.MULTILINE)
    assert [PROJECT["version"]] == cited == [newest]
