"""Tables for papers against the numbers that they are made of, and against the grammar of their formats."""

import csv
import re
from pathlib import Path

import pytest

from baselines.evaluation.paper_tables import as_csv, as_latex, as_markdown, check_tables, latex_text
from baselines.evaluation.plan import Plan
from baselines.evaluation.rows import Row
from baselines.evaluation.statistics import FIGURES, Estimate, Paired, Summary
from baselines.policies.registry import specs_of
from wifipgo.errors import BadInputError
from wifipgo.scenarios import scenario_named

NOBODY = Estimate(0.0, None, None)
N_BETTER = 7  # figures of which more is better, or less
NAMES = ("active", "a_b & 50 % | [x]", "random")


def plan_of(names: tuple[str, ...]) -> Plan:
    specs = specs_of([f"'{name}'=random" for name in names])
    return Plan(scenario=scenario_named("paper-hw-2"), specs=specs, trials=3, seed=0)


def summary_of(plan: Plan) -> Summary:
    """Every figure of policy k is k + 1, but for rendezvous, which nobody had."""
    policies = {
        name: {f: Estimate(k + 1.0, k + 0.5, k + 1e-5) for f in FIGURES} | {"rendezvous": NOBODY}
        for k, name in enumerate(plan.policies)
    }
    paired = Paired(
        n_pairs=3,
        score_difference=Estimate(-1.0, -2.0, 1e-5),
        err_ratio=Estimate(2.0, 1.0, 3.0),
        ate_trans_difference=Estimate(None, None, None),
        ate_rot_difference=Estimate(0.5, None, None),
    )
    return Summary(
        scenario="paper-hw-2",
        trials=3,
        seed=0,
        reference=plan.reference,
        intervals="",
        units=FIGURES,
        policies=policies,
        paired={n: paired for n in plan.policies if n != plan.reference},
        warnings=plan.warnings,
    )


def cells(line: str, separator: str) -> list[str]:
    """Cells of a line; an escaped separator is text."""
    inside = line.strip("| ").removesuffix("\\\\")
    return [cell.strip() for cell in re.split(rf"(?<!\\){re.escape(separator)}", inside)]


def test_csv_holds_every_number_of_the_summary() -> None:
    plan = plan_of(NAMES)
    summary = summary_of(plan)
    rows = list(csv.DictReader(as_csv(summary, plan).splitlines()))
    assert [(row["policy"], row["figure"]) for row in rows] == [(p, f) for p in NAMES for f in FIGURES]
    for row in rows:
        estimate = summary.policies[row["policy"]][row["figure"]]
        assert [float(row[k]) if row[k] else None for k in ("mean", "low", "high")] == [
            estimate.value,
            estimate.low,
            estimate.high,
        ]
    mine = {row["figure"]: row for row in rows if row["policy"] == "random"}
    score, err, ate = (mine[figure] for figure in ("mapped_share", "err_last10", "ate_trans"))
    assert (score["reference"], score["compared"]) == ("active", "difference")
    assert float(score["value_high"]) == 1e-5
    assert (err["compared"], float(err["value"])) == ("ratio", 2.0)
    assert (ate["compared"], ate["value"]) == ("difference", "")


def test_markdown_has_one_cell_a_policy_and_the_best_in_bold() -> None:
    plan = plan_of(NAMES)
    head, rule, *lines = as_markdown(summary_of(plan), plan).splitlines()
    assert cells(head, "|")[-3:] == ["active", r"a\_b & 50 % \| \[x\]", "random"]
    table = [cells(line, "|") for line in (rule, *lines) if line.startswith("|")]
    assert {len(row) for row in table} == {4}
    bold = {row[0]: [k for k, cell in enumerate(row) if "**" in cell] for row in table}
    assert bold["score: mapped share"] == [3]
    assert bold["Err, last 10 iterations"] == [1]
    assert bold["rendezvous"] == []
    assert "3 trials: with fewer than 10" in lines[-1]


@pytest.mark.parametrize(
    ("values", "best"),
    [
        ((0.5, 0.5 + 1e-12, 0.2), {0, 1}),
        ((0.5, 0.5 + 1e-12), set()),
        ((0.5, None, 0.2), {0}),
        ((None, None), set()),
        ((0.5,), set()),
    ],
)
def test_what_is_printed_the_same_is_as_good(values: tuple[float | None, ...], best: set[int]) -> None:
    """An optimum a rounding error better than another is not the only one in bold."""
    row = Row("share", [Estimate(value, None, None) for value in values], better=1)
    assert row.best == best


@pytest.mark.parametrize("names", [NAMES, tuple("abcdef")])
def test_latex_is_well_formed(names: tuple[str, ...]) -> None:
    """Every row has the cells of the head, groups and formulas close, and no sign of LaTeX's own is left."""
    plan = plan_of(names)
    text = as_latex(summary_of(plan), plan)
    assert r"\usepackage{booktabs}" in text.splitlines()[0]
    code = "\n".join(line for line in text.splitlines() if not line.startswith("%"))
    columns = re.search(r"\\begin\{tabular\}\{(l r*)\}".replace(" ", ""), code)
    assert columns is not None
    rows = [line for line in code.splitlines() if line.endswith(r"\\")]
    assert {len(cells(row, "&")) for row in rows} == {len(columns[1])}
    assert all(row.startswith(("{", " &")) for row in rows)
    plain = re.sub(r"\\.", "", code)
    assert plain.count("{") == plain.count("}")
    assert plain.count("$") % 2 == 0
    outside = re.sub(r"\$[^$]*\$", "", plain)
    assert not set("_%#^~") & set(outside)
    assert code.count(r"\mathbf{") == N_BETTER
    assert r"1.00\times 10^{-5}" in code


def test_signs_of_latex_are_spelled_out() -> None:
    assert latex_text("a_b ~5% {x} & \\y^2") == (
        r"{a\_b \textasciitilde{}5\% \{x\} \& \textbackslash{}y\textasciicircum{}2}"
    )


def test_tables_that_could_not_be_written_are_refused(tmp_path: Path) -> None:
    out, there = tmp_path / "out", tmp_path / "there.md"
    there.write_text("mine")
    for paths, message in {
        (tmp_path / "a.docx",): "unknown kind of file for table '.docx'; known: .csv, .md, .tex",
        (tmp_path / "none" / "a.md",): "table must be in a folder that exists",
        (there,): "table must be new",
        (tmp_path / "a.md", tmp_path / "x" / ".." / "a.md"): "table must be given once each",
    }.items():
        with pytest.raises(BadInputError) as refused:
            check_tables(paths, out, overwrite=False)
        assert message in str(refused.value)
    check_tables([out / "a.tex", tmp_path / "b.CSV"], out, overwrite=False)
    check_tables([there], out, overwrite=True)
