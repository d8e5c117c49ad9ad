"""How commands end: exit codes, one line on standard error, output that a terminal can take."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from rich.table import Table

from wifipgo.command.command_line import exit_code, printable
from wifipgo.command.terminal import Terminal, say
from wifipgo.errors import BadInputError, DoubtfulError, NumericalError
from wifipgo.files.atomic_files import appearing, write_text
from wifipgo.radio.recordings import __main__ as recordings
from wifipgo.radio.recordings import picture

ROOT = Path(__file__).parents[2]


def raising(problem: BaseException) -> Callable[[], None]:
    def job() -> None:
        raise problem

    return job


@pytest.mark.parametrize(
    ("problem", "code", "said"),
    [
        (DoubtfulError("not converged"), 1, "not converged"),
        (BadInputError("seed must be >= 0, got -1"), 2, "error: seed must be >= 0, got -1"),
        (FileNotFoundError(2, "No such file or directory", "a.g2o"), 2, "error: a.g2o: No such file"),
        (NumericalError("pose 3, edge 7"), 3, "error: pose 3, edge 7"),
        (KeyboardInterrupt(), 130, "interrupted; nothing was written"),
    ],
)
def test_an_end_is_a_code_and_one_line(
    problem: BaseException, code: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert exit_code(raising(problem)) == code
    output, errors = capsys.readouterr()
    assert output == ""
    assert errors.startswith(said)
    assert errors.count("\n") == 1


@pytest.mark.parametrize("n_more", [0, 2])
def test_a_command_that_is_stopped_names_what_it_left(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], n_more: int
) -> None:
    """Each file once, none that is gone again, none of a command before."""
    write_text(tmp_path / "of another", "")
    kept = [tmp_path / f"{k}.txt" for k in range(3)]

    def stopped() -> None:
        for path in (*kept, kept[0], tmp_path / "gone", *(tmp_path / f"more {k}" for k in range(n_more))):
            write_text(path, "whole")
        (tmp_path / "gone").unlink()
        with pytest.raises(KeyboardInterrupt), appearing(tmp_path / "half"):
            raise KeyboardInterrupt
        raise KeyboardInterrupt

    assert exit_code(stopped) == 130
    names = [*map(str, kept), *([f"{tmp_path / 'more 0'} and 1 more"] if n_more else [])]
    assert capsys.readouterr().err == f"interrupted; whole, and kept: {', '.join(names)}\n"


def test_recordings_that_are_stopped_while_they_are_drawn_say_what_is_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def stopped(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(picture, "save_picture", stopped)
    assert recordings.main(["example", "--out", str(tmp_path)]) == 130
    there = sorted(tmp_path.iterdir())
    assert [path.name for path in there] == ["csi.csv", "csi.json"]
    assert capsys.readouterr().err == f"interrupted; whole, and kept: {there[0]}, {there[1]}\n"


@pytest.mark.parametrize(
    "problem", [ValueError("x"), RuntimeError("x"), KeyError("x"), BrokenPipeError(32, "x")]
)
def test_a_defect_is_shown_with_its_traceback(problem: Exception, capsys: pytest.CaptureFixture[str]) -> None:
    assert exit_code(raising(problem)) == 70
    errors = capsys.readouterr().err
    assert errors.startswith("Traceback")
    assert "raise problem" in errors


def test_control_characters_are_spelled_out(capsys: pytest.CaptureFixture[str]) -> None:
    name = "\x1b]0;title\x07\x1b[2J\x9b2J\u202eroom\r\u2028\x7f"
    assert exit_code(raising(BadInputError(name))) == 2
    say(Terminal(), name)
    Terminal().print(name, markup=False)
    output, errors = capsys.readouterr()
    for text in (output, errors, printable(name)):
        assert text.replace("\n", "").isprintable()
        assert r"\x1b]0;title" in text
    assert printable("naïve 部屋\t2 m²\n") == "naïve 部屋\t2 m²\n"


def ended(program: str, *, encoding: str = "utf-8", shell: str = "{}") -> subprocess.CompletedProcess[bytes]:
    """Run a program in a shell's pipeline, with the standard streams of an encoding."""
    head = "import sys; from wifipgo.command.command_line import exit_code, say; "
    head += "from wifipgo.command.terminal import Terminal; "
    command = shell.format(f'"{sys.executable}" -c "$PROGRAM"')
    environment = {"PYTHONPATH": ":".join(sys.path), "PROGRAM": head + program, "PATH": "/bin:/usr/bin"}
    return subprocess.run(
        ["bash", "-c", command],
        capture_output=True,
        check=False,
        env=environment | {"PYTHONIOENCODING": encoding},
    )


