"""docs/frameworks.md names every framework that the benchmark has, in the versions that are pinned."""

import re

import pytest
from support.project_files import ROOT

from benchmarks._framework_programs import FRAMEWORKS

PAGE = (ROOT / "docs" / "frameworks.md").read_text(encoding="utf-8")
CELLS = [[cell.strip() for cell in row.split("|")] for row in re.findall(r"^\| (.*) \|$", PAGE, re.MULTILINE)]
RUN = {row[0].lower(): row for row in CELLS if len(row) == 5}
PINNED = dict(re.findall(r"^([\w-]+)==(\S+)$", (ROOT / "constraints.txt").read_text("utf-8"), re.MULTILINE))
CALLED = {"ray": "rllib"}


@pytest.mark.parametrize("package", [framework.package for framework in FRAMEWORKS.values()])
def test_a_framework_has_its_row(package: str) -> None:
    _, version, glue, how, result = RUN[CALLED.get(package, package)]
    assert glue == "none"
    assert how
    assert result
    if version and package in PINNED:
        assert PINNED[package] in version.split(", ")
