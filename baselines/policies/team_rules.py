"""Rules beyond the paper's: both robots of a call drive, and the team shares a plan.

Parameters were chosen on worlds of seeds from 70,000 on, which nothing is reported on.
"""

from baselines.policies.exploration import BestView
from baselines.policies.motions import HomeWhenLost, Motion
from baselines.policies.rendezvous import Callers
from baselines.policies.team_exploration import Mesh, SharedRoom, TakeTurns
from baselines.policies.triggers import either, err_above, near_the_end
from wifipgo.errors import require
from wifipgo.scenarios import Scenario


def both_drive(
    scenario: Scenario, *, spread_m: float = 0.7, release: float = 0.8, err_threshold: float = 0.5
) -> Callers:
    """As `frontier_home`, but a caller drives towards whom it calls as the called one drives towards it."""
    motion = _home_when_lost(scenario, BestView(scenario), spread_m, release)
    return Callers(scenario, motion, err_above(err_threshold), caller_drives=True)


def turns(
    scenario: Scenario,
    *,
    period: int = 8,
    spread_m: float = 0.7,
    release: float = 0.8,
    err_threshold: float = 0.5,
) -> Callers:
    """One half of the team explores as in `both_drive` while the other stands; then they change."""
    require(period >= 1, "turns:period", ">= 1", period)
    motion = _home_when_lost(scenario, BestView(scenario), spread_m, release)
    motion = TakeTurns(motion, period=period)
    return Callers(scenario, motion, err_above(err_threshold), caller_drives=True)


def voronoi(
    scenario: Scenario,
    *,
    others_worth: float = 0.3,
    spread_m: float = 0.7,
    release: float = 0.8,
    err_threshold: float = 0.5,
) -> Callers:
    """As `both_drive`, and each robot first explores what is nearer to its own start than to the others'."""
    share = SharedRoom(scenario, others_worth=others_worth, rest_worth=1.0)
    motion = _home_when_lost(scenario, share, spread_m, release)
    return Callers(scenario, motion, err_above(err_threshold), caller_drives=True)


def mesh(
    scenario: Scenario,
    *,
    loop_worth: float = 2.0,
    spread_m: float = 0.7,
    release: float = 0.8,
    err_threshold: float = 0.5,
) -> Callers:
    """As `both_drive`, but robots stay within reach of places that they passed before."""
    motion = Mesh(scenario, loop_worth=loop_worth, others_worth=1.0, rest_worth=1.0)
    return Callers(
        scenario,
        _home_when_lost(scenario, motion, spread_m, release),
        err_above(err_threshold),
        caller_drives=True,
    )


def team_plan(
    scenario: Scenario,
    *,
    spread_m: float = 0.9,
    release: float = 0.8,
    err_threshold: float = 0.5,
    others_worth: float = 0.5,
    loop_worth: float = 1.0,
    last_steps: int = 8,
) -> Callers:
    """The best rule known: shares of the room, loops on the way, both drive, a last rendezvous.

    Args:
        scenario: Gives the layout of the observations.
        spread_m: Uncertainty of the own position at which a robot returns to its start.
        release: Share of ``spread_m`` under which it explores again.
        err_threshold: Err at which it calls, in units of the scenario's.
        others_worth: Worth of a square nearer to another's start.
        loop_worth: Worth of a step that ends in reach of an old place, in squares.
        last_steps: Iterations before the end in which robots that have not met call; 0: none.
    """
    require(last_steps >= 0, "team_plan:last_steps", ">= 0", last_steps)
    explore = Mesh(scenario, loop_worth=loop_worth, others_worth=others_worth, rest_worth=0.5)
    motion = _home_when_lost(scenario, explore, spread_m, release)
    trigger = either(err_above(err_threshold), near_the_end(last_steps / scenario.n_steps))
    return Callers(scenario, motion, trigger, caller_drives=True)


def _home_when_lost(scenario: Scenario, explore: Motion, spread_m: float, release: float) -> Motion:
    """Explore, and return to the own start when lost."""
    require(spread_m > 0.0, "spread_m", "> 0", spread_m)
    require(0.0 < release <= 1.0, "release", "in (0, 1]", release)
    return HomeWhenLost(scenario, explore, spread_m=spread_m, release=release)
