"""Memory that arrays free is kept: a second use of it faults no page in."""

import resource
import sys

import numpy as np
import pytest

from wifipgo.heap import keep_freed_memory


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="how glibc's allocator is taught")
def test_arrays_come_back_without_a_fault() -> None:
    keep_freed_memory()

    def worked() -> int:
        before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
        for _ in range(20):
            arrays = [np.ones(50_000) for _ in range(8)]
            del arrays
        return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before

    worked()
    assert worked() < 20 * 8 * 50_000 * 8 // 4096 // 10
