"""The training of `train.ppo`: imitation if asked for, PPO, checkpoints, learning curve."""

from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any

import pandas as pd
import torch
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from stable_baselines3 import PPO
from stable_baselines3.common.logger import configure
from stable_baselines3.common.vec_env import VecNormalize

from baselines.evaluation.config import play_command
from baselines.policies import make_policy
from baselines.policies.learned.interfaces import make_interface
from baselines.policies.learned.network import load_network
from baselines.policies.learned.ray_interface import Rays
from baselines.policies.learned.run_files import POLICY
from baselines.policies.registry import specs_of
from train._averages import PolicyAverage
from train._callback import Between
from train._checkpoints import TRAINING, Checkpoints, State, read_state, read_training
from train._config import TrainConfig
from train._config_files import changed_fields, command_of, record_of
from train._dagger import imitate, teachers
from train._export import exported
from train._learning_curve import LEARNED, Curve, arrays_of_table, table_of
from train._model_arrays import arrays_of, begin_with, restore
from train._rays_policy import RaysPolicy
from train._rollouts import environments, rows_of, scenarios_of, selected_scenarios
from train._run_folder import claim
from train._shown_batch import n_for_critic
from train._versions import versions
from train._yaml import read_settings, written
from wifipgo.command.terminal import say
from wifipgo.errors import require
from wifipgo.files.atomic_files import write_json, write_text
from wifipgo.files.folder_lock import held
from wifipgo.files.results_folder import begin, note
from wifipgo.scenarios import Scenario
from wifipgo.threads import one_thread

__all__ = ["Run", "digest", "make_model", "settle_torch", "train"]

# Of torch, whatever the machine has: with other numbers sums are ordered anew.
_THREADS = 2
# Each time a run is continued, its worlds follow another root.
_RESUMED = 7_919
_KIND = "train.ppo"
# Settings without which weights of one run mean nothing in another.
_SHAPES = ("envs.interface ", "ppo.hidden ", "ppo.critic ", "norm.observations ", "norm.reward ")
_FILES = ("config.yaml", "versions.json", "curve.parquet", "curve.png", "tensorboard/")


@one_thread
def train(config: TrainConfig, *, console: Console | None = None) -> "Run":
    """Train, or continue, and leave checkpoints, curve and settings in ``config.out``.

    Call it under ``if __name__ == "__main__":`` where environments have workers.

    Raises:
        ValueError: A setting that is refused, or a checkpoint that does not fit; nothing was changed.
        OSError: A folder that cannot be written.
    """
    settle_torch()
    with held(config.out):
        run = Run(config, console or Console(quiet=True))
        try:
            run.go()
        finally:
            run.norm.close()
    return run


def settle_torch() -> None:
    """Two threads, and no checks of the probabilities of our own network: a tenth of a choice."""
    torch.set_num_threads(_THREADS)
    torch.distributions.Distribution.set_default_validate_args(False)


