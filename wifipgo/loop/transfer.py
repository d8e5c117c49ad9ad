"""Exchanges that take time: bytes over rate, some of it in each iteration in which a pair is due."""

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.rows import Rows
from wifipgo.scenarios.scenario import Scenario
from wifipgo.state import Team

# Position and direction of a pose as sent: 3 float64.
BYTES_PER_POSE = 24
_BYTES_PER_MBIT = 1e6 / 8.0


def transferred(
    team: Team, rate_mbit_s: Float[np.ndarray, "rows peers"], t: int, scenario: Scenario
) -> tuple[Team, Bool[np.ndarray, "rows peers"]]:
    """Send on what pairs that are due have to tell each other, at the rate of their link.

    A pair is due with kappa observations and a link that carries q. What is over the link stays so if the
    link falters. Poses and what goes with them count; measurements are small beside them.

    Args:
        team: Who observed whom, holds what, and is in the middle of an exchange.
        rate_mbit_s: Of the links.
        t: Iterations done.
        scenario: Says when a pair is due, and how long an exchange may take of an iteration.

    Returns:
        The team with what is over the links now, and which pairs have all.
    """
    link, rows = scenario.link, Rows.of(*rate_mbit_s.shape)
    due = (team.observed >= scenario.rendezvous.kappa) & (rate_mbit_s >= link.q_mbit_s)
    needed = (BYTES_PER_POSE + link.image_bytes) * _news(team.held, t, rows)
    before = team.under_way_bytes
    sent = np.where(due, before + _BYTES_PER_MBIT * rate_mbit_s * link.exchange_s, before)
    sent = np.minimum(sent, np.maximum(needed, before))
    new = np.triu(rows.by_world(sent - before), k=1).sum(axis=(1, 2)).astype(np.int64)
    return team._replace(under_way_bytes=sent, bytes_sent=team.bytes_sent + new), sent >= needed


def _news(held: Int[np.ndarray, "rows peers"], t: int, rows: Rows) -> Int[np.ndarray, "rows peers"]:
    """Poses that either of each pair does not hold of the other, together."""
    missing = t + 1 - rows.by_world(held)
    both: np.ndarray = (missing + missing.swapaxes(1, 2)).reshape(held.shape)
    return both
