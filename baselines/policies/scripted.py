"""Every scripted policy composed of a motion, a trigger and an answer; arguments are its parameters."""

from baselines.policies.exploration import BestView, Frontier
from baselines.policies.motions import Convoy, HomeWhenLost, Persistent, ToPoint, ToSighted, Uniform
from baselines.policies.rendezvous import Callers, Walkers
from baselines.policies.triggers import err_above, not_met_for, spread_above
from wifipgo.errors import require
from wifipgo.scenarios import Scenario


def persistent(scenario: Scenario, *, wobble_rad: float = 0.3) -> Walkers:
    """Random walk that keeps its heading."""
    return Walkers(scenario, Persistent(scenario, wobble_rad=wobble_rad))


def persistent_active(scenario: Scenario, *, err_threshold: float = 1.0, wobble_rad: float = 0.3) -> Walkers:
    """The paper's policy on a random walk that keeps its heading."""
    return Callers(scenario, Persistent(scenario, wobble_rad=wobble_rad), err_above(err_threshold))


def vision(scenario: Scenario, *, err_threshold: float = 1.0) -> Walkers:
    """A lost robot goes to the nearest robot that its camera sees; in the dark it sees none."""
    return Walkers(scenario, ToSighted(scenario, Uniform(), err_above(err_threshold)))


def fixed_point(scenario: Scenario, *, err_threshold: float = 1.0) -> Walkers:
    """A lost robot calls, and it and the called robot go to the middle of the room by their estimates."""
    refuge = ToPoint(scenario, own_start=False)
    return Callers(scenario, Uniform(), err_above(err_threshold), refuge=refuge)


def periodic(scenario: Scenario, *, period: int = 10) -> Walkers:
    """As the paper's policy, but calls when a rendezvous is ``period`` iterations ago."""
    require(period >= 1, "periodic:period", ">= 1", period)
    return Callers(scenario, Uniform(), not_met_for((period - 0.5) / scenario.n_steps))


def covariance(scenario: Scenario, *, spread_m: float = 1.0) -> Walkers:
    """As the paper's policy, but calls when the standard deviation of the own position passes a length."""
    require(spread_m > 0.0, "covariance:spread_m", "> 0", spread_m)
    return Callers(scenario, Uniform(), spread_above(spread_m))


def convoy(scenario: Scenario, *, wobble_rad: float = 0.3) -> Walkers:
    """Every second robot walks, the others follow the strongest signal and stay in view."""
    return Walkers(scenario, Convoy(Persistent(scenario, wobble_rad=wobble_rad), period=0))


def leapfrog(scenario: Scenario, *, period: int = 3, wobble_rad: float = 0.3) -> Walkers:
    """As convoy, with roles that change: those who walked wait until the others have caught up."""
    require(period >= 1, "leapfrog:period", ">= 1", period)
    return Walkers(scenario, Convoy(Persistent(scenario, wobble_rad=wobble_rad), period=period))


def frontier(scenario: Scenario) -> Walkers:
    """Goes to what it has not seen; calls nobody."""
    return Walkers(scenario, Frontier(scenario))


def frontier_active(scenario: Scenario, *, err_threshold: float = 1.0) -> Walkers:
    """Explores frontiers in place of the random walk; otherwise the paper's policy."""
    return Callers(scenario, Frontier(scenario), err_above(err_threshold))


def frontier_home(
    scenario: Scenario,
    *,
    spread_m: float = 0.7,
    release: float = 0.8,
    err_threshold: float = 0.5,
    nearest: bool = False,
) -> Walkers:
    """Explores where most is new, returns to its own start when uncertain, and calls as in the paper.

    Args:
        scenario: Gives the layout of the observations.
        spread_m: Uncertainty of the own position at which it returns.
        release: Share of ``spread_m`` under which it explores again.
        err_threshold: Err at which it calls, in units of the scenario's; 1e9: never.
        nearest: Explore as `frontier` does, by the nearest square not yet seen.
    """
    require(spread_m > 0.0, "frontier_home:spread_m", "> 0", spread_m)
    require(0.0 < release <= 1.0, "frontier_home:release", "in (0, 1]", release)
    explore = Frontier(scenario) if nearest else BestView(scenario)
    motion = HomeWhenLost(scenario, explore, spread_m=spread_m, release=release)
    return Callers(scenario, motion, err_above(err_threshold))
