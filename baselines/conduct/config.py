"""The command line of ``wifipgo bench why``."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Annotated

import tyro

from baselines.evaluation.executors import Executor
from baselines.policies import POLICIES
from baselines.policies.learned.policy import LearnedPolicy
from baselines.policies.registry import specs_of
from baselines.policies.specs import Spec, split_list
from baselines.suite.definition import CLOSE_UP, SUITES, Suite
from baselines.suite.standings import LEAST_WORLDS, reference_of
from wifipgo.command.checkout import recorded
from wifipgo.command.docstrings import documented
from wifipgo.errors import pick, require

SUITE = "suite-v1"
_WITHOUT = "without"


@dataclass(frozen=True, slots=True, kw_only=True)
class WhyConfig:
    """Show what a policy does that a rule does not, what it uses, and where it fails, on the same worlds.

    Results: why.md (four tables), why.png (when robots meet, how far they go, where errors grow), why.json
    and curves.parquet. With --docs tables and picture go into the documentation, too.

    Example: wifipgo bench why --policies team_plan,mine=ppo:path=results/mine --out results/why

    Attributes:
        policies: Policies, separated by commas, as of wifipgo evaluate: the rule, the policy that is looked
            at, and others that stand in the table of scores.
        policy: The one that is looked at, by its label; left out: the first that is not the rule.
        reference: The rule that it is compared with; left out: team_plan, active, or the first.
        scenarios: Short names of scenarios of suite-v1; the picture shows the first.
        without: Ablations of the policy, if it is a trained one: it plays without each of these.
        worlds: Of each scenario.
        seed: Root of the worlds. Nothing is trained, chosen or ranked on the one that stands here.
        worst: Worlds of each scenario to list where the policy is furthest below the rule.
        out: Folder of the results, and of what was played.
        resume: Go on in that folder: what was played there is not played again.
        overwrite: Remove what is there first.
        jobs: Batches at once; 0: as many as there are cores. Results do not depend on it.
        executor: Where episodes run: process, serial (in this process) or ray. Results do not depend on it.
        docs: Folder of the documentation: its training.md gets the tables, its pictures the picture.
    """

    policies: str = "team_plan,ppo"
    policy: str = ""
    reference: str = ""
    scenarios: tuple[str, ...] = ("sim", "hw", "boxes", "hetero", "four")
    without: tuple[str, ...] = ("profile", "camera", "calls")
    worlds: int = 100
    seed: int = CLOSE_UP
    worst: int = 2
    out: Path = Path("results/why")
    resume: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    overwrite: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    jobs: int = 0
    executor: str = "process"
    docs: Path | None = None

    def check(self) -> None:
        """Refuse, before anything runs, what could not run."""
        rule = f">= {LEAST_WORLDS}: an interval needs them"
        require(self.worlds >= LEAST_WORLDS, "worlds", rule, self.worlds)
        require(self.seed >= 0, "seed", ">= 0", self.seed)
        require(self.worst >= 0, "worst", ">= 0", self.worst)
        both = self.resume and self.overwrite
        require(not both, "--resume and --overwrite", "one of them at most", "both")
        require(len(self.specs) > 1, "policies", "a rule and a policy, or more", self.policies)
        same = self.subject.label == self.rule
        require(not same, "policy", "another than the rule that it is compared with", self.rule)
        labels = [spec.label for spec in self.players]
        require(len(set(labels)) == len(labels), "policies and without", "all different", labels)

    @property
    def where(self) -> Executor:
        """Where episodes run, and how many at once."""
        return Executor(name=self.executor, jobs=self.jobs)

    @property
    def suite(self) -> Suite:
        """The scenarios that are played, with worlds of their own.

        Raises:
            UnknownNameError: There is none of that name; lists those that exist.
        """
        whole = SUITES[SUITE]
        require(len(self.scenarios) > 0, "scenarios", f"one or more of {', '.join(whole.parts)}", "none")
        parts = {
            name: pick(whole.parts, name, f"scenario of {SUITE}:")._replace(root=self.seed)
            for name in self.scenarios
        }
        return Suite(name=SUITE, parts=MappingProxyType(parts), worlds=self.worlds)

    @property
    def specs(self) -> tuple[Spec, ...]:
        """Policies that were named, all labelled."""
        return specs_of(self.policies)

    @property
    def as_typed(self) -> dict[str, str]:
        """The same as text, by label."""
        texts = split_list(self.policies, POLICIES)
        return {spec.label: text for spec, text in zip(self.specs, texts, strict=True)}

    @property
    def rule(self) -> str:
        """Label of what the policy is compared with."""
        return reference_of([spec.label for spec in self.specs], self.reference)

    @property
    def subject(self) -> Spec:
        """The policy that is looked at.

        Raises:
            UnknownNameError: It is none of the policies; lists these.
        """
        by_label = {spec.label: spec for spec in self.specs}
        others = [label for label in by_label if label != self.rule]
        return pick(by_label, self.policy or (others or list(by_label))[0], "policy")

    @property
    def ablations(self) -> tuple[Spec, ...]:
        """The policy without each of the things that are taken away; none of one that was not trained."""
        whole = self.subject
        trained = not whole.where and POLICIES.get(whole.name) is LearnedPolicy
        if not trained or _WITHOUT in whole.parameters:
            return ()
        return tuple(
            whole._replace(label=f"{whole.label} without {name}", pairs=(*whole.pairs, f"{_WITHOUT}={name}"))
            for name in self.without
        )

    @property
    def players(self) -> tuple[Spec, ...]:
        """All that plays."""
        return (*self.specs, *self.ablations)

    @property
    def command(self) -> str:
        """Command line that makes the same results."""
        words = ["--policies", self.policies]
        words += ["--policy", self.policy] if self.policy else []
        words += ["--reference", self.reference] if self.reference else []
        words += ["--scenarios", *self.scenarios, "--worlds", str(self.worlds), "--seed", str(self.seed)]
        words += ["--without", *self.without]
        return recorded("bench", "why", *words)


def parsed(args: Sequence[str] | None = None) -> WhyConfig:
    """Read the command line.

    Raises:
        SystemExit: It is not understood, or asks for help.
    """
    return tyro.cli(documented(WhyConfig), prog="wifipgo bench why", args=args)
