"""The first tick: a world laid out, and robots that know their starts and nothing else."""

import numpy as np
from jaxtyping import Float

from wifipgo.arithmetic import plain_arithmetic
from wifipgo.graph.anchor_bearings import NO_PINGS
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.edges import Edges
from wifipgo.graph.per_robot_smoothing import PerRobotSmoothers
from wifipgo.graph.smoother_updates import no_smoothing
from wifipgo.loop.iteration import observe
from wifipgo.loop.scene import first_scene
from wifipgo.loop.uncertainty import first_coverage
from wifipgo.radio.channel.impairments import draw_episode_impairments
from wifipgo.rendezvous import NOBODY, no_calls
from wifipgo.rows import Rows
from wifipgo.scenarios.scenario import Scenario
from wifipgo.state import Belief, MeasurementLog, Paths, RadioBelief, Sensed, Team, Tick, Truth, World
from wifipgo.streams import Streams
from wifipgo.threads import one_thread
from wifipgo.world.arena import Arena
from wifipgo.world.coverage import empty_map, reveal
from wifipgo.world.layout import Layout
from wifipgo.world.lidar import N_LIDAR_RAYS
from wifipgo.world.placing import random_layout


@one_thread
@plain_arithmetic
def start(scenario: Scenario, streams: Streams) -> tuple[World, Tick]:
    """Lay out worlds, one for each that draws; every robot senses once from its start, which it knows."""
    n, arena = scenario.n_robots, scenario.arena
    layouts = tuple(random_layout(n, arena, rng=rng) for rng in streams.layout.each)
    world = _world(layouts, scenario, streams)
    truth = _first_truth(world, scenario)
    belief = _first_belief(world, scenario)
    return world, observe(truth, belief, Edges.empty(), world=world, scenario=scenario, streams=streams)


def _world(layouts: tuple[Layout, ...], scenario: Scenario, streams: Streams) -> World:
    """What stands still, and the engines."""
    rows = Rows(len(layouts), scenario.n_robots)
    standing = draw_episode_impairments(
        scenario.impairments,
        n_robots=scenario.n_robots,
        n_antennas=len(scenario.radio.antennas_m) or 2,
        size_m=scenario.arena.size_m,
        rng=streams.standing,
        n_worlds=rows.n_worlds,
    )
    arena = Arena(layouts, scenario.arena, turn_rad=scenario.turn.turn_rad)
    smoothers = PerRobotSmoothers(scenario.graph) if scenario.graph.incremental else None
    return World(rows, layouts, first_scene(layouts, scenario), arena, standing, smoothers)


def _starts(world: World) -> Float[np.ndarray, "robots 3"]:
    """Where the robots of all worlds start."""
    return np.concatenate([layout.starts for layout in world.layouts])


def _first_truth(world: World, scenario: Scenario) -> Truth:
    """Robots at their starts, and what they see from there."""
    n, size_m, starts = len(world.rows), scenario.arena.size_m, _starts(world)
    cells = reveal(
        empty_map(world.layouts, size_m),
        starts[:, :2],
        world.scene.faces_m,
        range_m=scenario.sensing.sensor_range_m,
    )
    return Truth(
        poses=starts[:, None], collisions=np.zeros(n, dtype=int), distance_m=np.zeros(n), cells=cells
    )


def _first_belief(world: World, scenario: Scenario) -> Belief:
    """Every robot knows its start and nothing else."""
    n, starts = len(world.rows), _starts(world)
    certain = np.zeros((n, 1, 3, 3))
    return Belief(
        paths=Paths(starts[:, None], certain[:, 0], certain, certain, no_smoothing(n, world.rows.n_robots)),
        log=MeasurementLog(Edges.empty(), Bearings.empty(scenario.turn.n_peaks), NO_PINGS),
        radio=_silence(world.rows, scenario),
        sensed=Sensed(np.zeros((n, N_LIDAR_RAYS)), np.zeros((n, 2))),
        team=_strangers(world.rows, scenario),
        coverage=first_coverage(starts, scenario),
        err=np.zeros(n),
    )


def _silence(rows: Rows, scenario: Scenario) -> RadioBelief:
    """Nothing was heard."""
    n, slots = len(rows), scenario.n_slots
    nothing = np.zeros((n, rows.n_robots))
    profile = np.zeros((n, slots, scenario.turn.n_azimuths), dtype=np.float32)
    return RadioBelief(nothing, nothing, nothing, np.full((n, slots), NOBODY), profile)


def _strangers(rows: Rows, scenario: Scenario) -> Team:
    """Nobody calls, met or told anybody."""
    n = len(rows)
    never = np.zeros((n, rows.n_robots), dtype=int)
    return Team(
        calls=no_calls(n, scenario.link),
        observed=never,
        held=never,
        last_met=np.zeros(n, dtype=int),
        met=(),
        bytes_sent=np.zeros(rows.n_worlds, dtype=int),
        airtime_s=np.zeros(rows.n_worlds),
        under_way_bytes=np.zeros((n, rows.n_robots)),
    )