class Run:
    """One training: model, environments, checkpoints and where it stands."""

    def __init__(self, config: TrainConfig, console: Console) -> None:
        """Claim the folder, make the environments, take up the last checkpoint if there is one to."""
        self.config, self._console = config, console
        self.checkpoints = Checkpoints(config.out)
        _check(config, self.scenario)
        if config.resume:
            self.checkpoints.path()
        first = _checked_first(config) if config.start and not config.resume else None
        claim(config.out, _KIND, resume=config.resume, overwrite=config.overwrite)
        last = self._checked_last() if config.resume else None
        _write_record(config)
        self.norm = environments(config, config.seed)
        self.model = make_model(config, self.norm)
        self.average = PolicyAverage(self.model.policy, config.ppo.average_age)
        self.state, self.best, table = State(), -1.0, None
        self._before: Any = None
        if last is not None:
            table = self._continue(last)
        elif first is not None:
            self._before = dict(load_network(first / POLICY).origin)
            begin_with(read_training(first), self.model, self.norm, where=str(first / TRAINING))
        self.curve = Curve(config.out, selected_scenarios(config), config.selection, table)
        self.model.set_logger(configure(str(config.out / "tensorboard"), ["tensorboard"]))

    @property
    def scenario(self) -> Scenario:
        """That is named first in the settings; its layout is that of the checkpoints."""
        return scenarios_of(self.config)[0]

    def _checked_last(self) -> Path:
        """Checkpoint to go on from, if it fits; says so if it is not the last one."""
        folder, problem = self.checkpoints.latest_intact()
        self.checkpoints.check(folder, self.scenario)
        record = self.config.out / "config.yaml"
        changed = changed_fields(read_settings(record).values, record_of(self.config))
        require(not changed, "resume", f"given with the settings of {record}", changed[:3])
        if problem:
            say(self._console, f"{problem}; going on from {folder.name}, the one before it")
        return folder

    def _continue(self, start: Path) -> pd.DataFrame | None:
        """Take up a checkpoint; what was written after it is of networks that are lost.

        Returns:
            Scores up to there, if they are of the same worlds.
        """
        arrays = read_training(start)
        restore(arrays, self.model, self.norm, where=str(start / TRAINING))
        self.average.restore(arrays, where=str(start / TRAINING))
        self._before = load_network(start / POLICY).origin.get("begun_with")
        self.checkpoints.point("last", start)
        self.state = read_state(start)
        self.model.num_timesteps = self.state.agent_steps
        self.norm.seed(self.config.seed + _RESUMED * (self.state.agent_steps + self.state.imitated))
        best = self.checkpoints.mend_best(start)
        table = table_of(arrays, self.config.selection, where=str(start / TRAINING))
        self.best = best if table is not None else -1.0
        return table

    def go(self) -> None:
        """Imitate if asked to, then PPO; evaluate on the way and at the end."""
        config = self.config
        say(self._console, f"{self.scenario.name}, seed {config.seed}: results in {config.out}")
        with _bar(self._console) as progress:
            if config.imitation.policy and not self.state.imitated:
                self._imitate(progress)
            if self.state.agent_steps < config.ppo.agent_steps:
                self._improve(progress)
        say(self._console, f"weights at the end: sha256 {digest(self.model)}")
        say(self._console, f"best mean mapped share on the worlds of the selection: {self.best:.3f}")
        self.checkpoints.path("best")
        envs = self.config.envs
        say(self._console, f"run it: {play_command(envs.scenario, self.config.out, envs.overrides)}")

    def evaluated(self, updates: int) -> float:
        """Score of the model as it is; saves it, as the best if it is."""
        steps, imitated = self.model.num_timesteps, self.state.imitated
        network = exported(
            self.average.policy,
            self.norm,
            self.scenario,
            interface=self.config.envs.interface,
            origin={
                "command": command_of(self.config),
                "settings": record_of(self.config),
                **({} if self._before is None else {"begun_with": self._before}),
                "agent_steps": steps,
                "imitated": imitated,
                "versions": versions(),
            },
        )
        score = self.curve.evaluated(network, imitated + steps)
        self.state = State(agent_steps=steps, imitated=imitated, updates=updates, score=score)
        arrays = arrays_of(self.model, self.norm) | self.average.arrays() | arrays_of_table(self.curve.table)
        self.checkpoints.save(arrays, network, self.state, best=score > self.best)
        self.best = max(self.best, score)
        self.curve.write()  # last: a run that is killed before leaves no scores of a network that is lost
        say(self._console, f"{imitated + steps:>9} agent-steps: mapped share {score:.3f}")
        return score

    def _imitate(self, progress: Progress) -> None:
        cfg = self.config.imitation
        task = progress.add_task(f"imitating {cfg.policy}", total=cfg.rounds * cfg.agent_steps)
        steps = imitate(self.model, self.norm, self.config, on_step=partial(progress.advance, task))
        self.state = State(imitated=steps)
        self.evaluated(0)

    def _improve(self, progress: Progress) -> None:
        total, done = self.config.ppo.agent_steps, self.state.agent_steps
        task = progress.add_task("PPO", total=total, completed=done)
        between = Between(
            self.config,
            updates=self.state.updates,
            progress=progress,
            task=task,
            evaluate=self.evaluated,
            learned=self.average.update,
        )
        self.model.learn(total - done, callback=between, reset_num_timesteps=done == 0)
        self.evaluated(between.updates)


