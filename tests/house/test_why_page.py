"""What the documentation says of why a policy wins is what a command wrote there."""

from support.project_files import ROOT

from baselines.conduct.page import PAGE, is_as_made


def test_no_figure_is_typed_by_hand() -> None:
    assert is_as_made((ROOT / "docs" / PAGE).read_text("utf-8"))
