"""An episode as a recording for the Rerun viewer: everything in space, and errors over iterations."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from jaxtyping import Float

from envs.render.scene import Scene, lobes, scene_of
from wifipgo.command.palette import CALL, LOBE, MEETING, OBSTACLE, WALL, rate_colours, robot_colour
from wifipgo.graph.metrics import ate_rot, ate_trans
from wifipgo.rendezvous import NOBODY
from wifipgo.scenarios import Scenario
from wifipgo.state import Belief, Tick, World

TIMELINE = "iteration"
_CURVES = ("err", "ate_trans", "ate_rot")
_LOBE_SHARE = 0.13  # length of the longest lobe, of the room's side
_PALE = 110  # opacity of what is believed rather than true


class Timeline:
    """Writes ticks to a recording. Nothing is shown and no port is opened."""

    def __init__(self, path: Path, scenario: Scenario, *, name: str) -> None:
        """Begin a recording."""
        self._scenario, self._has_still = scenario, False
        self._to = rr.RecordingStream("wifipgo")
        self._to.save(path, default_blueprint=_views())
        self._to.send_recording_name(name)
        self._to.set_log_time_enabled(False)

    def add(self, tick: Tick, world: World) -> None:
        """Write one iteration, and before the first what stands still."""
        if not self._has_still:
            self._still(world)
        scene, belief = scene_of(tick, self._scenario), tick.belief
        self._to.set_time(TIMELINE, sequence=scene.t)
        self._robots("true", scene.true, 255)
        self._robots("estimate", scene.estimate, _PALE)
        self._graph(belief)
        self._radio(scene, belief)
        met_m = np.array([scene.true[list(group), -1, :2].mean(axis=0) for group in scene.met]).reshape(-1, 2)
        self._to.log("space/met", rr.Points3D(_raised(met_m), colors=MEETING, radii=self._size(0.02)))
        self._errors(tick)

    def _still(self, world: World) -> None:
        """Walls, obstacles, and how the curves look."""
        self._to.log("space", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        self._strips("space/walls", world.layout.walls_m, [WALL] * len(world.layout.walls_m), static=True)
        closed = [np.concatenate([corners, corners[:1]]) for corners in world.layout.obstacles_m]
        self._strips("space/obstacles", closed, [OBSTACLE] * len(closed), static=True)
        for robot in range(self._scenario.n_robots):
            for curve in _CURVES:
                style = rr.SeriesLines(colors=robot_colour(robot), names=f"robot {robot}")
                self._to.log(f"{curve}/robot_{robot}", style, static=True)
        self._to.log("err/threshold", rr.SeriesLines(colors=CALL, names="threshold"), static=True)
        self._has_still = True

    def close(self) -> None:
        """Write what is left and let go of the file."""
        self._to.flush()
        self._to.disconnect()

    def _size(self, share: float) -> float:
        """Length by the room's side, m."""
        return share * self._scenario.arena.size_m

    def _strips(
        self,
        entity: str,
        strips_m: Sequence[np.ndarray] | np.ndarray,
        colours: Sequence[Sequence[int]],
        *,
        width: float = 0.002,
        static: bool = False,
    ) -> None:
        """Lines in the plane, a colour each."""
        lines = [_raised(strip_m) for strip_m in strips_m]
        self._to.log(entity, rr.LineStrips3D(lines, colors=colours, radii=self._size(width)), static=static)

    def _robots(self, which: str, poses: Float[np.ndarray, "robots times 3"], opacity: int) -> None:
        """Trajectories, and where they end as arrows."""
        colours = [(*robot_colour(robot), opacity) for robot in range(len(poses))]
        self._strips(f"space/{which}/paths", poses[..., :2], colours)
        now, yaw_rad = poses[:, -1, :2], poses[:, -1, 2]
        ahead = self._size(0.035) * np.stack([np.cos(yaw_rad), np.sin(yaw_rad)], axis=1)
        arrows = rr.Arrows3D(
            origins=_raised(now), vectors=_raised(ahead), colors=colours, radii=self._size(0.006)
        )
        self._to.log(f"space/{which}/robots", arrows)

    def _graph(self, belief: Belief) -> None:
        """Measurements as lines between the poses that they relate, as these are now believed to be."""
        edges, estimate = belief.log.edges, belief.paths.estimate[..., :2]
        ends = np.stack([estimate[tuple(edges.tail.T)], estimate[tuple(edges.head.T)]], axis=1)
        apart = np.abs(edges.tail[:, 1] - edges.head[:, 1]) > 1
        for name, rows in (
            ("between_robots", edges.between_robots),
            ("places_seen_again", ~edges.between_robots & apart),
        ):
            colours = [robot_colour(robot) for robot in edges.tail[rows, 0].tolist()]
            self._strips(f"space/graph/{name}", ends[rows], colours, width=0.001)

    def _radio(self, scene: Scene, belief: Belief) -> None:
        """Links, calls, and every profile that a robot listens to."""
        now = scene.true[:, -1, :2]
        self._strips("space/links", now[scene.pairs], rate_colours(scene.rate_share))
        self._strips("space/calls", now[scene.calls], [CALL] * len(scene.calls), width=0.004)
        robot, slot = np.nonzero(belief.radio.slots != NOBODY)
        outlines_m = self._size(_LOBE_SHARE) * lobes(
            belief.radio.profile[robot, slot], scene.true[robot, -1, 2]
        )
        self._strips("space/profiles", now[robot, None] + outlines_m, [LOBE] * len(robot))

    def _errors(self, tick: Tick) -> None:
        """A point of each curve."""
        truth, belief = tick.truth.poses, tick.belief.paths.estimate
        values = (tick.belief.err, ate_trans(belief, truth), ate_rot(belief, truth))
        for curve, of_robots in zip(_CURVES, values, strict=True):
            for robot, value in enumerate(of_robots.tolist()):
                self._to.log(f"{curve}/robot_{robot}", rr.Scalars(value))
        self._to.log("err/threshold", rr.Scalars(self._scenario.rendezvous.err_threshold))


def _raised(p_m: Float[np.ndarray, "*batch 2"]) -> Float[np.ndarray, "*batch 3"]:
    """Points of the plane in space: the viewer's plane has its y axis pointing down."""
    return np.concatenate([p_m, np.zeros((*p_m.shape[:-1], 1))], axis=-1)


def _views() -> rrb.Blueprint:
    """Space on the left, curves on the right."""
    curves = [rrb.TimeSeriesView(origin=f"/{curve}", name=curve) for curve in _CURVES]
    space = rrb.Spatial3DView(origin="/space", name="arena")
    return rrb.Blueprint(rrb.Horizontal(space, rrb.Vertical(*curves), column_shares=[3, 2]))
