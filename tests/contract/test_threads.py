"""Results are the same to the bit however many threads the caller's linear algebra has, and it keeps them."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from baselines.evaluate import EvaluateConfig, evaluate
from wifipgo.command.processes import THREADS
from wifipgo.threads import one_thread

TESTS = Path(__file__).parents[1]


def run_with(threads: int, *command: str) -> subprocess.CompletedProcess[str]:
    """Run Python in a process of its own whose linear algebra may use so many threads."""
    paths = {"PYTHONPATH": os.pathsep.join([str(TESTS.parent), str(TESTS)])}
    env = os.environ | paths | dict.fromkeys(THREADS, str(threads))
    return subprocess.run([sys.executable, *command], env=env, capture_output=True, text=True, check=True)


def blas_threads() -> set[int]:
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


def test_threads_of_the_caller_change_nothing() -> None:
    """Teams with four links and more, whose profiles' product more threads would split."""
    one, two = (run_with(n, "-m", "support.threads_found") for n in (1, 2))
    assert len(one.stdout.splitlines()) == 2
    assert one.stdout == two.stdout
    assert (one.stderr, two.stderr) == ("[1]\n", "[2]\n")  # given back after the episode


def test_inside_there_is_one_and_outside_what_there_was() -> None:
    with threadpool_limits(2, user_api="blas"):
        with one_thread:
            with one_thread:
                assert blas_threads() == {1}
            assert blas_threads() == {1}
        assert blas_threads() == {2}
        with pytest.raises(ValueError, match="in here"), one_thread:
            raise ValueError("in here")
        assert blas_threads() == {2}


def test_several_threads_of_a_program_share_the_rule() -> None:
    """Whoever leaves first takes nothing from the other."""
    both = Barrier(2, timeout=10.0)

    def first() -> set[int]:
        with one_thread:
            both.wait()
        both.wait()
        return blas_threads()

    def second() -> set[int]:
        both.wait()
        with one_thread:
            both.wait()
            return blas_threads()

    with threadpool_limits(2, user_api="blas"), ThreadPoolExecutor(2) as pool:
        for _ in range(5):
            ends = [pool.submit(first), pool.submit(second)]
            assert ends[1].result() == {1}
            ends[0].result()
        assert blas_threads() == {2}


def test_the_caller_keeps_its_threads_between_steps() -> None:
    from envs.rendezvous_v0 import parallel_env  # noqa: PLC0415

    with threadpool_limits(2, user_api="blas"):
        env = parallel_env("paper-hw-2", n_steps=2)
        env.reset(seed=1)
        assert blas_threads() == {2}
        env.step({agent: np.zeros(3, np.float32) for agent in env.agents})
        assert blas_threads() == {2}


@pytest.mark.usefixtures("spawned")
def test_results_depend_neither_on_jobs_nor_on_where(tmp_path: Path) -> None:
    """Workers have one thread each, this process has two."""
    tables = []
    with threadpool_limits(2, user_api="blas"):
        for executor, jobs in (("serial", 1), ("process", 2)):
            out = tmp_path / f"{executor}-{jobs}"
            changes = ("n_robots=4", "n_slots=3", "n_steps=4", "size_m=10", "kappa=2", "outliers=bearing")
            evaluate(EvaluateConfig(overrides=changes, trials=2, executor=executor, jobs=jobs, out=out))
            tables.append((out / "steps.parquet").read_bytes())
    assert len(set(tables)) == 1