def make_model(config: TrainConfig, norm: VecNormalize) -> PPO:
    """PPO with the network of the interface, its weights drawn from the seed."""
    cfg, hidden = config.ppo, list(config.ppo.hidden)
    interface = make_interface(config.envs.interface, scenarios_of(config)[0])
    sizes = {"hidden": hidden, "n_critic": n_for_critic(interface, cfg.critic)}
    plain = {"net_arch": {"pi": hidden, "vf": hidden}, "activation_fn": torch.nn.Tanh, "log_std_init": -0.5}
    return PPO(
        RaysPolicy if isinstance(interface, Rays) else "MlpPolicy",
        norm,
        learning_rate=partial(_rate, cfg.learning_rate),
        n_steps=cfg.n_steps,
        batch_size=cfg.batch_size,
        n_epochs=cfg.n_epochs,
        gamma=cfg.gamma,
        gae_lambda=cfg.gae_lambda,
        clip_range=cfg.clip_range,
        ent_coef=cfg.ent_coef,
        vf_coef=cfg.vf_coef,
        max_grad_norm=cfg.max_grad_norm,
        target_kl=cfg.target_kl or None,
        policy_kwargs=sizes | {"n_whole": interface.n_whole} if isinstance(interface, Rays) else plain,
        seed=config.seed,
        device="cpu",
    )


def digest(model: PPO) -> str:
    """Fingerprint of all weights, to the bit: two runs of one seed have the same."""
    weights = model.policy.state_dict()
    parts = [weights[name].numpy().tobytes() for name in sorted(weights)]
    return sha256(b"".join(parts)).hexdigest()[:16]


def _rate(first: float, left: float | int) -> float:
    """Learning rate by the share of the training that is left: down to a tenth in a straight line."""
    return first * (0.1 + 0.9 * min(max(left, 0.0), 1.0))


def _check(config: TrainConfig, scenario: Scenario) -> None:
    """Refuse, before anything runs or is written, what could not run.

    Raises:
        ValueError: A scripted policy that does not exist, or batches that do not divide what is collected.
    """
    labels = [spec.label for spec in specs_of(config.selection.policies)]
    require(LEARNED not in labels, "selection.policies", f"named other than {LEARNED!r}", labels)
    played = selected_scenarios(config)
    for spec in config.selection.policies:
        for each in played:
            make_policy(spec, each)
    if config.imitation.policy:
        teachers(config)
    rows, n_steps = rows_of(config), config.ppo.n_steps
    rule = f"a divisor of {rows * n_steps}, what {rows} agents collect in ppo.n_steps={n_steps}"
    require(rows * n_steps % config.ppo.batch_size == 0, "ppo.batch_size", rule, config.ppo.batch_size)


def _checked_first(config: TrainConfig) -> Path:
    """Checkpoint to begin with, of a network of the same shape.

    Raises:
        BadInputError: There is none, or it is damaged.
        ValueError: A setting that shapes the network is another; names it.
    """
    run = Path(config.start)
    folder, record = Checkpoints(run).intact("best"), run / "config.yaml"
    there, here = read_settings(record).values, record_of(config)
    other = [field for field in changed_fields(there, here) if field.startswith(_SHAPES)]
    require(not other, "start", f"a run with the same network: see {record}", other)
    return folder


def _write_record(config: TrainConfig) -> None:
    """Make the folder and write the settings down."""
    begin(config.out, _KIND)
    note(config.out, _FILES)
    write_text(config.out / "config.yaml", written(record_of(config)))
    write_json(config.out / "versions.json", versions())


def _bar(console: Console) -> Progress:
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    return Progress(*columns, console=Console(stderr=True, quiet=console.quiet))
