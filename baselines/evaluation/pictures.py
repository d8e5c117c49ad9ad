"""Draw the pictures of finished results, of one run or joined from several."""

from collections.abc import Sequence
from pathlib import Path

from baselines.evaluation import run_folder
from baselines.evaluation.episodes import Episode, trial_seed
from baselines.evaluation.jobs import Task, missing
from baselines.evaluation.median_trial import median_trial
from baselines.evaluation.plan import Plan
from baselines.evaluation.run_folder import MEDIAN, PICTURES, Tables


def episodes_to_show(plan: Plan, tables: Tables) -> list[str]:
    """Names of the files of the median trial's episodes, policy by policy."""
    return [task.path.name for task in _tasks(plan, tables, Path())]


def _tasks(plan: Plan, tables: Tables, folder: Path) -> list[Task]:
    """The median trial of every policy."""
    trial = median_trial(tables.episodes).number
    seed, path = trial_seed(plan.seed, trial), run_folder.episode_path
    return [
        Task(plan.scenario, spec.label, trial, seed, path(folder, place, trial), str(spec))
        for place, spec in enumerate(plan.specs)
    ]


def draw(out: Path, plan: Plan, tables: Tables) -> None:
    """Draw ``score.png`` and ``err.png`` from the tables, ``arena.png`` from the median trial.

    Episodes of that trial that are not at hand, because parts were joined or a finished run went
    on, are played again. What fails is a warning.
    """
    from wifipgo.command.figures import drawing  # noqa: PLC0415

    from baselines.evaluation.arena_picture import draw_arena  # noqa: PLC0415 (matplotlib loads slowly,
    from baselines.evaluation.err_picture import draw_err  # noqa: PLC0415 and only here)
    from baselines.evaluation.score_picture import draw_score  # noqa: PLC0415

    score, err, arena = (out / name for name in PICTURES)
    with drawing(score):
        draw_score(score, plan, tables)
    with drawing(err):
        draw_err(err, plan, tables)
    with drawing(arena):
        draw_arena(arena, plan, _played(_tasks(plan, tables, out / MEDIAN)), median_trial(tables.episodes))


def _played(tasks: Sequence[Task]) -> dict[str, Episode]:
    """Episodes by policy, played now where there is none."""
    for task in missing(tasks):
        task.keep(task.compute())
    return {task.policy: Episode.load(task.path) for task in tasks}
