"""What README and documentation show works: a page is played from top to bottom, in an empty folder.

Its files are written, its programs run in one namespace, its commands run in small form: a tenth of the
trials of one root, episodes of three iterations. Commands whose comment says that they take minutes, or need
what is not here, and those within sentences, are read by their own parsers only.
"""

import argparse
import functools
import os
import re
import sys
import tomllib
from collections.abc import Callable, Hashable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import tyro
from support.documented import PAGES, Command, blocks, commands, inline_commands
from support.mrclam_folder import write_run
from support.project_files import ROOT

from baselines import evaluate, merge
from baselines.evaluation import jobs
from baselines.evaluation.episodes import Episode, run_episodes
from wifipgo.command import bench, front
from wifipgo.scenarios import SCENARIOS, Scenario, lookup

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
TARGETS = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE))
N_STEPS = 3
MORE = {  # said last, which wins
    "evaluate": ("--executor", "serial"),
    "reproduce": ("--executor", "serial"),
    "watch": ("--until", "2"),
}
OF_A_SHELL = {"git", "cd", "export", "python3"}
WRITTEN_BY_A_RUN = {"claims.md", "fig_radio.md", "real.md", "sensitivity.md"}
# Commands that need nothing of their page, of which each is run once.
ANYWHERE = {"describe", "optimise", "recordings", "reproduce"}
done: set[tuple[str, ...]] = set()
# Pages of frameworks that are not here have programs of their own.
played = [page for page in PAGES if blocks(page)]


class Understood(BaseException):
    """The command line was read, and nothing was done."""


