"""The command line of the evaluation, and the plan that it asks for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from baselines.evaluation.executors import Executor
from baselines.evaluation.plan import Plan, read_record
from baselines.policies.registry import specs_of
from baselines.policies.specs import learned_at
from wifipgo.coerce import settings
from wifipgo.command.checkout import recorded, runnable
from wifipgo.command.docstrings import documented
from wifipgo.command.overrides import Overrides, joined
from wifipgo.scenarios import Scenario, scenario_from, scenario_named
from wifipgo.scenarios.toml_files import SUFFIX

SCENARIO = tyro.constructors.PrimitiveConstructorSpec[str | Scenario](
    nargs=1,
    metavar="NAME",
    instance_from_str=lambda args: args[0],
    is_instance=lambda value: isinstance(value, str | Scenario),
    str_from_instance=lambda value: [value if isinstance(value, str) else value.name],
)


@dataclass(frozen=True, slots=True, kw_only=True)
class EvaluateConfig:
    """Run policies on the same worlds and compare them.

    Trial k of every policy has the same world, noise and seed, so comparisons are paired.
    Results: episodes.parquet, steps.parquet, summary.json, config.json, score.png, err.png,
    arena.png and median-trial/ (whole episodes of the trial that arena.png shows).

    Example: wifipgo evaluate --scenario paper-hw-2-obstacles
    --policies active,random,active:err_threshold=0.5 --trials 20 --set n_obstacles=6 --out results/boxes

    Attributes:
        scenario: Scenario to play, e.g. paper-hw-2, or a file, e.g. room.toml; an unknown one lists those
            that exist.
        policies: Policies, separated by commas; parameters follow a colon: active:err_threshold=0.5.
            Your own: path/file.py:Class or my.module:Class; a trained one: ppo:path=RUN_OR_NPZ. NAME=POLICY
            names one in tables and pictures. A path that holds what separates goes in quotes, within those
            of the shell: 'a=ppo:path="runs/lr=1, seed=0",active'.
        trials: Worlds that every policy meets.
        seed: Root of the seeds of all trials.
        trials_from: Number of the first trial: job k of an array plays --trials 10 --trials-from 10k, and
            wifipgo merge joins the results to those of one run.
        overrides: Other values for fields of the scenario: --set n_obstacles=4 size_m=30.
        out: Folder of the results. It appears when all is done; until then see OUT.partial.
        reference: Policy, by its name in the tables, that the others are compared with on the same trials;
            without one active, or the first.
        table: Table for a paper, out.csv, out.md or out.tex, as often as one likes: means, intervals and
            the comparison, the best in bold.
        overwrite: Replace results and tables that are there, once the new ones are complete.
        resume: Continue an interrupted run with the same settings; with more --trials, also a finished one.
        jobs: Batches at once; 0: as many as there are cores. Results do not depend on it.
        worlds: Most worlds that a job plays at once; 0: 64, fewer where teams are large (400 robots in all).
            Results do not depend on it.
        executor: Where episodes run: process, serial (in this process) or ray. Results do not depend on it.
        ray_address: Ray cluster to join, e.g. auto; without one, ray starts one of its own on the loopback,
            whatever else runs and RAY_ADDRESS says.
        config: Take scenario, policies, trials and seed from the config.json of another evaluation;
            what else is on the command line wins.
    """

    scenario: Annotated[str | Scenario, SCENARIO] = "paper-hw-2"
    policies: str = "active,random"
    trials: int = 20
    seed: int = 0
    trials_from: int = 0
    overrides: Overrides = ()
    out: Path = Path("results/evaluate")
    reference: str = ""
    table: tuple[Path, ...] = ()
    overwrite: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    resume: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    jobs: int = 0
    worlds: int = 0
    executor: str = "process"
    ray_address: str = ""
    config: Path | None = None

    @property
    def where(self) -> Executor:
        """Where episodes run, and how many at once."""
        return Executor(name=self.executor, jobs=self.jobs, ray_address=self.ray_address, worlds=self.worlds)


def plan_of(config: EvaluateConfig) -> Plan:
    """What a configuration asks for, checked.

    Raises:
        ValueError: A name that does not exist (the message lists those that do), or a value that is refused.
    """
    given = config.scenario
    scenario = given if isinstance(given, Scenario) else scenario_named(given)
    return Plan(
        scenario=scenario.with_overrides(**settings(config.overrides)),
        specs=specs_of(config.policies),
        trials=config.trials,
        seed=config.seed,
        trials_from=config.trials_from,
        against=config.reference,
    )


def command_of(config: EvaluateConfig) -> str:
    """Command line that runs a configuration again."""
    policies = ",".join(spec.labelled for spec in specs_of(config.policies))
    options = {"policies": policies, "trials": config.trials, "seed": config.seed}
    options |= {"trials-from": config.trials_from} if config.trials_from else {}
    options |= {"reference": config.reference} if config.reference else {}
    words = [word for key, value in options.items() for word in (f"--{key}", str(value))]
    changes = ["--set", *config.overrides] if config.overrides else []
    return recorded("evaluate", *_origin(config), *words, *changes, "--out", str(config.out))


def play_command(scenario: str, run: Path, overrides: Sequence[str] = ()) -> str:
    """Command line that plays what a training left, beside the paper's policy, on what it was trained on."""
    changes = ["--set", *overrides] if overrides else []
    policies = f"active,{learned_at(str(run))}"
    return runnable("evaluate", "--scenario", scenario, "--policies", policies, *changes)


def _origin(config: EvaluateConfig) -> list[str]:
    """Where the scenario comes from: its name, or the record where a name does not say all.

    A TOML file may be changed after the run; the record keeps what was run.
    """
    if isinstance(config.scenario, str) and not config.scenario.endswith(SUFFIX):
        return ["--scenario", config.scenario]
    return ["--config", str(config.config or config.out / "config.json")]


def parsed(args: Sequence[str] | None = None) -> EvaluateConfig:
    """Read the command line; a saved configuration stands in for the defaults.

    Raises:
        ValueError: ``--config`` names a file that is no configuration.
        OSError: It cannot be read.
        SystemExit: The command line is not understood, or asks for help.
    """
    config = _cli(args, EvaluateConfig())
    if config.config is None:
        return config
    saved = read_record(config.config)
    default = EvaluateConfig(
        scenario=scenario_from(saved["scenario"], str(config.config)),
        policies=",".join(saved["policies"]),
        trials=saved["trials"],
        seed=saved["seed"],
        trials_from=saved.get("trials_from", 0),
        reference=saved.get("reference", ""),
    )
    return _cli(args, default)


def changed_sources(saved: Path | None, record: Mapping[str, Any]) -> list[str]:
    """Labels of policies whose source is another than in a saved record."""
    there = read_record(saved).get("sources", {}) if saved else {}
    now = record.get("sources", {})
    return [label for label in there if label in now and there[label] != now[label]]


def _cli(args: Sequence[str] | None, default: EvaluateConfig) -> EvaluateConfig:
    words = joined(args, ("--set", "--table"))
    return tyro.cli(documented(EvaluateConfig), prog="wifipgo evaluate", args=words, default=default)
