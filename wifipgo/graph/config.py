"""What is optimised, when, by whom and under which guard: the configuration of the graph wing."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from wifipgo.errors import pick, require, require_within
from wifipgo.graph.metrics import ERR_WEIGHTS
from wifipgo.graph.outliers.methods import OUTLIER_METHODS
from wifipgo.graph.solvers import THIRD_PARTY

ESTIMATORS: Mapping[str, str] = MappingProxyType(
    {
        "at_rendezvous": "poses are optimised only when robots meet (paper mode)",
        "every_step": "each robot optimises what it knows at every iteration (iSAM2)",
    }
)
BACKENDS: Mapping[str, str] = MappingProxyType(
    {
        "gtsam": "one of those that meet solves for all",
        "distributed": "those that meet each solve for their own poses and exchange separators",
    }
)


@dataclass(frozen=True, slots=True, kw_only=True)
class GraphConfig:
    """What is optimised, when and by whom, and what guards it against outliers.

    The AOA gate of 7.2 degrees is the paper's (Sec. 7.3); sigma = 2.96 degrees makes g of Eq. 7 leave 1
    just there.

    Attributes:
        err_weights: "unit" (paper mode) or "information".
        estimator: When poses are optimised: a name in `ESTIMATORS`. With "every_step" robots that meet
            exchange their graphs, and each solves by itself.
        backend: Who optimises at a rendezvous: a name in `BACKENDS`.
        message_loss: Share of the messages of the distributed backend that are lost, and sent again.
        outliers: What guards the optimisation against outliers: a name in
            `wifipgo.graph.OUTLIER_METHODS`. A gate on direction weighs measurements as they come, so Err_i
            has its weights; what a loss or PCM lets go at a rendezvous counts in Err_i as before.
        aoa_factors: Whether directions of robots in the slots, however far, are measurements at every
            iteration: each packet then says where its sender thinks it is.
        aoa_gate_rad: Delta of Eq. 11.
        aoa_sigma_rad: sigma of Eq. 7, and of a bearing that is a measurement of its own.
        third_party: What measurements of absent robots do in an optimisation: "fixed_told" or "ignore".
    """

    err_weights: str = "unit"
    estimator: str = "at_rendezvous"
    backend: str = "gtsam"
    message_loss: float = 0.0
    outliers: str = "none"
    aoa_factors: bool = False
    aoa_gate_rad: float = float(np.deg2rad(7.2))
    aoa_sigma_rad: float = float(np.deg2rad(2.96))
    third_party: str = "fixed_told"

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        require_within(self, {"message_loss": (0.0, 1.0)})
        require_within(self, dict.fromkeys(("aoa_gate_rad", "aoa_sigma_rad"), (1e-4, np.pi)))
        pick(ERR_WEIGHTS, self.err_weights, "err_weights")
        pick(ESTIMATORS, self.estimator, "estimator")
        pick(BACKENDS, self.backend, "backend")
        loss = self.message_loss
        require(0.0 <= loss < 1.0, "GraphConfig.message_loss", "in [0, 1)", loss)
        pick(OUTLIER_METHODS, self.outliers, "outlier method")
        pick(THIRD_PARTY, self.third_party, "third_party")
        self._check_together()

    def _check_together(self) -> None:
        """Reject values that do not go with each other."""
        guard, by_robots = OUTLIER_METHODS[self.outliers], self.backend == "distributed"
        if self.estimator == "every_step":
            require(not by_robots, "GraphConfig.backend", "'gtsam' with every_step", self.backend)
            able = guard.loss != "gnc" and guard.gate != "pcm"
            rule = "without 'gnc' and 'pcm', which solve again from scratch, with every_step"
            require(able, "GraphConfig.outliers", rule, self.outliers)
        else:
            require(not self.aoa_factors, "GraphConfig.aoa_factors", "False but with every_step", True)
        if by_robots:
            rule = "without bearings with the distributed backend"
            require(not guard.bearings, "GraphConfig.outliers", rule, self.outliers)
        rule = "0 but with the distributed backend, which sends messages"
        lossy = self.message_loss
        require(by_robots or lossy == 0.0, "GraphConfig.message_loss", rule, lossy)
