"""Who calls whom, who is due to meet, and what they then know (paper Sec. 5, Algorithms 1 and 2).

These are the parts of the algorithms that run on the robots whatever moves them: the
ranking of neighbours, a call that stays up until it is served, the count of observations.
Motion is a policy's business.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.errors import pick, require
from wifipgo.graph import ERR_WEIGHTS, GUARDS, THIRD_PARTY, Bearings, Edges, retold, solve_guarded
from wifipgo.radio.link import LinkConfig, service_discrepancy

NOBODY = -1
# Bytes of one pose, measurement and bearing as sent: 3 float64; two keys, z, sigma and weight; two keys,
# azimuth and sigma.
BYTES_PER_POSE, BYTES_PER_EDGE, BYTES_PER_BEARING = 24, 64, 32
_ESTIMATORS = {"at_rendezvous": "optimise only when two robots meet (paper mode)"}


@dataclass(frozen=True, slots=True, kw_only=True)
class RendezvousConfig:
    """When to call, when a meeting counts, and what is optimised then.

    The threshold of 10 is the paper's (Sec. 7.1.2), as are the AOA gate of 7.2 degrees
    (Sec. 7.3); sigma = 2.96 degrees makes g of Eq. 7 leave 1 just there. kappa is ours.

    Attributes:
        err_threshold: delta of Algorithm 2, on Err_i of Eq. 4.
        kappa: Observations of a pair that a rendezvous needs (Algorithm 1).
        err_weights: "unit" (paper mode) or "information".
        estimator: When poses are optimised.
        outliers: What guards the optimisation against outliers: a name in `wifipgo.graph.GUARDS`. A gate
            on direction weighs measurements as they come, so Err_i has its weights; what a loss or
            PCM lets go at a rendezvous counts in Err_i as before.
        aoa_gate_rad: Delta of Eq. 11.
        aoa_sigma_rad: sigma of Eq. 7, and of a bearing that is a measurement of its own.
        third_party: What measurements of absent robots do in an optimisation: "fixed_told" or "ignore".
    """

    err_threshold: float = 10.0
    kappa: int = 3
    err_weights: str = "unit"
    estimator: str = "at_rendezvous"
    outliers: str = "none"
    aoa_gate_rad: float = float(np.deg2rad(7.2))
    aoa_sigma_rad: float = float(np.deg2rad(2.96))
    third_party: str = "fixed_told"

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        for name in ("err_threshold", "aoa_gate_rad", "aoa_sigma_rad"):
            require(getattr(self, name) > 0.0, f"RendezvousConfig.{name}", "> 0", getattr(self, name))
        require(self.kappa >= 1, "RendezvousConfig.kappa", ">= 1", self.kappa)
        pick(ERR_WEIGHTS, self.err_weights, "err_weights")
        pick(_ESTIMATORS, self.estimator, "estimator")
        pick(GUARDS, self.outliers, "outlier method")
        pick(THIRD_PARTY, self.third_party, "third_party")


class Calls(NamedTuple):
    """Calls that are up.

    Attributes:
        callee: Robot that each robot calls, or `NOBODY`.
        q_mbit_s: Rate each call asks for; raised as Algorithm 1, line 10, so that the callee keeps coming.
    """

    callee: Int[np.ndarray, " robots"]
    q_mbit_s: Float[np.ndarray, " robots"]


def no_calls(n_robots: int, cfg: LinkConfig) -> Calls:
    """Nobody calls anybody."""
    return Calls(np.full(n_robots, NOBODY), np.full(n_robots, cfg.q_mbit_s))


def place_calls(
    calls: Calls,
    request: Bool[np.ndarray, " robots"],
    rate_mbit_s: Float[np.ndarray, "robots robots"],
    esnr_db: Float[np.ndarray, "robots robots"],
    *,
    cfg: LinkConfig,
) -> Calls:
    """Keep, place and end calls (Algorithm 2, lines 5 to 14).

    A new call goes to the neighbour in N_C with the least unclipped service discrepancy, which
    is the one with the highest rate; effective SNR decides between equal rates. A call that is up
    stays with its callee while the caller requests and a ping still passes.
    """
    robots = np.arange(len(request))
    reachable = rate_mbit_s > 0.0
    rank = np.where(reachable, rate_mbit_s + 1e-3 * esnr_db, -np.inf)
    best = np.where(reachable.any(axis=1), rank.argmax(axis=1), NOBODY)
    up = (calls.callee != NOBODY) & reachable[robots, calls.callee]
    callee = np.where(request, np.where(up, calls.callee, best), NOBODY)
    kept = (callee == calls.callee) & (callee != NOBODY)
    return Calls(callee, np.where(kept, calls.q_mbit_s, cfg.q_mbit_s))


def raise_demands(
    calls: Calls, rate_mbit_s: Float[np.ndarray, "robots robots"], *, step_mbit_s: float
) -> Calls:
    """Ask for more than the link now carries, so that the callee keeps coming (Algorithm 1, line 10)."""
    robots = np.arange(len(calls.callee))
    rate = np.where(calls.callee != NOBODY, rate_mbit_s[robots, calls.callee], 0.0)
    return Calls(calls.callee, np.where(calls.q_mbit_s <= rate, rate + step_mbit_s, calls.q_mbit_s))


def discrepancies(
    calls: Calls, rate_mbit_s: Float[np.ndarray, "robots robots"], *, cfg: LinkConfig
) -> Float[np.ndarray, "robots robots"]:
    """w_ij of Eq. 1 as robot i sees its link to j: with j's demand if j calls i, else with its own."""
    demand = np.full_like(rate_mbit_s, cfg.q_mbit_s)
    caller = np.flatnonzero(calls.callee != NOBODY)
    demand[calls.callee[caller], caller] = calls.q_mbit_s[caller]
    demand[caller, calls.callee[caller]] = calls.q_mbit_s[caller]
    return service_discrepancy(rate_mbit_s, q_mbit_s=demand, alpha=cfg.alpha)