@contextmanager
def only_read(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Let commands end where their command line has been read."""
    cli, parse_args = tyro.cli, argparse.ArgumentParser.parse_args

    def read(what: Callable[..., Any], *args: Any, **options: Any) -> Any:
        with monkeypatch.context() as inner:
            inner.setattr(argparse.ArgumentParser, "parse_args", parse_args)
            stub = what if isinstance(what, type) else functools.wraps(what)(lambda *_, **__: None)
            cli(stub, *args, **options)
        raise Understood

    def read_plainly(self: argparse.ArgumentParser, *args: Any, **options: Any) -> Any:
        parse_args(self, *args, **options)
        raise Understood

    with monkeypatch.context() as patched:
        patched.setattr(tyro, "cli", read)
        patched.setattr(argparse.ArgumentParser, "parse_args", read_plainly)
        yield


def small(words: Sequence[str]) -> list[str]:
    """The same command with a tenth of the work, in this process."""
    words = list(words)
    for k, word in enumerate(words[:-1]):
        if word in {"--trials", "--trials-from"}:
            words[k + 1] = str(-(-int(words[k + 1]) // 10))
        elif word == "--roots":
            words[k + 1] = "1"
    return [*words, *MORE.get(words[0], ())]


def start(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run or read a command, whichever program it is of."""
    program, *words = command.words
    assert program in {"wifipgo", "make", "pip", "python", *OF_A_SHELL}, f"{program}: a program of no test"
    if program == "make":
        targets = {word for word in words if "=" not in word}
        assert targets <= TARGETS, words
    elif program == "pip":
        assert words[0] == "install"
        extras = {extra for found in re.findall(r"\[(.*?)\]", " ".join(words)) for extra in found.split(",")}
        assert extras <= set(PROJECT["optional-dependencies"])
    elif program == "python" and words[0].endswith(".py"):
        code = (ROOT / words[0]).read_text("utf-8")
        asked = {word[2:].replace("-", "_") for word in words if word.startswith("--")}
        assert asked <= set(re.findall(r"^    (\w+): ", code, re.MULTILINE)), words
    elif program == "python":
        assert words[0] == "-m"
        read_module(words[1], words[2:], monkeypatch)
    elif program == "wifipgo" and (command.long or tuple(words) in done):
        read(words, monkeypatch)
    elif program == "wifipgo":
        run(words)
        done.update({tuple(words)} if words[0] in ANYWHERE else ())


def run(words: Sequence[str]) -> None:
    """Run a subcommand; a benchmark leaves as a program does."""
    try:
        code: object = front.main(small(words))
    except SystemExit as left:
        code = left.code
    assert code == 0, words


def read(words: Sequence[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the command's parser read the line, whatever files are not there."""
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.setattr(sys, "argv", [*sys.argv])
    monkeypatch.delitem(
        sys.modules, f"benchmarks.{'.'.join(words[1:2])}", raising=False
    )  # which other tests import
    with only_read(monkeypatch), pytest.raises((Understood, SystemExit)) as ended:
        sys.exit(front.main(words))  # what answers by itself, a list say, has no parser
    assert getattr(ended.value, "code", 0) == 0, words


def read_module(module: str, words: Sequence[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """The same for a module of ours that is no subcommand."""
    if module == "wifipgo":
        read(words, monkeypatch)
    elif module == "pytest":
        assert (ROOT / words[0]).exists()
    else:
        pytest.importorskip("ray")
        main = __import__(module, fromlist=["main"]).main
        with only_read(monkeypatch), pytest.raises(Understood):
            main(words)


def short_episodes() -> Callable[..., list[Episode]]:
    """Plays episodes of three iterations, and the same ones again for every variant of a scenario."""
    there: dict[Hashable, list[Episode]] = {}

    def play(scenario: Scenario, policy: str, seeds: Sequence[int], **options: Any) -> list[Episode]:
        key = (scenario.n_robots, policy, *seeds, *map(str, options.values()))
        if key not in there:
            there[key] = run_episodes(scenario.with_overrides(n_steps=N_STEPS), policy, seeds, **options)
        return there[key]

    return play


@functools.cache
def short_scenarios() -> dict[str, Scenario]:
    """All that come with the package, of three iterations."""
    return {name: scenario.with_overrides(n_steps=N_STEPS) for name, scenario in SCENARIOS.items()}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to work in, beside which the checkout's files are where commands look for them."""
    monkeypatch.chdir(tmp_path)
    for command in (evaluate, merge):
        monkeypatch.setattr(command, "draw", lambda *_: None)  # pictures have tests of their own
    monkeypatch.setattr(lookup, "SCENARIOS", dict(short_scenarios()))
    monkeypatch.setattr(jobs, "run_episodes", short_episodes())
    monkeypatch.setattr(os, "environ", dict(os.environ))
    for name in ("examples", "train"):
        (tmp_path / name).symlink_to(ROOT / name)
    write_run(tmp_path / "data" / "mrclam6")  # in place of a recording, which the project does not have
    return tmp_path


@pytest.mark.parametrize("page", played, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_a_page_works(page: Path, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    namespace: dict[str, Any] = {"__name__": "__main__"}
    for block in blocks(page):
        if block.file:
            (folder / block.file).write_text(block.text, encoding="utf-8")
        elif block.language == "python":
            exec(compile(block.text, page.name, "exec"), namespace)
        elif block.language == "sh":
            for command in commands(block.text):
                start(command, monkeypatch)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_commands_within_sentences_are_understood(
    page: Path, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for command in inline_commands(page):
        if command.words[1:] not in {(name,) for name in front.SUBCOMMANDS}:  # not just its name
            start(command._replace(long=True), monkeypatch)


def test_no_command_hides_in_a_block_of_no_language() -> None:
    """Neither in a fence without a language nor in an indented block, but where a program wrote the page."""
    for page in PAGES:
        plain = [block.text for block in blocks(page) if not block.language]
        text = page.read_text(encoding="utf-8")
        indented = "" if page.name in WRITTEN_BY_A_RUN else text
        assert not re.search(r"^(wifipgo|python|make|pip) ", "\n".join(plain), re.MULTILINE), page
        assert not re.search(r"\n\n    (wifipgo|python|make|pip) ", indented), page


def test_benchmarks_are_all_listed() -> None:
    page = (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8")
    assert set(re.findall(r"`wifipgo bench (\w+)`", page)) == set(bench.benchmarks(ROOT))
