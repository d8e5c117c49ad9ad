"""Prints digests of episodes, and the threads that are left afterwards: run by `contract/test_threads.py`."""

import sys
from hashlib import sha256

import numpy as np
from threadpoolctl import threadpool_info

from baselines.evaluation.episodes import run_episode
from wifipgo.scenarios import scenario_named

_LOCAL = {"n_robots": 4, "n_slots": 3, "n_steps": 5}
SCENARIOS = {
    "two stages": scenario_named("paper-hw-2", **_LOCAL, size_m=10.0, outliers="bearing", kappa=2),
    "every step": scenario_named(
        "paper-sim-2", **_LOCAL, size_m=10.0, estimator="every_step", aoa_factors=True, outliers="bearing"
    ),
}


def found(name: str) -> str:
    """Digest of all that an episode leaves, to the bit."""
    episode = run_episode(SCENARIOS[name], "active", 5)
    arrays = [episode.estimate, episode.reference, *episode.steps.values()]
    return sha256(b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)).hexdigest()


if __name__ == "__main__":
    for name in SCENARIOS:
        sys.stdout.write(f"{name}: {found(name)}\n")
    threads = sorted({pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"})
    sys.stderr.write(f"{threads}\n")
