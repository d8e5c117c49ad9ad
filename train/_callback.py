"""What happens between updates: progress bar, evaluations, checkpoints."""

from collections.abc import Callable

from rich.progress import Progress, TaskID
from stable_baselines3.common.callbacks import BaseCallback

from train._config import TrainConfig
from train._rays_policy import actor_parameters


class Between(BaseCallback):
    """Moves the bar, holds the policy still while only the value learns, and calls for evaluations.

    Args:
        config: Settings.
        updates: Updates of a run that is continued.
        progress: Bar to move.
        task: Its place.
        evaluate: Called with the updates so far when an evaluation is due, and says the score.
        learned: Called when an update is over.
    """

    def __init__(
        self,
        config: TrainConfig,
        *,
        updates: int,
        progress: Progress,
        task: TaskID,
        evaluate: Callable[[int], float],
        learned: Callable[[], None],
    ) -> None:
        """Nothing happens yet."""
        super().__init__()
        self.updates = updates
        self._config, self._progress, self._task, self._evaluate = config, progress, task, evaluate
        self._learned, self._learning = learned, False
        self._due = config.selection.every

    def _on_training_start(self) -> None:
        every = self._config.selection.every
        self._due = self.num_timesteps + every if every else 0

    def _on_step(self) -> bool:
        self._progress.update(self._task, completed=self.num_timesteps)
        return True

    def _on_rollout_start(self) -> None:
        """The last update is over: look at what it made, if it is time to."""
        self._end_update()
        if self._due and self.num_timesteps >= self._due:
            self._due += self._config.selection.every
            self.logger.record("selection/mapped_share", self._evaluate(self.updates))
        for parameter in actor_parameters(self.model.policy):  # type: ignore[arg-type]
            parameter.requires_grad_(self.updates >= self._config.ppo.critic_only)

    def _on_rollout_end(self) -> None:
        self.updates += 1
        self._learning = True

    def _on_training_end(self) -> None:
        self._end_update()

    def _end_update(self) -> None:
        if self._learning:
            self._learned()
            self._learning = False