def choose_slots(
    calls: Calls,
    rate_mbit_s: Float[np.ndarray, "robots robots"],
    esnr_db: Float[np.ndarray, "robots robots"],
    n_slots: int,
) -> Int[np.ndarray, "robots slots"]:
    """Neighbours that each robot listens to: its callers first, then by effective SNR; `NOBODY` pads."""
    n = len(rate_mbit_s)
    calls_me = calls.callee[None, :] == np.arange(n)[:, None]
    rank = np.where(rate_mbit_s > 0.0, esnr_db + 1e3 * calls_me, -np.inf)
    order = np.argsort(-rank, axis=1, kind="stable")[:, :n_slots]
    return np.where(np.isfinite(np.take_along_axis(rank, order, axis=1)), order, NOBODY)


def due_groups(
    observed: Int[np.ndarray, "robots robots"],
    rate_mbit_s: Float[np.ndarray, "robots robots"],
    *,
    kappa: int,
    q_mbit_s: float,
) -> list[list[int]]:
    """Robots that meet now: pairs with kappa observations and the rate, joined where they share one."""
    groups: list[set[int]] = []
    for pair in np.argwhere(np.triu((observed >= kappa) & (rate_mbit_s >= q_mbit_s), 1)).tolist():
        touched = [group for group in groups if group & set(pair)]
        groups = [group for group in groups if group not in touched] + [set(pair).union(*touched)]
    return sorted(sorted(group) for group in groups)


class Meeting(NamedTuple):
    """What a rendezvous leaves behind."""

    estimate: Float[np.ndarray, "robots times 3"]
    edges: Edges
    bytes_sent: int


def meet(
    estimate: Float[np.ndarray, "robots times 3"],
    edges: Edges,
    bearings: Bearings,
    group: list[int],
    *,
    cfg: RendezvousConfig,
) -> Meeting:
    """Exchange graphs, optimise them together (Eq. 3) and tell each other the new poses.

    Only what the members measured or were told enters. Every member sends its trajectory,
    measurements and bearings to every other: that is what ``bytes_sent`` counts. Gates on direction
    weighed the measurements when they came.
    """
    guard = GUARDS[cfg.outliers]
    at_once = replace(guard, gate="none") if guard.by_direction else guard
    solved, _ = solve_guarded(
        estimate, edges, bearings, robots=group, outliers=at_once, third_party=cfg.third_party
    )
    member = np.zeros(len(estimate), dtype=bool)
    member[group] = True
    n_edges = int(member[edges.tail[:, 0]].sum())
    n_bearings = int(member[bearings.observer[:, 0]].sum())
    content = BYTES_PER_POSE * len(group) * estimate.shape[1]
    content += BYTES_PER_EDGE * n_edges + BYTES_PER_BEARING * n_bearings
    return Meeting(solved, retold(edges, solved, robots=group), content * (len(group) - 1))
