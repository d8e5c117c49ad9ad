"""What is said of each robot beside its observation, of the same keys, shapes and dtypes at every iteration.

Learners stack infos into tensors, so nothing here may grow, shrink or be left out.
"""

from typing import Any

import numpy as np
from jaxtyping import Bool, Int8

from wifipgo.graph.metrics import ate_rot, ate_trans
from wifipgo.state import Tick
from wifipgo.world.coverage_belief import team_share


def infos(
    tick: Tick, agents: list[str], *, mapped_share: float, masks: Int8[np.ndarray, "robots choices"] | None
) -> dict[str, dict[str, Any]]:
    """Metrics of each robot by agent; those that end in ``_truth`` read what robots cannot know.

    Args:
        tick: State after the iteration.
        agents: Names of all robots.
        mapped_share: Of the team, by the truth.
        masks: Of choices, where actions are choices.
    """
    truth, belief, n = tick.truth, tick.belief, len(agents)
    columns: dict[str, list[Any]] = {
        "err": belief.err.tolist(),
        "met": list(met(belief.team.met, n)),
        "ate_trans_truth": ate_trans(belief.paths.estimate, truth.poses).tolist(),
        "ate_rot_truth": ate_rot(belief.paths.estimate, truth.poses).tolist(),
        "bumps_truth": truth.collisions.tolist(),
        "distance_m_truth": truth.distance_m.tolist(),
        "mapped_share_belief": [float(team_share(belief.coverage)[0])] * n,
        "mapped_share_truth": [mapped_share] * n,
        "coverage_truth": [float(truth.cells.share[0])] * n,
    }
    if masks is not None:
        columns["action_mask"] = list(masks)
    rows = zip(agents, zip(*columns.values(), strict=True), strict=True)
    return {agent: dict(zip(columns, row, strict=True)) for agent, row in rows}


def met(groups: tuple[tuple[int, ...], ...], n_robots: int) -> Bool[np.ndarray, "robots robots"]:
    """Whether robot i met robot j in this iteration; nobody meets itself."""
    out = np.zeros((n_robots, n_robots), dtype=bool)
    for group in groups:
        out[np.ix_(group, group)] = True
    np.fill_diagonal(out, False)
    return out
