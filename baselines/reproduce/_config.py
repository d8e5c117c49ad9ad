"""The command line of the reproduction."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from baselines.evaluation.executors import Executor
from baselines.reproduce._runs import ROOTS, TRIALS, TRIALS_MANY, Setting
from wifipgo.command.checkout import recorded
from wifipgo.command.docstrings import documented
from wifipgo.command.overrides import Overrides, joined
from wifipgo.errors import require


@dataclass(frozen=True, slots=True, kw_only=True)
class ReproduceConfig:
    """Draw the paper's figures again and judge its claims.

    Each figure gets a folder in OUT with its picture, its data as parquet and its claims; claims.md and
    claims.json there hold all of them. Episodes that several figures need are run once. The same command with
    --resume goes on after an interruption, adds figures or roots, and runs nothing twice. Left as it is, all
    takes the better part of an hour on two cores, --trials 10 --roots 1 a few minutes. A verdict needs ten
    worlds in all: with fewer the figures are drawn and none is given.

    Beside the figures stand two studies, each with a table, a picture and a page, and no part of all:
    sensitivity changes everything of ours, one at a time, and ranks what carries the factor of six and the
    ground-truth gain; fig_radio plays the same worlds under a radio that grows harder, with policies that do
    without directions. Each takes about half as long as all; with --trials 30 --roots 4 an eighth.

    --set and --sweep judge the claims under changed assumptions beside the default, in one table
    (changed_claims.md and .json in OUT): no figure is drawn, and only episodes that the change touches are
    played. With --resume they go into the folder of an earlier run and take its episodes for the default.

    real tries the paper's ideas on a recorded team, whose data docs/datasets.md describes.

    Example: wifipgo reproduce fig7 fig8 --trials 20 --roots 1 --out results/two_robots

    Example: wifipgo reproduce fig7 fig8 --sweep err_threshold=5,10,20 --trials 20 --roots 1

    Example: wifipgo reproduce sensitivity --trials 30 --roots 4 --out results/sensitivity

    Attributes:
        figures: all (of the paper's), or any of fig2 fig5 fig7 fig8 fig9 fig10 fig10_literal real
            sensitivity fig_radio.
        trials: Worlds of each root, each met by everything that is compared. Left out: 60 with two robots,
            10 with fifty.
        roots: Roots of seeds; the worlds of all are one pool.
        seed: First root: --seed 3 --roots 2 takes the roots 3 and 4.
        overrides: Other values for fields of every scenario: --set revisit_gap=1000 kappa=6.
        sweep: A field of every scenario and its values, one after the other: --sweep err_threshold=5,10,20.
        jobs: Batches at once; 0: as many as there are cores. Results do not depend on it.
        worlds: Most worlds that a job plays at once; 0: 64, fewer where teams are large (400 robots in all).
            Results do not depend on it.
        executor: Where episodes run: process, serial (in this process) or ray. Results do not depend on it.
        ray_address: Ray cluster to join, e.g. auto; without one, ray starts one of its own on the loopback.
        out: Folder of the results.
        resume: Go on with the run that is there; its trials, seed and versions must be the same.
        overwrite: Remove the run that is there first.
        data: Folder of a run of MRCLAM, or of data sets with one in mrclam6; left out: $WIFIPGO_DATA.
        docs: Also write claims.md, claims.json and the pictures into this folder; with --set or --sweep,
            changed_claims.md and .json beside them.
    """

    figures: Annotated[tuple[str, ...], tyro.conf.Positional] = ("all",)
    trials: int | None = None
    roots: int = ROOTS
    seed: int = 0
    overrides: Overrides = ()
    sweep: Annotated[tuple[str, ...], tyro.conf.arg(metavar="FIELD=A,B,... ...")] = ()
    jobs: int = 0
    worlds: int = 0
    executor: str = "process"
    ray_address: str = ""
    out: Path = Path("results/reproduce")
    resume: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    overwrite: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    data: Path | None = None
    docs: Path | None = None

    def check(self) -> None:
        """Refuse, before anything runs, what could not run."""
        require(self.trials is None or self.trials >= 1, "trials", ">= 1", self.trials)
        require(1 <= self.roots <= 10_000, "roots", "in 1..10000", self.roots)
        require(self.seed >= 0, "seed", ">= 0", self.seed)
        both = self.resume and self.overwrite
        there = self.data is None or self.data.is_dir()
        require(there, "--data", "a folder", str(self.data))
        require(not both, "--resume and --overwrite", "one of them at most", "both")

    @property
    def where(self) -> Executor:
        """Where episodes run."""
        return Executor(name=self.executor, jobs=self.jobs, ray_address=self.ray_address, worlds=self.worlds)

    @property
    def command(self) -> str:
        """Command line that makes the same results."""
        trials = [] if self.trials is None else ["--trials", str(self.trials)]
        roots = ["--roots", str(self.roots), "--seed", str(self.seed)]
        changes = ["--set", *self.overrides] if self.overrides else []
        changes += ["--sweep", *self.sweep] if self.sweep else []
        data = [] if self.data is None else ["--data", str(self.data)]
        return recorded("reproduce", *self.figures, *trials, *roots, *changes, *data)

    def setting(self, cache: Path) -> Setting:
        """What all figures share."""
        return Setting(trials=self.trials or 0, seed=self.seed, roots=self.roots, cache=cache, data=self.data)

    @property
    def pool(self) -> str:
        """The worlds, in words."""
        last = self.seed + self.roots - 1
        roots = f"roots {self.seed} to {last}" if self.roots > 1 else f"root {self.seed}"
        return f"{roots}, {self.trials or f'{TRIALS} worlds of two robots or {TRIALS_MANY} of fifty'} each"


def parsed(args: Sequence[str] | None = None) -> ReproduceConfig:
    """Read the command line.

    Raises:
        ValueError: A value that is refused.
        SystemExit: The command line is not understood, or asks for help.
    """
    words = joined(args, ("--set", "--sweep"))
    return tyro.cli(documented(ReproduceConfig), prog="wifipgo reproduce", args=words)
