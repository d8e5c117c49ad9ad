"""What an iteration hands to the next: the standing worlds, the truth, and what the robots believe.

Robots of all worlds of a batch are rows (`wifipgo.rows`); a pair table is rows x peers, a peer being a
number within its own world. A belief has a part for each owner: the stage of the loop that makes it. A stage
takes the parts that it reads and returns the one that it owns, so who may change what is read off the
signatures.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.graph.anchor_bearings import Pings
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.edges import Edges
from wifipgo.graph.per_robot_smoothing import PerRobotSmoothers
from wifipgo.graph.smoother_updates import Smoothing
from wifipgo.radio.channel.impairments import EpisodeImpairments
from wifipgo.radio.propagation.scenes import Scenes
from wifipgo.radio.propagation.surfaces import Surfaces
from wifipgo.rendezvous import Calls
from wifipgo.rows import Rows
from wifipgo.world.arena import Arena
from wifipgo.world.coverage import CellMap
from wifipgo.world.coverage_belief import CoverageBelief
from wifipgo.world.layout import Layout


class Scene(NamedTuple):
    """What stands where now; the same object for as long as nothing moves.

    Attributes:
        faces_m: Edges of the obstacles: what hides.
        edges_m: The same and the walls: what a ray of the lidar ends at.
        surfaces: What the radio sees of them; one scene where those of all worlds are alike.
    """

    faces_m: Float[np.ndarray, "worlds faces 2 2"]
    edges_m: Float[np.ndarray, "worlds edges 2 2"]
    surfaces: Surfaces | Scenes


class World(NamedTuple):
    """What stands still during an episode of some worlds, and the engines that are caches of its ticks.

    Attributes:
        rows: Which rows belong to which world.
        layouts: Walls, obstacles and starts, one a world.
        scene: What of them stands where.
        arena: The physics engine; it starts every drive from the tick.
        standing: What is wrong with the radio in this episode.
        smoothers: Solvers that robots keep warm, where they solve at every step; each solve goes on from the
            tick.
    """

    rows: Rows
    layouts: tuple[Layout, ...]
    scene: Scene
    arena: Arena
    standing: EpisodeImpairments
    smoothers: PerRobotSmoothers | None = None

    @property
    def layout(self) -> Layout:
        """The layout where there is one world."""
        (only,) = self.layouts
        return only


class Commands(NamedTuple):
    """What robots are told to do in one iteration."""

    waypoints: Float[np.ndarray, "robots 2"]
    request: Bool[np.ndarray, " robots"]


class Truth(NamedTuple):
    """What really happened; for metrics only."""

    poses: Float[np.ndarray, "robots times 3"]
    collisions: Int[np.ndarray, " robots"]
    distance_m: Float[np.ndarray, " robots"]
    cells: CellMap


class Paths(NamedTuple):
    """Where robots believe that they were, and how well they know it. Row i is what robot i knows.

    Attributes:
        estimate: Poses ``T_world_robot`` of every robot up to now, as it believes them.
        covariance: Of each robot's last pose, (x_m, y_m, yaw_rad) in world axes, as it can know it.
        covariance_history: Covariance of each pose of the estimate as it stands.
        predicted_covariance: The same once what is recorded is optimised: loop closures count at once.
        smoothing: What each robot's solver knows, where robots solve at every step.
    """

    estimate: Float[np.ndarray, "robots times 3"]
    covariance: Float[np.ndarray, "robots 3 3"]
    covariance_history: Float[np.ndarray, "robots times 3 3"]
    predicted_covariance: Float[np.ndarray, "robots times 3 3"]
    smoothing: Smoothing | None = None

    @property
    def t(self) -> int:
        """Iterations done."""
        return self.estimate.shape[1] - 1


class MeasurementLog(NamedTuple):
    """Everything that was measured so far, each row known to the robot that measured it.

    Attributes:
        edges: Relative poses (Eq. 2): odometry, loop closures, other robots.
        bearings: Directions in which robots in view heard each other; kept where the outlier method has a
            use for them.
        pings: Directions of robots in the slots and where these said they were; kept where they are made
            use of.
    """

    edges: Edges
    bearings: Bearings
    pings: Pings


class RadioBelief(NamedTuple):
    """Links and directions of this iteration.

    Attributes:
        esnr_db: Effective SNR of each link, by row and peer.
        rate_mbit_s: rho_ij of Eq. 1.
        discrepancy: w_ij of Eq. 1.
        slots: Peers that each robot listens to, `NOBODY` where empty.
        profile: AOA profile of each slot in the body frame, zeros where empty.
    """

    esnr_db: Float[np.ndarray, "robots peers"]
    rate_mbit_s: Float[np.ndarray, "robots peers"]
    discrepancy: Float[np.ndarray, "robots peers"]
    slots: Int[np.ndarray, "robots slots"]
    profile: Float[np.ndarray, "robots slots grid"]


class Sensed(NamedTuple):
    """What lidar and camera show in this iteration.

    Attributes:
        lidar_m: Free distance along the rays.
        sighted: Distance and bearing of the nearest robot in sight, zeros if none.
    """

    lidar_m: Float[np.ndarray, "robots rays"]
    sighted: Float[np.ndarray, "robots 2"]


class Team(NamedTuple):
    """Who calls whom, who met whom, and what they told each other.

    Attributes:
        calls: Calls that are up.
        observed: Relative poses of each other that pairs took since they last met.
        held: How many poses of robot j, with the measurements at them, robot i was sent so far.
        last_met: Iteration of each robot's last rendezvous; 0 before the first.
        met: Groups of rows that met in this iteration.
        bytes_sent: Over the links of each world, so far.
        airtime_s: Of the messages by which robots that met solved, if the back-end sends any, so far: at the
            rates of their links there, one message after another.
        under_way_bytes: What of the exchange that each pair is in the middle of is over the link.
    """

    calls: Calls
    observed: Int[np.ndarray, "robots peers"]
    held: Int[np.ndarray, "robots peers"]
    last_met: Int[np.ndarray, " robots"]
    met: tuple[tuple[int, ...], ...]
    bytes_sent: Int[np.ndarray, " worlds"]
    airtime_s: Float[np.ndarray, " worlds"]
    under_way_bytes: Float[np.ndarray, "robots peers"]


class Belief(NamedTuple):
    """What the robots measured, were told and concluded, by the stage that owns it.

    Attributes:
        paths: Where they believe that they were: dead reckoning and optimisation.
        log: Their measurements.
        radio: Links and directions of this iteration.
        sensed: Lidar and camera of this iteration.
        team: Calls and meetings.
        coverage: What each robot has seen of the room in its own estimate.
        err: Err_i of Eq. 4.
    """

    paths: Paths
    log: MeasurementLog
    radio: RadioBelief
    sensed: Sensed
    team: Team
    coverage: CoverageBelief
    err: Float[np.ndarray, " robots"]

    @property
    def t(self) -> int:
        """Iterations done."""
        return self.paths.t


class Tick(NamedTuple):
    """State after an iteration."""

    truth: Truth
    belief: Belief
