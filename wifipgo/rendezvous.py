"""Who calls whom, who is due to meet, and what they then know (paper Sec. 5, Algorithms 1 and 2).

These are the parts of the algorithms that run on the robots whatever moves them: the
ranking of neighbours, a call that stays up until it is served, the count of observations.
Motion is a policy's business.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.errors import pick, require_within
from wifipgo.radio.channel.rates import LinkConfig, service_discrepancy
from wifipgo.rows import Rows

NOBODY = -1
# Whether a call that is placed starts the count of observations of caller and callee again.
KAPPA_SINCE: Mapping[str, bool] = MappingProxyType({"meeting": False, "call": True})


@dataclass(frozen=True, slots=True, kw_only=True)
class RendezvousConfig:
    """When to call, and when a meeting counts.

    The threshold of 10 is the paper's (Sec. 7.1.2); kappa is ours.

    Attributes:
        err_threshold: delta of Algorithm 2, on Err_i of Eq. 4.
        kappa: Observations of a pair that a rendezvous needs (Algorithm 1).
        kappa_since: From when they count: "meeting", the pair's last, or "call", if one was placed since.
    """

    err_threshold: float = 10.0
    kappa: int = 3
    kappa_since: str = "meeting"

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        require_within(self, {"err_threshold": (1e-9, 1e12), "kappa": (1, 1_000_000)})
        pick(KAPPA_SINCE, self.kappa_since, "kappa_since")


class Calls(NamedTuple):
    """Calls that are up.

    Attributes:
        callee: Peer that each robot calls, or `NOBODY`.
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
    rate_mbit_s: Float[np.ndarray, "robots peers"],
    esnr_db: Float[np.ndarray, "robots peers"],
    *,
    cfg: LinkConfig,
) -> Calls:
    """Keep, place and end calls (Algorithm 2, lines 5 to 14).

    A new call goes to the neighbour in N_C with the least unclipped service discrepancy, which
    is the one with the highest rate; effective SNR decides between equal rates. A call that is up
    stays with its callee while the caller requests and a ping still passes.
    """
    if not request.any():
        return no_calls(len(request), cfg)
    robots = np.arange(len(request))
    reachable = rate_mbit_s > 0.0
    rank = np.where(reachable, rate_mbit_s + 1e-3 * esnr_db, -np.inf)
    best = np.where(reachable.any(axis=1), rank.argmax(axis=1), NOBODY)
    up = (calls.callee != NOBODY) & reachable[robots, calls.callee]
    callee = np.where(request, np.where(up, calls.callee, best), NOBODY)
    kept = (callee == calls.callee) & (callee != NOBODY)
    return Calls(callee, np.where(kept, calls.q_mbit_s, cfg.q_mbit_s))


def counted_from_calls(
    observed: Int[np.ndarray, "robots peers"], before: Calls, calls: Calls
) -> Int[np.ndarray, "robots peers"]:
    """Observations of pairs since a call: of those between whom none was up, and now is, there are none."""
    n, robots = observed.shape[1], np.arange(len(observed))
    peer, first = robots % n, robots - robots % n
    called_back = before.callee[first + np.maximum(calls.callee, 0)] == peer
    new = (calls.callee != NOBODY) & (calls.callee != before.callee) & ~called_back
    caller, callee = robots[new], calls.callee[new]
    again = observed.copy()
    again[caller, callee] = again[first[new] + callee, peer[new]] = 0
    return again


def raise_demands(
    calls: Calls, rate_mbit_s: Float[np.ndarray, "robots peers"], *, step_mbit_s: float
) -> Calls:
    """Ask for more than the link now carries, so that the callee keeps coming (Algorithm 1, line 10)."""
    if (calls.callee == NOBODY).all():
        return calls
    robots = np.arange(len(calls.callee))
    rate = np.where(calls.callee != NOBODY, rate_mbit_s[robots, calls.callee], 0.0)
    return Calls(calls.callee, np.where(calls.q_mbit_s <= rate, rate + step_mbit_s, calls.q_mbit_s))


def discrepancies(
    calls: Calls, rate_mbit_s: Float[np.ndarray, "robots peers"], *, cfg: LinkConfig
) -> Float[np.ndarray, "robots peers"]:
    """w_ij of Eq. 1 as robot i sees its link to j: with j's demand if j calls i, else with its own."""
    demand = np.full(rate_mbit_s.shape, cfg.q_mbit_s)
    caller = (calls.callee != NOBODY).nonzero()[0]
    if len(caller):
        peer, callee = caller % rate_mbit_s.shape[1], calls.callee[caller]
        demand[caller - peer + callee, peer] = calls.q_mbit_s[caller]
        demand[caller, callee] = calls.q_mbit_s[caller]
    return service_discrepancy(rate_mbit_s, q_mbit_s=demand, alpha=cfg.alpha)


def choose_slots(
    calls: Calls,
    rate_mbit_s: Float[np.ndarray, "robots peers"],
    esnr_db: Float[np.ndarray, "robots peers"],
    n_slots: int,
) -> Int[np.ndarray, "robots slots"]:
    """Peers that each robot listens to: its callers first, then by effective SNR; `NOBODY` pads."""
    rows = Rows.of(len(rate_mbit_s), rate_mbit_s.shape[1])
    calls_me = rows.by_world(calls.callee)[:, None] == np.arange(rows.n_robots)[:, None]
    esnr_db = esnr_db + 1e3 * calls_me.reshape(esnr_db.shape)
    rank = np.where(rate_mbit_s > 0.0, esnr_db, -np.inf)
    out, robots = np.empty((len(rank), n_slots), dtype=np.int64), np.arange(len(rank))
    for slot in range(n_slots):
        best = rank.argmax(axis=1)
        out[:, slot] = np.where(rank[robots, best] > -np.inf, best, NOBODY)
        rank[robots, best] = -np.inf
    return out


def due_groups(
    observed: Int[np.ndarray, "robots peers"],
    rate_mbit_s: Float[np.ndarray, "robots peers"],
    *,
    kappa: int,
    q_mbit_s: float,
) -> list[list[int]]:
    """Rows that meet now: pairs with kappa observations and the rate, joined where they share one."""
    groups: list[set[int]] = []
    low, peer = ((observed >= kappa) & (rate_mbit_s >= q_mbit_s)).nonzero()
    high = low - low % observed.shape[1] + peer
    for pair in zip(low[low < high].tolist(), high[low < high].tolist(), strict=True):
        touched = [group for group in groups if group & set(pair)]
        groups = [group for group in groups if group not in touched] + [set(pair).union(*touched)]
    return sorted(sorted(group) for group in groups)
