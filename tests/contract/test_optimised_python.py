"""``python -O`` and ``-OO`` change nothing: commands explain themselves and refuse, episodes end alike."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from support import said_and_done

from wifipgo.command.docstrings import docstring_of

ROOT = Path(__file__).parents[2]


def test_nothing_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    """-OO drops asserts, as -O does, and docstrings besides."""
    monkeypatch.setenv("COLUMNS", "100")
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-OO", "-W", "ignore", said_and_done.__file__]
    process = subprocess.Popen(command, cwd=ROOT, env=env, stdout=subprocess.PIPE, text=True)
    here = said_and_done.said_and_done()
    output, _ = process.communicate()
    there = json.loads(output)
    assert there.keys() == here.keys()
    assert there == here
    for name in said_and_done.COMMANDS:
        code, shown, _ = here[name]
        assert code == 0
        assert "usage" in str(shown)
    assert all(here[" ".join(words)][0] == 2 for words in said_and_done.REFUSED)


def test_a_docstring_is_that_of_the_source() -> None:
    assert docstring_of(docstring_of).startswith("Docstring of a class or function")
    assert docstring_of(lambda: None) == ""
