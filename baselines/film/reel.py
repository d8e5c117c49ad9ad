"""Scenes of an episode as a film has them: every iteration, and robots on their way between two."""

from collections.abc import Callable, Iterator, Sequence
from itertools import zip_longest

from envs.render.in_between import in_between
from envs.render.scene import Scene, scene_of
from wifipgo.scenarios import Scenario
from wifipgo.state import Tick, World

FASTEST = 50  # pictures a second: what a GIF can say and a player shows


def pictures_an_iteration(between: int, fps: int) -> int:
    """How many pictures show an iteration: as many as asked for, unless there is no time for them."""
    return max(1, min(between + 1, FASTEST // fps))


class Reel:
    """Passes scenes on as they come, those between two iterations included.

    Args:
        scenario: What is played.
        between: Pictures between two iterations.
        show: Takes each scene.
    """

    def __init__(self, scenario: Scenario, between: int, show: Callable[[Scene, World], object]) -> None:
        """Begin before the first scene."""
        self._scenario, self._between, self._show = scenario, between, show
        self._last: Scene | None = None

    def add(self, tick: Tick, world: World) -> None:
        """Show how robots got here, then the tick."""
        scene = scene_of(tick, self._scenario)
        if self._last is not None:
            for step in in_between(self._last, scene, self._between):
                self._show(step, world)
        self._show(scene, world)
        self._last = scene


def together(reels: Sequence[Sequence[Scene]]) -> Iterator[list[Scene]]:
    """Scenes of several episodes at the same time; one that ended earlier stands as it did then."""
    for scenes in zip_longest(*reels):
        yield [scene or reel[-1] for scene, reel in zip(scenes, reels, strict=True)]
