"""Write what scores of a suite are normalised between: ``python -m baselines.suite.anchors suite-v1``.

Once for each version, when it is made: a random walk, and the plan of a team with near-perfect localisation.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from baselines.evaluation.batches import worlds_at_once
from baselines.evaluation.episodes import run_episodes
from baselines.suite.definition import CEILING, FLOOR, SUITES, Suite, digest_of
from wifipgo.command.command_line import exit_code
from wifipgo.errors import pick
from wifipgo.files.atomic_files import write_json
from wifipgo.scenarios import Scenario

_DIGITS = 4


def measure(suite: Suite) -> dict[str, object]:
    """Content of the file of a version."""
    floor = {
        name: _mean(part.scenario, FLOOR, part.seeds(range(suite.worlds)))
        for name, part in suite.parts.items()
    }
    ceiling = {
        name: _mean(part.sure, CEILING, part.seeds(range(suite.worlds))) for name, part in suite.parts.items()
    }
    return {"suite": suite.name, "digest": digest_of(suite.name), "floor": floor, "ceiling": ceiling}


def _mean(scenario: Scenario, policy: str, seeds: Sequence[int]) -> float:
    """Mean mapped share over worlds."""
    size = worlds_at_once(scenario)
    parts = [seeds[begin : begin + size] for begin in range(0, len(seeds), size)]
    played = [episode for part in parts for episode in run_episodes(scenario, policy, part)]
    return round(float(np.mean([episode.figures["mapped_share"] for episode in played])), _DIGITS)


def main(args: Sequence[str] | None = None) -> int:
    """Measure and write; the exit code is that of `wifipgo.command.command_line`."""
    words = sys.argv[1:] if args is None else args

    def job() -> None:
        for name in words:
            suite = pick(SUITES, name, "suite")
            write_json(Path(__file__).with_name(f"{name}.json"), measure(suite))

    return exit_code(job)


if __name__ == "__main__":
    sys.exit(main())
