"""Errands: what goes wrong in another process or on another computer comes back as what it was."""

import pickle
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from support.dying import Errand, compute, fail_oddly

from baselines.evaluation import errands
from baselines.evaluation.errands import answer, carried_out, packed
from baselines.evaluation.ray_cluster import first_line, joined
from wifipgo.errors import BadInputError

ROOT = Path(__file__).parents[2]


def test_a_result_comes_back(tmp_path_factory: pytest.TempPathFactory) -> None:
    assert answer(carried_out(packed(compute, Errand(tmp_path_factory.mktemp("a"), 3, 0)))) == 9


def test_a_problem_comes_back_as_it_was(tmp_path_factory: pytest.TempPathFactory) -> None:
    with pytest.raises(ValueError, match=r"^a number below zero") as failure:
        answer(carried_out(packed(compute, Errand(tmp_path_factory.mktemp("a"), -1, 0))))
    assert "in compute" in failure.value.__notes__[0]


def test_a_problem_that_does_not_travel_comes_back_as_its_text() -> None:
    with pytest.raises(RuntimeError, match=r"^OddError: 1 and 2"):
        answer(carried_out(packed(fail_oddly, None)))


def test_other_code_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    errand = packed(len, "four")
    monkeypatch.setattr(errands, "code_digest", lambda: "0123456789abcdef")
    with pytest.raises(BadInputError, match=r"is 0123456789abcdef, where the run was started [0-9a-f]{16}"):
        answer(carried_out(errand))


def test_a_computer_without_the_package_says_so() -> None:
    """The function goes there by value, as Ray sends it."""
    pytest.importorskip("cloudpickle", reason="cloudpickle is not installed (extra 'train')")
    here = "import sys, cloudpickle; from baselines.evaluation.ray_cluster import far_errand; "
    here += "sys.stdout.buffer.write(cloudpickle.dumps(far_errand()))"
    there = "import sys, pickle; sys.modules['baselines'] = None; "
    there += "sys.stdout.buffer.write(pickle.load(sys.stdin.buffer)(b''))"
    sent = subprocess.run([sys.executable, "-c", here], cwd=ROOT, stdout=subprocess.PIPE, check=True).stdout
    done = subprocess.run(
        [sys.executable, "-c", there], input=sent, stdout=subprocess.PIPE, check=True
    ).stdout
    fine, problem, _ = pickle.loads(done)
    assert not fine
    assert f"{socket.gethostname()} of the cluster cannot import wifipgo" in str(problem)
    assert "install the same version there" in str(problem)


def test_the_cause_is_shown_without_advice() -> None:
    told = RuntimeError("\nThe worker died unexpectedly.\nSee the docs.\n  Exit detail: out of memory\n")
    shown = "RuntimeError: The worker died unexpectedly. Exit detail: out of memory"
    assert first_line(told) == shown


def test_an_address_where_nobody_listens_is_refused_at_once() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))  # bound, but it does not listen
        address = f"127.0.0.1:{taken.getsockname()[1]}"
        with (
            pytest.raises(BadInputError, match=f"ray-address {address}: nothing answers there"),
            joined(None, address, n_cpus=1),
        ):
            pass
