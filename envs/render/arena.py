"""The arena half of a picture. What stays is drawn once and kept; the rest is drawn on a copy of it."""

import numpy as np
import pygame
from jaxtyping import Bool, Float, Int

from envs.render import marks
from envs.render.scene import Camera, Scene
from envs.render.text import write
from wifipgo.command import palette
from wifipgo.scenarios import Scenario
from wifipgo.state import World
from wifipgo.world.coverage import CELL_M

_MANY = 8  # more robots than this get small marks
# Everything is drawn this much larger and scaled down smoothly, the cheapest way to smooth edges; of many
# robots less, for speed.
_OVERSAMPLE, _OVERSAMPLE_MANY = 2.0, 1.5
_MARGIN = 0.045
_LOBE = 0.13
_LEAST_TEXT_PX = 28.0


class ArenaPainter:
    """Draws the arena of one episode; keeps floor, walls and true trajectories between frames.

    The picture depends on the scene alone: where a scene does not continue the last one,
    what was kept is drawn anew.
    """

    def __init__(self, world: World, scenario: Scenario, side_px: int) -> None:
        """Lay out the room on a square."""
        self._world, self._room_m = world, scenario.arena.size_m
        few = scenario.n_robots <= _MANY
        self._side_px = round((_OVERSAMPLE if few else _OVERSAMPLE_MANY) * side_px)
        self._camera = Camera.on_square(self._side_px, self._room_m, margin_px=_MARGIN * self._side_px)
        self._size = self._side_px / (76.0 if few else 130.0)
        self._of = [palette.robot_colour(robot) for robot in range(scenario.n_robots)]
        self._big = pygame.Surface((self._side_px, self._side_px))
        self._ground = pygame.Surface((self._side_px, self._side_px))
        self._poses, self._seen = np.zeros((0, 0, 3)), np.zeros((0, 0), dtype=bool)

    def paint(self, scene: Scene, target: pygame.Surface) -> None:
        """Draw a scene on a surface of the side that was asked for."""
        self._update_ground(scene)
        self._big.blit(self._ground, (0, 0))
        if scene.under_way:
            steps = self._camera.px(scene.true[:, -2:, :2])
            marks.ribbons(self._big, steps, self._of, self._size)
        now, believed = self._camera.px(scene.true[:, -1, :2]), self._camera.px(scene.estimate[..., :2])
        self._links(scene, now)
        self._estimates(scene, believed)
        self._calls(scene, now)
        self._robots(scene, now, believed[:, -1])
        self._meetings(scene, now)
        pygame.transform.smoothscale(self._big, target.get_size(), target)

    def _update_ground(self, scene: Scene) -> None:
        """Add what is new to what is kept."""
        n_old, true = self._poses.shape[1], scene.true[:, :-1] if scene.under_way else scene.true
        goes_on = np.array_equal(true[:, :n_old], self._poses) and not (self._seen & ~scene.seen).any()
        if n_old == 0 or not goes_on:
            self._bare_ground()
            n_old, self._seen = 0, np.zeros_like(scene.seen)
        self._show_cells(scene.seen & ~self._seen)
        for t in range(n_old, true.shape[1]):  # in the order of time, as if every tick had been drawn
            steps = self._camera.px(true[:, max(t - 1, 0) : t + 1, :2])
            marks.ribbons(self._ground, steps, self._of, self._size)
        self._poses, self._seen = true, scene.seen

    def _room_px(self) -> pygame.Rect:
        """The floor of the room on the surface."""
        camera, side = self._camera, self._room_m * self._camera.px_per_m
        return pygame.Rect(round(camera.left_px), round(camera.bottom_px - side), round(side), round(side))

    def _bare_ground(self) -> None:
        """Paper, floor that nobody has seen, obstacles, a scale."""
        camera = self._camera
        self._ground.fill(palette.PAPER)
        self._ground.fill(palette.UNSEEN, self._room_px())
        self._obstacles()
        length_m = max((m for m in (0.5, 1, 2, 5, 10, 20, 50, 100) if m <= self._room_m / 4), default=0.5)
        end = camera.left_px + length_m * camera.px_per_m
        y = camera.bottom_px + 0.022 * self._side_px
        pygame.draw.line(self._ground, palette.INK, (camera.left_px, y), (end, y), 4)
        for x in (camera.left_px, end):
            pygame.draw.line(self._ground, palette.INK, (x, y - 8), (x, y + 8), 4)
        place = (end + 0.012 * self._side_px, y)
        size = max(0.025 * self._side_px, _LEAST_TEXT_PX)
        write(self._ground, f"{length_m:g} m", place, size, palette.INK, middle=True)

    def _show_cells(self, new: Bool[np.ndarray, "cells cells"]) -> None:
        """Floor that came into view turns bright where nothing is drawn on it yet."""
        edges = np.diff(new, axis=0, prepend=False, append=False)  # of runs of cells side by side
        ends = np.argwhere(edges.T)[:, ::-1].reshape(-1, 2, 2)
        corners_m = CELL_M * (ends + np.array([[0, 1], [0, 0]]))
        unseen, seen = (self._ground.map_rgb(colour) for colour in (palette.UNSEEN, palette.SEEN))
        pixels = pygame.surfarray.pixels2d(self._ground)
        boxes = np.rint(self._camera.px(np.minimum(corners_m, self._room_m))).astype(int)
        for (left, top), (right, bottom) in boxes.tolist():
            run = pixels[left:right, top:bottom]
            np.copyto(run, seen, where=run == unseen)

    def _obstacles(self) -> None:
        """Obstacles and walls."""
        for corners_m in self._world.layout.obstacles_m:
            corners = self._camera.px(corners_m).tolist()
            pygame.draw.polygon(self._ground, palette.OBSTACLE, corners)
            pygame.draw.polygon(self._ground, palette.WALL, corners, 3)
        walls = self._camera.px(self._world.layout.walls_m)
        for begin, end in walls.tolist():
            pygame.draw.line(self._ground, palette.WALL, begin, end, 6)

    def _links(self, scene: Scene, now: Float[np.ndarray, "robots 2"]) -> None:
        """Who hears whom, fast links on top."""
        order = np.argsort(scene.rate_share, kind="stable")
        marks.links(self._big, now[scene.pairs[order]], scene.rate_share[order], self._size)

    def _estimates(self, scene: Scene, believed: Float[np.ndarray, "robots times 2"]) -> None:
        """Estimated trajectories, and how sure robots can be of their ends."""
        marks.threads(self._big, believed, self._of, self._size)
        rings = self._camera.px(scene.rings_m)
        reach = (rings.max(axis=1) - rings.min(axis=1)).max(axis=1)
        wide = np.flatnonzero(reach > 4.0 * self._size)  # the others hide behind their robots
        self._big.set_clip(self._room_px())  # robots know that they are in the room
        marks.rings(self._big, rings[wide], self._chosen(wide), self._size)
        self._big.set_clip(None)

    def _chosen(self, robots: Int[np.ndarray, " chosen"]) -> list[palette.Colour]:
        """Colours of some robots."""
        return [self._of[robot] for robot in robots.tolist()]

    def _calls(self, scene: Scene, now: Float[np.ndarray, "robots 2"]) -> None:
        """Calls, and the direction from which their callees hear them."""
        for (caller, callee), lobe in zip(scene.calls.tolist(), scene.lobes, strict=True):
            outline = now[callee] + _LOBE * self._side_px * lobe * np.array([1.0, -1.0])
            marks.lobe(self._big, outline)
            marks.call(self._big, now[caller], now[callee], self._size)
            marks.waves(self._big, now[caller], self._size)

    def _robots(
        self, scene: Scene, now: Float[np.ndarray, "robots 2"], believed: Float[np.ndarray, "robots 2"]
    ) -> None:
        """Robots as they believe to be, tied to the robots as they are."""
        lost = np.flatnonzero(((believed - now) ** 2).sum(axis=1) > (0.5 * self._size) ** 2)
        of = self._chosen(lost)
        marks.dashes(self._big, believed[lost], now[lost], of, 0.5 * self._size, width=2)
        marks.ghosts(self._big, believed[lost], scene.estimate[lost, -1, 2], of, self._size)
        marks.robots(self._big, now, scene.true[:, -1, 2], self._of, self._size)

    def _meetings(self, scene: Scene, now: Float[np.ndarray, "robots 2"]) -> None:
        """A small star where each robot last met, a large one where robots meet now."""
        marks.stars(self._big, self._camera.px(scene.last_met_m), 1.1 * self._size)
        for group in map(np.array, scene.met):
            members = now[group]
            middle = members.mean(axis=0)
            reach = float(np.hypot(*(members - middle).T).max())
            marks.glow(self._big, middle, reach + 4.0 * self._size)
            marks.robots(self._big, members, scene.true[group, -1, 2], self._chosen(group), self._size)
            far = reach + 3.6 * self._size  # hides nobody
            beside = middle + np.array([0.0, -far if middle[1] > far + 2.2 * self._size else far])
            marks.stars(self._big, beside[None], 2.0 * self._size)
