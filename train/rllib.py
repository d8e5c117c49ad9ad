"""The same environment under RLlib: ``python -m train.rllib --out results/rllib``. Needs the extra ``rllib``.

Its own PPO with one plain perceptron for all robots. What it trains is exported to the same file as that of
`train.ppo`, so ``--policy ppo:path=FILE`` runs it without ray or torch.
"""

import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
import tyro
from rich.console import Console

from baselines.evaluation.command import exit_code
from baselines.evaluation.config import play_command
from baselines.evaluation.executors import cores
from baselines.evaluation.ray_cluster import joined, load_ray
from baselines.policies.learned.interfaces import make_interface
from baselines.policies.learned.network import Network
from train._rllib_algorithm import ROBOT, exported, make_algorithm
from train._rllib_checkpoints import RllibCheckpoints, Saved
from train._rllib_config import RllibConfig, changed_settings, check_runners, settings_of
from train._run_folder import check_claim, claim
from wifipgo.command.docstrings import documented
from wifipgo.command.terminal import say
from wifipgo.errors import require
from wifipgo.files.atomic_files import write_json
from wifipgo.files.folder_lock import held
from wifipgo.files.results_folder import begin, note
from wifipgo.files.text_files import read_json
from wifipgo.scenarios import Scenario, scenario_named

__all__ = ["RllibConfig", "exported", "main", "train"]

_KIND = "train.rllib"
_RESUMED = 7_919  # each time a run is continued, its worlds follow another root


def train(config: RllibConfig, *, console: Console | None = None) -> Network:
    """Train, or continue, and leave policy, checkpoints and settings in ``config.out``.

    Raises:
        ValueError: A setting that is refused, or a checkpoint that does not fit; nothing was written.
        OSError: A folder that cannot be written.
        MissingExtraError: The extra ``rllib`` is not installed.
    """
    console = console or Console(quiet=True)
    scenario = scenario_named(config.scenario)
    make_interface(config.interface, scenario)
    ray = load_ray(config.ray_address, what="train.rllib", extra="rllib", modules=("torch", "ray.rllib"))
    with held(config.out):
        start = _start(config)
        with joined(ray, config.ray_address, n_cpus=cores()):
            check_runners(config.n_runners, int(ray.cluster_resources().get("CPU", 0)))
            _claim(config)
            network = _trained(config, scenario, start, console)
    say(console, f"run it: {play_command(config.scenario, config.out)}")
    return network


def _start(config: RllibConfig) -> Saved | None:
    """Checkpoint to go on from, if that is asked for; changes nothing.

    Raises:
        BadInputError: The folder may not be used, its settings are others, or its checkpoint is damaged.
    """
    out = config.out
    check_claim(out, _KIND, resume=config.resume, overwrite=config.overwrite)
    if not config.resume:
        return None
    record = out / "settings.json"
    there = read_json(record)
    require(isinstance(there, dict), str(record), "a table of settings", there)
    changed = changed_settings(there, settings_of(config))
    require(not changed, "resume", f"given with the settings of {record}", changed[:3])
    return RllibCheckpoints(out).last()


def _claim(config: RllibConfig) -> None:
    """Make the folder, or take it up, and write the settings down."""
    claim(config.out, _KIND, resume=config.resume, overwrite=config.overwrite)
    begin(config.out, _KIND)
    note(config.out, ("settings.json", "policy.npz"))
    write_json(config.out / "settings.json", settings_of(config))


def _trained(config: RllibConfig, scenario: Scenario, start: Saved | None, console: Console) -> Network:
    """Update until all iterations are done, with a checkpoint now and then; export what came out."""
    done = start.iterations if start else 0
    algorithm = make_algorithm(config, scenario, seed=config.seed + _RESUMED * done)
    try:
        if start:
            algorithm.restore_from_path(str(start.folder.resolve()))
        checkpoints = RllibCheckpoints(config.out)
        for k in range(done + 1, config.iterations + 1):
            say(console, f"update {k:>4}: mean return of a robot {_mean_return(algorithm.train()):.3f}")
            if k % config.checkpoint_every == 0 or k == config.iterations:
                checkpoints.save(algorithm, k)
        network = exported(algorithm.get_module(ROBOT).get_state(), config, scenario)
        network.save(config.out / "policy.npz")
    finally:
        algorithm.stop()
    return network


def _mean_return(result: Any) -> float:
    """Of a robot over the episodes that ended in an iteration; nan if none did."""
    returned = result["env_runners"].get("agent_episode_returns_mean", {})
    return float(np.mean([float(value) for value in returned.values()])) if returned else float("nan")


def main(args: Sequence[str] | None = None) -> int:
    """Run from the command line; 0 done, 2 refused, 130 interrupted."""
    kept = "interrupted; with a checkpoint saved, the same command with --resume continues from the last"

    def job(console: Console) -> None:
        train(tyro.cli(documented(RllibConfig), prog="python -m train.rllib", args=args), console=console)

    return exit_code(job, interrupted=kept)


if __name__ == "__main__":
    sys.exit(main())
