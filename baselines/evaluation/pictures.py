"""Draw the pictures of finished results, of one run or joined from several."""

from pathlib import Path

from baselines.evaluation.episodes import Episode
from baselines.evaluation.plan import Plan
from baselines.evaluation.run_folder import PICTURES, Tables, first_trial


def draw(out: Path, plan: Plan, tables: Tables) -> None:
    """Draw ``err.png`` from the tables and ``arena.png`` from the first trial; what fails is a warning."""
    from wifipgo.command.figures import drawing  # noqa: PLC0415

    from baselines.evaluation import plots  # noqa: PLC0415 (matplotlib loads slowly, and only here)

    err, arena = (out / name for name in PICTURES)
    with drawing(err):
        plots.draw_err(err, plan, tables)
    with drawing(arena):
        plots.draw_arena(arena, plan, [Episode.load(path) for path in first_trial(out)])
