"""Whether robots know how lost they are: NEES of their last poses, by estimator, `aoa_factors` and policy.

Run: ``wifipgo bench consistency [--scenario NAME] [--episodes N] [--json OUT]``. NEES is the squared
error of a pose over its covariance as the robot knows it (Bar-Shalom, Li, Kirubarajan 2001, Sec. 5.4), here
over the three degrees of freedom: 1 where the robot is right about itself, above where it is too sure. It is
averaged over robots and iterations of an episode; the interval is a bootstrap over episodes. Beside it stands
ATE (Eq. 12), over the whole of the trajectories. As it stands it takes two minutes.
"""

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import tyro
from jaxtyping import Float
from rich.progress import track
from rich.table import Table

from baselines.evaluation.episodes import trial_seed
from baselines.evaluation.statistics import Estimate, bootstrap
from baselines.policies import make_policy
from envs.rendezvous_v0 import RendezvousVectorEnv, vector_env
from wifipgo import se2
from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal
from wifipgo.errors import require
from wifipgo.files.atomic_files import write_json
from wifipgo.graph.config import ESTIMATORS
from wifipgo.graph.metrics import ate_trans
from wifipgo.state import Tick

BAND = (0.8, 1.25)  # of the mean over episodes


@dataclass(frozen=True, slots=True, kw_only=True)
class ConsistencyConfig:
    """What to play."""

    scenario: Annotated[str, tyro.conf.arg(help="Name of the scenario.")] = "paper-sim-2"
    policies: Annotated[tuple[str, ...], tyro.conf.arg(help="Specs of the policies.")] = (
        "random",
        "active",
        "frontier_home",
    )
    episodes: Annotated[int, tyro.conf.arg(help="Episodes of each row.")] = 128
    worlds: Annotated[int, tyro.conf.arg(help="Worlds at once.")] = 64
    seed: Annotated[int, tyro.conf.arg(help="Root of the seeds.")] = 0
    json: Annotated[Path | None, tyro.conf.arg(help="Also write the figures to this file.")] = None

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        require(self.episodes >= 10, "--episodes", ">= 10", self.episodes)
        require(self.worlds >= 1, "--worlds", ">= 1", self.worlds)


class Played(NamedTuple):
    """Figures of some episodes: NEES over its degrees of freedom, ATE at the end, processor time."""

    nees: Float[np.ndarray, " episodes"]
    ate_m2: Float[np.ndarray, " episodes"]
    cpu_s: float


def pose_nees(tick: Tick) -> Float[np.ndarray, " robots"]:
    """NEES of each robot's last pose over its degrees of freedom."""
    paths = tick.belief.paths
    off = paths.estimate[:, -1] - tick.truth.poses[:, -1]
    off[:, 2] = se2.wrap_angle(off[:, 2])
    chi2: np.ndarray = (off * np.linalg.solve(paths.covariance, off[..., None])[..., 0]).sum(axis=1)
    return chi2 / 3.0


def played(env: RendezvousVectorEnv, policy: str, seeds: list[int]) -> Played:
    """Play one episode in each world of a batch."""
    driver, begin = make_policy(policy, env.scenario), time.process_time()
    driver.reset_rows(seeds)
    observations, _ = env.reset(seed=seeds)
    nees = np.zeros(env.n_worlds)
    for _ in range(env.scenario.n_steps):
        observations = env.step(driver.act_rows(observations)).observations
        (cohort,) = env.cohorts
        nees += pose_nees(cohort.episode.tick).reshape(env.n_worlds, -1).mean(axis=1)
    truth, belief = cohort.episode.tick
    ate_m2 = ate_trans(belief.paths.estimate, truth.poses).reshape(env.n_worlds, -1).mean(axis=1)
    return Played(nees / env.scenario.n_steps, ate_m2, time.process_time() - begin)


def rows_of(config: ConsistencyConfig) -> Iterator[tuple[str, bool, str]]:
    """Estimators, with directions at ping range as factors where that is possible, and policies."""
    for (name, estimator), policy in product(ESTIMATORS.items(), config.policies):
        for aoa_factors in (False, True)[: 1 + estimator.incremental]:
            yield name, aoa_factors, policy


def row_of(config: ConsistencyConfig, estimator: str, aoa_factors: bool, policy: str) -> Played:
    """All episodes of a row."""
    seeds = [trial_seed(config.seed, trial) for trial in range(config.episodes)]
    parts = []
    for begin in range(0, len(seeds), config.worlds):
        own = seeds[begin : begin + config.worlds]
        env = vector_env(config.scenario, n_worlds=len(own), estimator=estimator, aoa_factors=aoa_factors)
        parts.append(played(env, policy, own))
    nees, ate_m2 = (np.concatenate(column) for column in list(zip(*parts, strict=True))[:2])
    return Played(nees, ate_m2, sum(part.cpu_s for part in parts))


def main(config: ConsistencyConfig) -> None:
    """Play and show."""
    console = Terminal(width=None if sys.stdout.isatty() else 110)
    title = f"{config.scenario}, {config.episodes} episodes, root {config.seed}"
    table = Table("estimator", "aoa_factors", "policy", "NEES / dof", "in band", "ATE, m2", "s", title=title)
    found = []
    for name, aoa_factors, policy in track(list(rows_of(config)), "playing", console=console):
        one = row_of(config, name, aoa_factors, policy)
        nees, ate_m2 = bootstrap((one.nees,), np.mean), bootstrap((one.ate_m2,), np.mean)
        inside = "yes" if BAND[0] <= one.nees.mean() <= BAND[1] else "no"
        cells = (name, str(aoa_factors), policy, _shown(nees), inside, _shown(ate_m2, 4))
        table.add_row(*cells, f"{one.cpu_s:.0f}")
        row = {"estimator": name, "aoa_factors": aoa_factors, "policy": policy, "cpu_s": one.cpu_s}
        found.append(row | {"nees": asdict(nees), "ate_m2": asdict(ate_m2)})
    console.print(table)
    if config.json:
        write_json(config.json, found)


def _shown(estimate: Estimate, digits: int = 2) -> str:
    """A mean and its interval."""
    return f"{estimate.value:.{digits}f} [{estimate.low:.{digits}f}, {estimate.high:.{digits}f}]"


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(tyro.cli(ConsistencyConfig, description=__doc__))))
