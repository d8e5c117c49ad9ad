"""Files of a user's own policies: what stands beside them, in packages, and behind names that are taken."""

from pathlib import Path

import pytest

from baselines.policies import make_policy
from baselines.policies.own_source import own_maker
from baselines.policies.registry import source_digest, specs_of
from wifipgo.errors import BadInputError
from wifipgo.scenarios import scenario_named

SCENARIO = scenario_named("paper-sim-2")
OWN = """
import numpy as np

class Plain:
    def __init__(self, gain=0.5):
        self.gain = gain
    def act(self, observations):
        return {robot: np.array([self.gain, 0.0, 1.0]) for robot in observations}
"""


def test_code_beside_a_policy_counts_as_its_source(tmp_path: Path) -> None:
    (tmp_path / "beside_of_own.py").write_text("GAIN = 1\n")
    (tmp_path / "own.py").write_text("from beside_of_own import GAIN\nimport beside_of_own, numpy\n" + OWN)
    (one,) = specs_of([f"{tmp_path}/own.py:Plain"])
    before = source_digest(one)
    (tmp_path / "beside_of_own.py").write_text("GAIN = 2\n")
    assert source_digest(one) != before


def test_a_file_in_a_package_has_what_stands_beside_it(tmp_path: Path) -> None:
    """Relative imports work as in any package, each copy of which is its own, and so is its source."""
    for version, gain in {"v1": 0.1, "v2": 0.7}.items():
        inner = tmp_path / version / "mine" / "inner"
        inner.mkdir(parents=True)
        (inner / "__init__.py").touch()
        (inner.parent / "__init__.py").touch()
        (inner.parent / "net.py").write_text(f"GAIN = {gain}\n")
        head = "from ..net import GAIN\nfrom .. import net\n"
        (inner / "own.py").write_text(f"{head}{OWN}\nclass Late(Plain):\n    gain = GAIN\n")
    names = [f"{tmp_path}/{version}/mine/inner/own.py:Late" for version in ("v1", "v2")]
    first, second = specs_of(names)
    assert [own_maker(spec).gain for spec in (first, second)] == [0.1, 0.7]  # type: ignore[attr-defined]
    before = source_digest(first)
    (tmp_path / "v1" / "mine" / "net.py").write_text("GAIN = 0.2\n")
    assert source_digest(first) != before


def test_the_helper_of_another_folder_is_not_taken_for_ones_own(tmp_path: Path) -> None:
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "helper_of_two.py").write_text("GAIN = 1\n")
        (tmp_path / folder / "own.py").write_text(
            f"from helper_of_two import GAIN\nimport helper_of_two\n{OWN}"
        )
    make_policy(f"{tmp_path}/one/own.py:Plain", SCENARIO)
    with pytest.raises(
        BadInputError, match=r"helper_of_two' of .*two/own.py must be .*two/helper_of_two.py; rename"
    ):
        make_policy(f"{tmp_path}/two/own.py:Plain", SCENARIO)


@pytest.mark.parametrize("name", ["train:Mine", "train.mine:Mine"])
def test_a_module_that_ours_hides_is_named(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "train.py").write_text(OWN)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(
        BadInputError, match=r"must be a file here.* 'train' is a package of wifipgo and hides .*train.py"
    ):
        make_policy(name, SCENARIO)
