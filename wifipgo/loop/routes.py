"""What links of a meeting carry: robots that do not hear each other are relayed by others of the group."""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float
from scipy.sparse.csgraph import shortest_path

# MCS 0 of 20 MHz: what a link is billed at where a scenario lets robots meet without one (q = 0).
LOWEST_MBIT_S = 6.5


def routed_mbit_s(
    rate_mbit_s: Float[np.ndarray, "rows peers"], group: Sequence[int]
) -> Callable[[int, int], float]:
    """Rate from one member to another, along the quickest way through the group.

    Over several links a message takes the sum of their times, so their rates add like resistances.

    Args:
        rate_mbit_s: Of the links, by row and number in its world; 0 is none.
        group: Rows of one world.

    Returns:
        A function of the rows of sender and receiver; Mb/s, > 0.
    """
    members, n_robots = list(group), rate_mbit_s.shape[1]
    direct = rate_mbit_s[np.ix_(members, [row % n_robots for row in members])]
    cost = np.divide(1.0, direct, out=np.full(direct.shape, np.inf), where=direct > 0.0)
    if len(members) > 2:
        cost = shortest_path(cost)
    rate = np.where(np.isfinite(cost), 1.0 / np.maximum(cost, 1e-12), LOWEST_MBIT_S)
    place = {row: k for k, row in enumerate(members)}
    return lambda sender, receiver: float(rate[place[sender], place[receiver]])
