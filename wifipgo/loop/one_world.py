"""One world of a batch by itself: to be looked at, judged or drawn."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Int

from wifipgo.graph.anchor_bearings import Pings, select_pings
from wifipgo.graph.bearings import Bearings, select_bearings
from wifipgo.graph.edges import Edges, select
from wifipgo.loop.scene import first_scene
from wifipgo.rows import Rows
from wifipgo.scenarios.scenario import Scenario
from wifipgo.state import Belief, Team, Tick, Truth, World
from wifipgo.world.arena import Arena
from wifipgo.world.coverage import CellMap, Sightings


def one_tick(tick: Tick, k: int, rows: Rows) -> Tick:
    """Tick of world ``k`` of a batch as that of a batch of one.

    What solvers that run at every step know is not in it. It is what that world would be at alone, so it can
    be advanced with its own streams unless robots solve at every step.
    """
    if rows.n_worlds == 1:
        return tick
    own = slice(k * rows.n_robots, (k + 1) * rows.n_robots)
    return Tick(_truth(tick.truth, k, own), _belief(tick.belief, k, own))


def one_world(world: World, k: int, scenario: Scenario) -> World:
    """What stands still in world ``k`` of a batch, as a batch of one."""
    if world.rows.n_worlds == 1:
        return world
    layout, standing, n = world.layouts[k], world.standing, world.rows.n_robots
    diffuse = standing.diffuse
    if diffuse is not None and diffuse.at_m.ndim > 2:
        diffuse = diffuse._replace(at_m=diffuse.at_m[[k]], reflectivity=diffuse.reflectivity[[k]])
    return World(
        rows=Rows(1, n),
        layouts=(layout,),
        scene=first_scene((layout,), scenario),
        arena=Arena((layout,), scenario.arena, turn_rad=scenario.turn.turn_rad),
        standing=standing._replace(chain_rad=standing.chain_rad[k * n : (k + 1) * n], diffuse=diffuse),
    )


def _truth(truth: Truth, k: int, own: slice) -> Truth:
    """What really happened in one world."""
    cells = truth.cells
    seen = tuple(_sightings(one, own) for one in cells.sightings)
    return Truth(
        poses=truth.poses[own],
        collisions=truth.collisions[own],
        distance_m=truth.distance_m[own],
        cells=CellMap(cells.free[[k]], cells.seen[[k]], seen),
    )


def _sightings(one: Sightings, own: slice) -> Sightings:
    mine = _mine(one.row, own)
    return Sightings(one.row[mine] - own.start, one.cell[mine])


def _belief(belief: Belief, k: int, own: slice) -> Belief:
    """What the robots of one world believe."""
    log, paths = belief.log, belief.paths
    return Belief(
        paths=paths._replace(
            estimate=paths.estimate[own],
            covariance=paths.covariance[own],
            covariance_history=paths.covariance_history[own],
            predicted_covariance=paths.predicted_covariance[own],
            smoothing=None,
        ),
        log=log._replace(
            edges=_edges(log.edges, own),
            bearings=_bearings(log.bearings, own),
            pings=_pings(log.pings, own),
        ),
        radio=type(belief.radio)(*(column[own] for column in belief.radio)),
        sensed=type(belief.sensed)(*(column[own] for column in belief.sensed)),
        team=_team(belief.team, k, own),
        coverage=type(belief.coverage)(*(column[own] for column in belief.coverage)),
        err=belief.err[own],
    )


def _team(team: Team, k: int, own: slice) -> Team:
    """Calls and meetings of one world."""
    met = (group for group in team.met if own.start <= group[0] < own.stop)
    return team._replace(
        calls=type(team.calls)(*(column[own] for column in team.calls)),
        observed=team.observed[own],
        held=team.held[own],
        last_met=team.last_met[own],
        met=tuple(tuple(row - own.start for row in group) for group in met),
        bytes_sent=team.bytes_sent[[k]],
        airtime_s=team.airtime_s[[k]],
        under_way_bytes=team.under_way_bytes[own],
    )


def _mine(row: Int[np.ndarray, " rows"], own: slice) -> Bool[np.ndarray, " rows"]:
    """Which rows of a flat list are of the world."""
    mine: np.ndarray = (row >= own.start) & (row < own.stop)
    return mine


def _edges(edges: Edges, own: slice) -> Edges:
    mine = select(edges, _mine(edges.tail[:, 0], own))
    return replace(mine, tail=mine.tail - [own.start, 0], head=mine.head - [own.start, 0])


def _bearings(bearings: Bearings, own: slice) -> Bearings:
    mine = select_bearings(bearings, _mine(bearings.observer[:, 0], own))
    return replace(mine, observer=mine.observer - [own.start, 0], target=mine.target - [own.start, 0])


def _pings(pings: Pings, own: slice) -> Pings:
    mine = select_pings(pings, _mine(pings.observer[:, 0], own))
    return mine._replace(observer=mine.observer - [own.start, 0], sender=mine.sender - own.start)
