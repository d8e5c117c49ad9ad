"""One policy on one world, to look at: ``wifipgo watch --help``."""

import sys
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path

import tyro
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from baselines.evaluation.episodes import Episode, OnTick, run_episode
from baselines.evaluation.labels import wrapped
from baselines.film.config import WatchConfig, checked
from baselines.film.reel import Reel, pictures_an_iteration, together
from baselines.film.video import film
from baselines.policies.registry import remarks
from envs.render.config import RenderConfig
from envs.render.scene import Scene
from wifipgo.command.command_line import exit_code
from wifipgo.command.docstrings import documented
from wifipgo.command.overrides import joined
from wifipgo.command.terminal import Terminal, say
from wifipgo.files.atomic_files import appearing
from wifipgo.scenarios import Scenario
from wifipgo.state import Tick, World

__all__ = ["WatchConfig", "main", "watch"]

_CAPTION_WIDTH, _NAME_WIDTH = 34, 20  # letters beside and above an arena


def watch(config: WatchConfig, *, console: Console | None = None) -> list[Episode]:
    """Play an episode of each policy and write what was asked for.

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
    for remark in remarks(config.specs, scenario):
        say(console, f"note: {remark}")
    episodes = []
    with ExitStack() as stack:
        eyes = [stack.enter_context(eye) for eye in _eyes(config, scenario)]
        bar = stack.enter_context(_bar(scenario, len(config.played), quiet=console.quiet))

        def on_tick(tick: Tick, world: World) -> None:
            if config.until is None or tick.belief.t <= config.until:
                for eye in eyes:
                    eye(tick, world)
            bar(tick, world)

        for spec in config.specs:
            episodes.append(run_episode(scenario, str(spec), seed, label=spec.label, on_tick=on_tick))
    for policy, episode in zip(config.played, episodes, strict=True):
        _report(episode, policy if len(episodes) > 1 else "", console)
    for path in (config.out, config.rerun):
        if path is not None:
            say(console, f"written: {path}")
    return episodes


def _eyes(config: WatchConfig, scenario: Scenario) -> Iterator[AbstractContextManager[OnTick]]:
    """What looks at every tick."""
    if config.out is not None:
        camera = _camera if len(config.played) == 1 else _cameras
        yield camera(config.out, config, scenario)
    if config.rerun is not None:
        yield _recorder(config.rerun, config, scenario)


@contextmanager
def _camera(path: Path, config: WatchConfig, scenario: Scenario) -> Iterator[OnTick]:
    """Draw ticks into the film."""
    from envs.render.viewer import Viewer  # noqa: PLC0415 (belongs to an extra)

    viewer = Viewer(
        RenderConfig(
            height_px=config.height_px, caption=wrapped(config.caption, _CAPTION_WIDTH, most_lines=1)
        )
    )
    n = _pictures(config)
    with film(path, fps=config.fps * n) as add:
        yield Reel(scenario, n - 1, lambda scene, world: add(viewer.frame_of(scene, world, scenario))).add


@contextmanager
def _cameras(path: Path, config: WatchConfig, scenario: Scenario) -> Iterator[OnTick]:
    """Keep what every policy did, and draw it side by side when all are done."""
    from envs.render.side_by_side import SideBySide  # noqa: PLC0415 (belongs to an extra)

    reels: list[list[Scene]] = []
    worlds: list[World] = []
    n = _pictures(config)

    def take(scene: Scene, world: World) -> None:
        reels[-1].append(scene)

    def on_tick(tick: Tick, world: World) -> None:
        if tick.belief.t == 0:
            worlds.append(world)
            reels.append([])
            reel[:] = [Reel(scenario, n - 1, take)]
        reel[0].add(tick, world)

    reel: list[Reel] = []
    with film(path, fps=config.fps * n) as add:
        yield on_tick
        names = [wrapped(name, _NAME_WIDTH, most_lines=1) for name in config.played]
        picture = SideBySide(worlds, scenario, names, config.height_px)
        for scenes in together(reels):
            add(picture.frame(scenes))


def _pictures(config: WatchConfig) -> int:
    """Pictures an iteration; a still needs the last one only."""
    still = config.out is not None and config.out.suffix.lower() == ".png"
    return pictures_an_iteration(0 if still else config.between, config.fps)


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
def _bar(scenario: Scenario, n_policies: int, *, quiet: bool) -> Iterator[OnTick]:
    """Show how far the episodes are."""
    columns = (TextColumn("iterations"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True, quiet=quiet)) as progress:
        task = progress.add_task("", total=scenario.n_steps * n_policies)
        yield lambda tick, world: progress.advance(task, float(tick.belief.t > 0))


def _report(episode: Episode, name: str, console: Console) -> None:
    """The episode in a few numbers."""
    figures, before = episode.figures, f"{name}: " if name else ""
    err = f"Err, last 10 iterations: {figures['err_last10']:.3g}"
    say(
        console,
        f"{before}{err}; rendezvous: {figures['rendezvous']:.0f}\n"
        f"ATE: {figures['ate_trans']:.3g} m² in translation, {figures['ate_rot']:.2g} in rotation; "
        f"floor seen: {100.0 * figures['coverage']:.0f} %",
    )


def main(args: Sequence[str] | None = None) -> int:
    """Run from the command line; the exit code is that of `wifipgo.command.command_line`."""

    def job() -> None:
        watch(
            tyro.cli(documented(WatchConfig), prog="wifipgo watch", args=joined(args)),
            console=Terminal(),
        )

    return exit_code(job)


if __name__ == "__main__":
    sys.exit(main())
