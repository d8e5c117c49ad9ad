"""docs/environment.md says what the code does."""

import inspect
import re
from pathlib import Path

import pytest

from envs import rendezvous_v0
from envs._describe_tables import layout_markdown

PAGE = (Path(__file__).parents[2] / "docs" / "environment.md").read_text(encoding="utf-8")


def test_the_layout_is_that_of_the_code() -> None:
    table = re.search(r"<!-- layout:.*?-->\n(.*?)\n<!-- end of layout -->", PAGE, re.DOTALL)
    assert table
    assert table[1] == layout_markdown(), "write envs._describe_tables.layout_markdown() into the page"


@pytest.mark.parametrize("name", rendezvous_v0.REWARDS)
def test_every_reward_is_explained(name: str) -> None:
    assert re.search(rf"^\| `{name}`", PAGE, re.MULTILINE)


def test_every_argument_and_its_default_is_there() -> None:
    for name, argument in inspect.signature(rendezvous_v0.parallel_env).parameters.items():
        if argument.kind is not inspect.Parameter.VAR_KEYWORD:
            row = re.search(rf"^\| `{name}` \| (.*?) \|", PAGE, re.MULTILINE)
            assert row, name
            default = str(argument.default).strip("'")
            assert row[1].strip('`"') in {default, "of the scenario"}, name


def test_every_info_is_named() -> None:
    env = rendezvous_v0.parallel_env()
    for name in env.reset(seed=0)[1]["robot_0"]:
        assert f"`{name.removesuffix('_truth')}`" in PAGE, name
