"""What is said of each robot beside its observation, of the same keys, shapes and dtypes at every iteration.

Learners stack infos into tensors, so nothing here may grow, shrink or be left out.
"""

from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int8, Shaped

from wifipgo.graph.metrics import ate_rot, ate_trans
from wifipgo.rows import Rows
from wifipgo.state import Tick
from wifipgo.world.coverage_belief import team_share

Columns = dict[str, Shaped[np.ndarray, "robots ..."]]


def info_columns(
    tick: Tick,
    rows: Rows,
    *,
    mapped_share: Float[np.ndarray, " worlds"],
    masks: Int8[np.ndarray, "robots choices"] | None,
) -> Columns:
    """Metrics of each robot by name; those that end in ``_truth`` read what robots cannot know.

    Args:
        tick: State after the iteration.
        rows: Robots of all worlds.
        mapped_share: Of each team, by the truth.
        masks: Of choices, where actions are choices.
    """
    truth, belief, n = tick.truth, tick.belief, rows.n_robots
    columns: Columns = {
        "err": belief.err,
        "met": met(belief.team.met, rows),
        "ate_trans_truth": ate_trans(belief.paths.estimate, truth.poses),
        "ate_rot_truth": ate_rot(belief.paths.estimate, truth.poses),
        "bumps_truth": truth.collisions,
        "distance_m_truth": truth.distance_m,
        "mapped_share_belief": team_share(belief.coverage, rows.n_worlds).repeat(n),
        "mapped_share_truth": mapped_share.repeat(n),
        "coverage_truth": truth.cells.share.repeat(n),
    }
    return columns if masks is None else columns | {"action_mask": masks}


def by_agent(columns: Columns, agents: list[str]) -> dict[str, dict[str, Any]]:
    """Infos of one world by agent: numbers as Python's, the rest as arrays."""
    each = [list(column) if column.ndim > 1 else column.tolist() for column in columns.values()]
    rows = zip(agents, zip(*each, strict=True), strict=True)
    return {agent: dict(zip(columns, row, strict=True)) for agent, row in rows}


def met(groups: tuple[tuple[int, ...], ...], rows: Rows) -> Bool[np.ndarray, "robots peers"]:
    """Whether each robot met each peer in this iteration; nobody meets itself."""
    out = np.zeros((len(rows), rows.n_robots), dtype=bool)
    for group in groups:
        members = np.array(group)
        peers = rows.peer(members)
        out[members[:, None], peers] = True
        out[members, peers] = False
    return out
