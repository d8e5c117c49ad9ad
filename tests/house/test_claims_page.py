"""docs/claims.md and the README's table are what the generator makes of docs/claims.json."""

import json
from typing import Any

import pytest
from support.project_files import ROOT

from baselines.reproduce._figures import FIGURES
from baselines.reproduce._page import BEGIN, page, with_summary
from baselines.reproduce._run import documented_picture

DOCS = ROOT / "docs"


@pytest.fixture(scope="module")
def claims() -> dict[str, Any]:
    """What the last run found."""
    found: dict[str, Any] = json.loads((DOCS / "claims.json").read_text(encoding="utf-8"))
    return found


def test_the_page_is_generated(claims: dict[str, Any]) -> None:
    assert (DOCS / "claims.md").read_text(encoding="utf-8") == page(claims, documented_picture)


def test_the_readme_shows_the_verdicts(claims: dict[str, Any]) -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert BEGIN in readme
    assert readme == with_summary(readme, claims["figures"])


def test_every_figure_is_there_with_its_picture_and_run(claims: dict[str, Any]) -> None:
    assert list(claims["figures"]) == list(FIGURES)
    ran = {name: of for name, of in claims["figures"].items() if of["run"]}
    assert len(ran) >= 6
    for name, of in ran.items():
        assert (DOCS / documented_picture(name)).stat().st_size < 250_000
        assert of["run"]["command"].startswith(f"wifipgo reproduce {name} ")
        assert len(of["run"]["date"]) == len("2026-01-01")
        assert of["claims"]


def test_no_verdict_rests_on_one_root(claims: dict[str, Any]) -> None:
    for name, of in claims["figures"].items():
        assert len(of["run"]["roots"]) >= 8, name
        assert of["run"]["trials"] in {0, 10, 60}, name
        assert not {claim["verdict"] for claim in of["claims"]} & {"not run", "too few trials"}, name
