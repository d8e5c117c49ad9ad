"""One row of `benchmarks.many_worlds`, in a process of its own: plays episodes and prints figures as JSON.

It runs against whatever checkout is on PYTHONPATH; one that knows no `vector_env` plays worlds one by one.
Time is that of the processor.
"""

import json
import resource
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from baselines.policies import make_policy
from envs import rendezvous_v0

Play = Callable[[int], Iterator[float]]


def alone(scenario: str, fields: dict[str, Any], policy: str) -> Play:
    """Episodes of one world; yields the time of each step with its policy, s."""
    env = rendezvous_v0.parallel_env(scenario, **fields)
    driver = make_policy(policy, env.scenario)

    def play(seed: int) -> Iterator[float]:
        driver.reset(seed)
        observations, _ = env.reset(seed=seed)
        while env.agents:
            begin = time.process_time()
            observations, *_ = env.step(driver.act(observations))
            yield time.process_time() - begin

    return play


def batch(scenario: str, fields: dict[str, Any], policy: str, n_worlds: int) -> Play:
    """Episodes of a batch of worlds."""
    env = rendezvous_v0.vector_env(scenario, n_worlds=n_worlds, **fields)
    driver = make_policy(policy, env.scenario)

    def play(seed: int) -> Iterator[float]:
        driver.reset_rows(range(seed, seed + n_worlds))
        observations, _ = env.reset(seed=seed)
        while not env.over.all():
            begin = time.process_time()
            observations = env.step(driver.act_rows(observations)).observations
            yield time.process_time() - begin

    return play


def main(asked: dict[str, Any]) -> None:
    """Play until the time is up, at least one episode after one to warm up, or so many steps."""
    many = hasattr(rendezvous_v0, "vector_env") and asked["n_worlds"] > 1
    given = (asked["scenario"], asked["fields"], asked["policy"])
    play = batch(*given, asked["n_worlds"]) if many else alone(*given)
    times: list[float] = []
    begun, seed, most = time.process_time(), 0, asked["most_steps"]
    while not times or time.process_time() - begun < asked["seconds"]:
        for k, one in enumerate(play(seed)):
            if seed or most:  # the first episode warms up, unless steps are few and long
                times.append(one)
            if most and k + 1 >= most:
                break
        seed += asked["n_worlds"]
    n_robots = rendezvous_v0.parallel_env(asked["scenario"], **asked["fields"]).scenario.n_robots
    steps = np.array(times)
    figures = {
        "ms_a_step": 1e3 * float(steps.mean()),
        "agent_steps_s": n_robots * (asked["n_worlds"] if many else 1) / float(steps.mean()),
        "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3,
    }
    json.dump(figures, sys.stdout)


if __name__ == "__main__":
    main(json.loads(sys.argv[1]))
