"""The command line of the suite."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from baselines.evaluation.executors import Executor
from baselines.policies.registry import specs_of
from baselines.policies.specs import Spec
from baselines.suite.definition import SUITES, Suite
from wifipgo.command.checkout import recorded
from wifipgo.command.docstrings import documented
from wifipgo.errors import pick, require


@dataclass(frozen=True, slots=True, kw_only=True)
class SuiteConfig:
    """Play policies in all scenarios of a suite, each in the same worlds, and rank them.

    Results: suite.json (every score), table.md, suite.png. Scores are mapped shares; those of all scenarios
    are summed up after Agarwal et al. (2021), normalised between a random walk (0) and near-perfect
    localisation (1).

    Example: wifipgo suite --policies active,team_plan,mine=own.py:Policy --out results/suite

    Attributes:
        policies: Policies, separated by commas, as of wifipgo evaluate.
        suite: Version: it fixes scenarios and worlds, so that a paper can cite it.
        worlds: Of each scenario; 0: all that the version has, which the leaderboard asks for.
        worlds_from: Number of the first: job k of an array plays --worlds 10 --worlds-from 10k, and wifipgo
            merge joins the results.
        scenarios: Some of the suite's only, by their short names.
        reference: Policy that the others are compared with; without one team_plan, active, or the first.
        out: Folder of the results. It appears when all is done; until then see OUT.partial.
        overwrite: Replace results that are there, once the new ones are complete.
        resume: Continue an interrupted run, or add policies, worlds or scenarios to a finished one.
        jobs: Batches at once; 0: as many as there are cores. Results do not depend on it.
        executor: Where episodes run: process, serial (in this process) or ray. Results do not depend on it.
        ray_address: Ray cluster to join, e.g. auto; without one, ray starts one of its own on the loopback.
    """

    policies: str = "random,active,frontier_home,both_drive,voronoi,mesh,team_plan,ppo"
    suite: str = "suite-v1"
    worlds: int = 0
    worlds_from: int = 0
    scenarios: tuple[str, ...] = ()
    reference: str = ""
    out: Path = Path("results/suite")
    overwrite: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    resume: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    jobs: int = 0
    executor: str = "process"
    ray_address: str = ""

    @property
    def where(self) -> Executor:
        """Where episodes run, and how many at once."""
        return Executor(name=self.executor, jobs=self.jobs, ray_address=self.ray_address)

    @property
    def version(self) -> Suite:
        """The suite.

        Raises:
            UnknownNameError: There is none of that version; lists those that exist.
        """
        return pick(SUITES, self.suite, "suite")

    @property
    def names(self) -> tuple[str, ...]:
        """Scenarios to play, in the order of the suite."""
        for name in self.scenarios:
            pick(self.version.parts, name, f"scenario of {self.suite}:")
        return tuple(name for name in self.version.parts if name in (self.scenarios or self.version.parts))

    @property
    def numbers(self) -> range:
        """Numbers of the worlds to play."""
        most, first = self.version.worlds, self.worlds_from
        require(0 <= first < most, "worlds-from", f"in 0..{most - 1} ({self.suite} has {most})", first)
        rule = f"in 0..{most - first} ({self.suite} has {most} from 0 on)"
        require(0 <= self.worlds <= most - first, "worlds", rule, self.worlds)
        return range(first, first + (self.worlds or most - first))

    @property
    def specs(self) -> tuple[Spec, ...]:
        """Policies, all labelled."""
        found = specs_of(self.policies)
        require(len(found) > 0, "policies", "one or more, separated by commas", self.policies)
        return found

    @property
    def command(self) -> str:
        """Command line that plays the same."""
        words = ["--policies", ",".join(spec.labelled for spec in self.specs), "--suite", self.suite]
        numbers = {"--worlds": self.worlds, "--worlds-from": self.worlds_from}
        words += [word for key, value in numbers.items() if value for word in (key, str(value))]
        words += ["--scenarios", *self.scenarios] if self.scenarios else []
        return recorded("suite", *words)


def parsed(args: Sequence[str] | None = None) -> SuiteConfig:
    """Read the command line.

    Raises:
        SystemExit: It is not understood, or asks for help.
    """
    return tyro.cli(documented(SuiteConfig), prog="wifipgo suite", args=args)
