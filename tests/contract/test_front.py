"""The command ``wifipgo``: a quick table of subcommands, blind to what the current folder holds."""

import os
import shlex
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

from wifipgo.command import bench, checkout
from wifipgo.command.extras import find_extra
from wifipgo.command.front import SUBCOMMANDS, help_text, main
from wifipgo.errors import MissingExtraError
from wifipgo.version import version

ROOT = Path(__file__).parents[2]
SLOW = ("numpy", "rich", "tyro", "pandas", "matplotlib", "torch", "envs", "baselines", "train")
# What `pip install` writes as bin/wifipgo: its folder comes first among those that are searched.
SCRIPT = "import sys\nfrom wifipgo.command.front import main\nsys.exit(main())\n"
SHADOWS = ("envs/__init__.py", "train.py", "baselines.py")


def python(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run Python in a folder; the project is found as if it were installed."""
    env = os.environ | {"PYTHONPATH": str(ROOT), "COLUMNS": "110"}
    command = [sys.executable, *words]
    return subprocess.run(command, cwd=folder, env=env, capture_output=True, text=True, check=False)


@pytest.fixture
def shadowed(tmp_path: Path) -> Path:
    """A folder in which a user keeps modules of the same names."""
    folder = tmp_path / "own work"
    for name in SHADOWS:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text("raise SystemExit('the module of the user ran')\n", encoding="utf-8")
    return folder


@pytest.fixture
def script(tmp_path: Path) -> Path:
    """The console command."""
    path = tmp_path / "bin" / "wifipgo"
    path.parent.mkdir()
    path.write_text(SCRIPT, encoding="utf-8")
    return path


def test_help_lists_every_command_and_loads_nothing_slow(tmp_path: Path) -> None:
    program = "import sys; from wifipgo.command.front import main; main(['--help']); "
    done = python(tmp_path, "-c", f"{program}print(set({SLOW}) & sys.modules.keys())")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines()[-1] == "set()"
    places = [done.stdout.index(f"\n  {name} ") for name in SUBCOMMANDS]
    assert places == sorted(places)
    assert max(map(len, help_text().splitlines())) <= 110


@pytest.mark.parametrize("name", SUBCOMMANDS)
def test_every_command_teaches(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """It names itself as it was called, and shows a line to copy."""
    with suppress(SystemExit):  # of the parser, which most of them have
        main(["help", name])
    usage, *others = capsys.readouterr().out.splitlines()
    assert usage.startswith(f"usage: wifipgo {name} ")
    assert any(f"wifipgo {name} " in line for line in others)
    assert not any("python -m" in line for line in others)


@pytest.mark.parametrize("words", [[], ["-h"], ["--help"], ["help"]])
def test_without_a_command_there_is_help(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words) == 0
    assert capsys.readouterr().out == help_text() + "\n"


def test_it_says_its_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"wifipgo {version()}\n"


@pytest.mark.parametrize(
    ("word", "meant"), [("evalute", "evaluate"), ("Watch", "watch"), ("optimize", "optimise"), ("--sed", "")]
)
def test_an_unknown_command_is_refused(word: str, meant: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([word, "--help"]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"error: unknown command {word!r}; known: ")
    assert all(name in said for name in SUBCOMMANDS)
    assert said.endswith(f"; did you mean {meant!r}?\n" if meant else "watch\n")
    assert said.count("\n") == 1


def test_the_current_folder_changes_nothing(shadowed: Path, script: Path) -> None:
    """Neither as a command, even where that is searched first, nor as a module."""
    (shadowed / "rich.py").write_text("raise SystemExit('the module of the user ran')\n", encoding="utf-8")
    module = python(shadowed, "-m", "wifipgo", "describe", "--list")
    assert (module.returncode, module.stderr) == (0, "")
    assert "paper-hw-2-obstacles" in module.stdout
    (shadowed / "wifipgo.py").write_text("raise SystemExit('the module of the user ran')\n")
    command = python(shadowed, str(script), "--version")
    assert (command.returncode, command.stdout) == (0, f"wifipgo {version()}\n")


def test_its_packages_come_first_wherever_else_is_searched(shadowed: Path) -> None:
    """Policies of the user's may need the current folder; a process that a command starts has it too."""
    found = "; print(*sorted(envs.__path__))"
    program = f"import sys; sys.path.insert(0, ''); import wifipgo.command.front; import envs{found}"
    done = python(shadowed, "-c", program)
    assert done.stdout.strip() == str(ROOT / "envs"), done.stderr


@pytest.mark.parametrize(
    ("shadow", "module"),
    [
        ("envs/__init__.py", "baselines.watch"),
        ("envs.py", "baselines.evaluate"),
        ("baselines/__init__.py", "train.ppo"),
    ],
)
def test_old_forms_say_what_shadows_them(shadow: str, module: str, tmp_path: Path) -> None:
    (tmp_path / shadow).parent.mkdir(exist_ok=True)
    (tmp_path / shadow).write_text("", encoding="utf-8")
    done = python(tmp_path, "-m", module, "--help")
    name = shadow.removesuffix("/__init__.py")
    said = f"error: {tmp_path / name} shadows the package {name.removesuffix('.py')!r} of wifipgo"
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(said)
    assert "rename it" in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("shadow", ["envs.py", "wifipgo.py"])
def test_programs_are_told_what_shadows_a_package(shadow: str, tmp_path: Path) -> None:
    (tmp_path / shadow).write_text("", encoding="utf-8")
    (tmp_path / "mine.py").write_text("import baselines\n", encoding="utf-8")
    done = python(tmp_path, "mine.py")
    last = done.stderr.splitlines()[-1]
    assert last.startswith(f"ImportError: {tmp_path / shadow} shadows the package '{shadow[:-3]}'")
    assert "rename it" in last


@pytest.mark.parametrize("line", ["from envs import rendezvous_v0", "import envs.rendezvous_v0"])
def test_what_only_the_shadowed_package_has_is_missed_with_a_reason(line: str, tmp_path: Path) -> None:
    """As soon as wifipgo is there; what nobody has is missing as ever."""
    (tmp_path / "envs").mkdir()
    (tmp_path / "envs" / "__init__.py").write_text("", encoding="utf-8")
    (tmp_path / "mine.py").write_text(
        "import wifipgo\ntry:\n    import envs.nothing\nexcept ModuleNotFoundError as missing:\n"
        f"    print(missing)\n{line}\n",
        encoding="utf-8",
    )
    done = python(tmp_path, "-S", "mine.py")  # without what an installation for development finds
    assert done.stdout == "No module named 'envs.nothing'\n"
    said = f"ImportError: {tmp_path / 'envs'} shadows the package 'envs' of wifipgo"
    assert done.stderr.splitlines()[-1].startswith(said)


def test_benchmarks_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench"]) == 0
    printed = capsys.readouterr().out
    for path in (ROOT / "benchmarks").glob("[a-z]*.py"):
        is_program = 'if __name__ == "__main__"' in path.read_text("utf-8")
        assert (f"\n  {path.stem} " in printed) == is_program, path
    assert main(["bench", "sped"]) == 2
    assert "did you mean 'speed'?" in capsys.readouterr().err


def test_a_benchmark_is_run_with_its_options(tmp_path: Path) -> None:
    """As a program of its own, whose exit code counts; one of the current folder is another."""
    (tmp_path / "benchmarks").mkdir()
    lines = ("import sys", 'if __name__ == "__main__":', '    print(sys.argv[1:], "numpy" in sys.modules)')
    text = "\n".join((*lines, "    sys.exit(7)\n"))
    (tmp_path / "benchmarks" / "__init__.py").touch()
    (tmp_path / "benchmarks" / "own.py").write_text(text, encoding="utf-8")
    program = (
        "import sys, pathlib; from wifipgo.command import bench; "
        f"bench.checkout = lambda: pathlib.Path({str(tmp_path)!r}); sys.exit(bench.main(['own', '--fast']))"
    )
    done = python(tmp_path.parent, "-c", program)
    assert (done.returncode, done.stdout) == (7, "['--fast'] False\n"), done.stderr


def test_without_a_checkout_there_are_no_benchmarks(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(bench, "checkout", lambda: None)
    assert main(["bench"]) == 2
    said = capsys.readouterr().err
    assert said == "error: the benchmarks come with a checkout of wifipgo, not with the installed package\n"


def test_lines_to_copy_are_quoted_and_find_this_python(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    binaries = tmp_path / ".venv" / "bin"
    binaries.mkdir(parents=True)
    for name in ("python", "wifipgo"):
        (binaries / name).write_text("", encoding="utf-8")
        (binaries / name).chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(binaries / "python"))
    words = ("evaluate", "--out", "a b")
    assert checkout.recorded(*words) == "wifipgo evaluate --out 'a b'"
    assert checkout.runnable(*words) == ".venv/bin/wifipgo evaluate --out 'a b'"
    monkeypatch.setenv("PATH", str(binaries))
    assert checkout.runnable(*words) == "wifipgo evaluate --out 'a b'"
    (binaries / "wifipgo").unlink()
    assert checkout.runnable(*words) == "python -m wifipgo evaluate --out 'a b'"
    assert checkout.install_line("train") == shlex.join(
        ["python", "-m", "pip", "install", "-e", f"{ROOT}[train]"]
    )


@pytest.mark.parametrize("there", [True, False])
def test_the_line_that_installs_an_extra_fits_the_installation(
    there: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a checkout that is installed from there; elsewhere by the package's name."""
    monkeypatch.setattr(checkout, "ROOT", tmp_path)
    if there:
        (tmp_path / "pyproject.toml").write_text('[project]\nname = "wifipgo"\n', encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    words = shlex.split(checkout.install_line("rllib"))
    assert words[-1] == (".[rllib]" if there else "wifipgo[rllib]")
    assert ("-e" in words) is there


def test_an_extra_is_named_with_its_line() -> None:
    with pytest.raises(MissingExtraError) as refusal:
        find_extra("a film", "video", "no_such_module.inside")
    assert str(refusal.value).endswith(f"the extra 'video' with {checkout.install_line('video')}")
