"""One policy on one world, to look at: ``wifipgo watch --help``."""

import sys
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path

import tyro
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from baselines.evaluation.episodes import Episode, OnTick, run_episode
from baselines.film.config import WatchConfig, checked
from baselines.film.video import film
from envs.render.config import RenderConfig
from wifipgo.command.command_line import exit_code
from wifipgo.command.docstrings import documented
from wifipgo.command.overrides import joined
from wifipgo.command.terminal import Terminal, say
from wifipgo.files.atomic_files import appearing
from wifipgo.scenarios import Scenario
from wifipgo.state import Tick, World

__all__ = ["WatchConfig", "main", "watch"]


def watch(config: WatchConfig, *, console: Console | None = None) -> Episode:
    """Play an episode and write what was asked for.

    Args:
        config: What to play and what to write.
        console: Where to print; nowhere if None.

    Raises:
        ValueError: A setting that is refused; nothing was written.
        MissingExtraError: Packages that draw or record are not installed.
        OSError: A file that cannot be written.
    """
    console = console or Console(quiet=True)
    scenario, seed = checked(config), config.world_seed
    size = f"{scenario.n_robots} robots, {scenario.n_steps} iterations"
    say(console, f"{scenario.name}: {size}\n{config.caption}")
    with ExitStack() as stack:
        eyes = [stack.enter_context(eye) for eye in _eyes(config, scenario)]
        bar = stack.enter_context(_bar(scenario, quiet=console.quiet))

        def on_tick(tick: Tick, world: World) -> None:
            if config.until is None or tick.belief.t <= config.until:
                for eye in eyes:
                    eye(tick, world)
            bar(tick, world)

        episode = run_episode(scenario, config.policy, seed, on_tick=on_tick)
    _report(episode, config, console)
    return episode


def _eyes(config: WatchConfig, scenario: Scenario) -> Iterator[AbstractContextManager[OnTick]]:
    """What looks at every tick."""
    if config.out is not None:
        yield _camera(config.out, config, scenario)
    if config.rerun is not None:
        yield _recorder(config.rerun, config, scenario)


@contextmanager
def _camera(path: Path, config: WatchConfig, scenario: Scenario) -> Iterator[OnTick]:
    """Draw ticks into the film."""
    from envs.render.viewer import Viewer  # noqa: PLC0415 (belongs to an extra)

    viewer = Viewer(RenderConfig(height_px=config.height_px, caption=config.caption))
    with film(path, fps=config.fps) as add:
        yield lambda tick, world: add(viewer.frame(tick, world, scenario))


@contextmanager
def _recorder(path: Path, config: WatchConfig, scenario: Scenario) -> Iterator[OnTick]:
    """Write ticks into the recording."""
    from baselines.film.rerun_log import Timeline  # noqa: PLC0415 (belongs to an extra)

    with appearing(path, by_suffix=True) as partial:
        timeline = Timeline(partial, scenario, name=f"{scenario.name}: {config.caption}")
        try:
            yield timeline.add
        finally:
            timeline.close()


@contextmanager
def _bar(scenario: Scenario, *, quiet: bool) -> Iterator[OnTick]:
    """Show how far the episode is."""
    columns = (TextColumn("iterations"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True, quiet=quiet)) as progress:
        task = progress.add_task("", total=scenario.n_steps)
        yield lambda tick, world: progress.update(task, completed=tick.belief.t)


def _report(episode: Episode, config: WatchConfig, console: Console) -> None:
    """The episode in a few numbers, and where its files are."""
    figures = episode.figures
    say(
        console,
        f"Err, last 10 iterations: {figures['err_last10']:.3g}; rendezvous: {figures['rendezvous']:.0f}\n"
        f"ATE: {figures['ate_trans']:.3g} m² in translation, {figures['ate_rot']:.2g} in rotation; "
        f"floor seen: {100.0 * figures['coverage']:.0f} %",
    )
    for path in (config.out, config.rerun):
        if path is not None:
            say(console, f"written: {path}")


def main(args: Sequence[str] | None = None) -> int:
    """Run from the command line; the exit code is that of `wifipgo.command.command_line`."""
    kept = "interrupted; nothing was written"

    def job() -> None:
        watch(
            tyro.cli(documented(WatchConfig), prog="wifipgo watch", args=joined(args)),
            console=Terminal(),
        )

    return exit_code(job, interrupted=kept)


if __name__ == "__main__":
    sys.exit(main())