@pytest.mark.parametrize("encoding", ["cp1251", "cp932", "ascii"])
def test_what_an_encoding_cannot_show_is_replaced(encoding: str) -> None:
    done = ended("sys.exit(exit_code(lambda: (say('2 m²'), Terminal().print('3 ß'))))", encoding=encoding)
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout.startswith(b"2 m?\n3 ")


@pytest.mark.parametrize("job", ["say('line')", "Terminal().print('line')"])
def test_nobody_reads_and_nothing_is_said(job: str) -> None:
    long = f"sys.exit(exit_code(lambda: [{job} for _ in range(50_000)]))"
    done = ended(long, shell="{} | head -1; exit ${{PIPESTATUS[0]}}")
    assert (done.returncode, done.stdout, done.stderr) == (141, b"line\n", b"")


def test_a_full_disk_is_one_line() -> None:
    done = ended("sys.exit(exit_code(lambda: say('line')))", shell="{} > /dev/full")
    assert (done.returncode, done.stderr) == (2, b"error: system: No space left on device\n")


@pytest.mark.parametrize(
    ("module", "loading"),
    [
        ("baselines.evaluate", "pandas"),
        ("baselines.evaluate", "numpy"),
        ("baselines.merge", "numpy"),
        ("baselines.reproduce", "numpy"),
        ("baselines.watch", "numpy"),
        ("envs.describe", "numpy"),
        ("train.ppo", "numpy"),
        ("train.rllib", "numpy"),
        ("wifipgo", "rich"),
        ("wifipgo.graph.optimise", "numpy"),
        ("wifipgo.radio.recordings", "numpy"),
    ],
)
def test_ctrl_c_while_modules_load(module: str, loading: str, tmp_path: Path) -> None:
    (tmp_path / f"{loading}.py").write_text(
        "import os, signal\ntry:\n    os.kill(os.getpid(), signal.SIGINT)\nexcept BaseException:\n    pass\n"
        "raise ImportError('what libraries make of it')\n"
    )
    env = os.environ | {"PYTHONPATH": f"{tmp_path}{os.pathsep}{ROOT}"}
    subcommand = ["describe"] if module == "wifipgo" else []
    command = [sys.executable, "-m", module, *subcommand, "--help"]
    done = subprocess.run(command, cwd=tmp_path, env=env, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "interrupted; nothing was written\n")


def test_programs_of_others_keep_their_ctrl_c() -> None:
    program = (
        "import signal; before = signal.getsignal(2); import wifipgo; print(signal.getsignal(2) is before)"
    )
    command = [sys.executable, "-c", program, "-m", "wifipgo.graph.optimise"]
    assert subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout == "True\n"


def test_no_name_in_a_table_is_cut(capsys: pytest.CaptureFixture[str]) -> None:
    """Long words go on in the next line where columns are narrow."""
    table = Table("field", "meaning")
    table.add_row(
        "wifipgo.radio.propagation.materials", "a name in wifipgo.radio.propagation.diffraction.KINDS"
    )
    Terminal(width=40).print(table)
    lines = capsys.readouterr().out.splitlines()
    assert all(len(line) <= 40 for line in lines)
    cells = ["".join(parts) for parts in zip(*(line.split("│")[1:3] for line in lines[3:-1]), strict=True)]
    assert [cell.replace(" ", "") for cell in cells] == [
        "wifipgo.radio.propagation.materials",
        "anameinwifipgo.radio.propagation.diffraction.KINDS",
    ]
