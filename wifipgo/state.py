"""What an iteration hands to the next: the standing world, the truth, and what the robots believe."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.graph import Bearings, Edges, Pings
from wifipgo.graph.per_robot_smoothing import Memory
from wifipgo.radio.channel.impairments import Standing
from wifipgo.radio.propagation.paths import Surfaces
from wifipgo.rendezvous import Calls
from wifipgo.world.arena import Arena
from wifipgo.world.coverage import CellMap
from wifipgo.world.coverage_belief import Survey
from wifipgo.world.layout import Layout


class World(NamedTuple):
    """What stands still during an episode, and the engine that moves the rest.

    Attributes:
        layout: Walls, obstacles and starts.
        faces_m: Edges of the obstacles.
        edges_m: The same and the walls.
        surfaces: What the radio sees of them.
        arena: The engine.
        standing: What is wrong with the radio in this episode.
        memory: Solvers that robots keep warm, where they solve at every iteration.
    """

    layout: Layout
    faces_m: Float[np.ndarray, "faces 2 2"]
    edges_m: Float[np.ndarray, "edges 2 2"]
    surfaces: Surfaces
    arena: Arena
    standing: Standing
    memory: Memory | None = None


class Commands(NamedTuple):
    """What robots are told to do in one iteration."""

    waypoints: Float[np.ndarray, "robots 2"]
    request: Bool[np.ndarray, " robots"]


class Truth(NamedTuple):
    """What really happened; for metrics only."""

    poses: Float[np.ndarray, "robots times 3"]
    bumps: Int[np.ndarray, " robots"]
    distance_m: Float[np.ndarray, " robots"]
    cells: CellMap


class Belief(NamedTuple):
    """What the robots measured, were told and concluded. Row i is what robot i knows.

    Attributes:
        estimate: Poses ``T_world_robot`` of every robot up to now, as it believes them.
        covariance: Of each robot's last pose, (x_m, y_m, yaw_rad) in world axes, as it can know it.
        edges: Measurements (Eq. 2), each known to the robot at its tail.
        bearings: Directions in which robots in view heard each other, each known to its observer; kept
            where the outlier method has a use for them.
        pings: Directions of robots in the slots and where these said they were; kept where they are made
            use of.
        err: Err_i of Eq. 4.
        lidar_m: Free distance along the rays.
        esnr_db: Effective SNR of each link.
        rate_mbit_s: rho_ij of Eq. 1.
        discrepancy: w_ij of Eq. 1.
        slots: Neighbours that each robot listens to, `NOBODY` where empty.
        profile: AOA profile of each slot in the body frame, zeros where empty.
        calls: Calls that are up.
        observed: Relative poses of each other that pairs took since they last met.
        held: How many poses of robot j, with the measurements at them, robot i was sent so far.
        last_met: Iteration of each robot's last rendezvous; 0 before the first.
        met: Groups that met in this iteration.
        trail: Covariance of each pose of the estimate as it stands.
        recorded: The same once what is recorded is optimised: places measured again count at once.
        survey: What each robot has seen of the room in its own estimate.
        sighted: Distance (m) and bearing (rad, body frame) of the nearest robot that each one's camera sees;
            0 and 0 if it sees none.
        bytes_sent: Exchanged so far: graphs and surveys at rendezvous, changed poses where a link carries q.
    """

    estimate: Float[np.ndarray, "robots times 3"]
    covariance: Float[np.ndarray, "robots 3 3"]
    edges: Edges
    bearings: Bearings
    pings: Pings
    err: Float[np.ndarray, " robots"]
    lidar_m: Float[np.ndarray, "robots rays"]
    esnr_db: Float[np.ndarray, "robots robots"]
    rate_mbit_s: Float[np.ndarray, "robots robots"]
    discrepancy: Float[np.ndarray, "robots robots"]
    slots: Int[np.ndarray, "robots slots"]
    profile: Float[np.ndarray, "robots slots grid"]
    calls: Calls
    observed: Int[np.ndarray, "robots robots"]
    held: Int[np.ndarray, "robots robots"]
    last_met: Int[np.ndarray, " robots"]
    met: tuple[tuple[int, ...], ...]
    bytes_sent: int
    trail: Float[np.ndarray, "robots times 3 3"]
    recorded: Float[np.ndarray, "robots times 3 3"]
    survey: Survey
    sighted: Float[np.ndarray, "robots 2"]

    @property
    def t(self) -> int:
        """Iterations done."""
        return self.estimate.shape[1] - 1


class Tick(NamedTuple):
    """State after an iteration."""

    truth: Truth
    belief: Belief
