"""What is optimised, when, by whom and under which guard: the configuration of the graph wing."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from wifipgo.errors import pick, require, require_within
from wifipgo.graph.backends import BACKENDS, Solve
from wifipgo.graph.metrics import ERR_WEIGHTS
from wifipgo.graph.outliers.methods import OUTLIER_METHODS
from wifipgo.graph.solve_weights import SOLVE_WEIGHTS
from wifipgo.graph.solvers import THIRD_PARTY

_SOLVE_WEIGHTS = "GraphConfig.solve_weights"


class PoseEstimator(NamedTuple):
    """When poses are optimised.

    Attributes:
        incremental: Whether every robot keeps a smoother that grows at every iteration, and a rendezvous is
            an exchange of graphs only; else those that meet solve, and only then.
        meaning: In words.
    """

    incremental: bool
    meaning: str


ESTIMATORS: Mapping[str, PoseEstimator] = MappingProxyType(
    {
        "at_rendezvous": PoseEstimator(False, "poses are optimised only when robots meet (paper mode)"),
        "every_step": PoseEstimator(True, "each robot optimises what it knows at every iteration"),
    }
)


@dataclass(frozen=True, slots=True, kw_only=True)
class GraphConfig:
    """What is optimised, when and by whom, and what guards it against outliers.

    The AOA gate of 7.2 degrees is the paper's (Sec. 7.3); sigma = 2.96 degrees makes g of Eq. 7 leave 1
    just there.

    Attributes:
        err_weights: "unit" (paper mode) or "information".
        solve_weights: Weights of relative poses when they are solved for (Eq. 3): "information", or "unit",
            those that Err_i has in paper mode.
        estimator: When poses are optimised: a name in `wifipgo.graph.config.ESTIMATORS`. With "every_step"
            robots that meet exchange their graphs, and each solves by itself.
        backend: Who optimises at a rendezvous: a name in `wifipgo.graph.backends.BACKENDS`.
        message_loss: Share of the messages of a back-end that sends any that are lost, and sent again.
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
    solve_weights: str = "information"
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
        pick(SOLVE_WEIGHTS, self.solve_weights, "solve_weights")
        pick(ESTIMATORS, self.estimator, "estimator")
        pick(BACKENDS, self.backend, "backend")
        loss = self.message_loss
        require(0.0 <= loss < 1.0, "GraphConfig.message_loss", "in [0, 1)", loss)
        pick(OUTLIER_METHODS, self.outliers, "outlier method")
        pick(THIRD_PARTY, self.third_party, "third_party")
        self._check_together()

    @property
    def incremental(self) -> bool:
        """Whether every robot solves at every iteration."""
        return ESTIMATORS[self.estimator].incremental

    @property
    def solve(self) -> Solve:
        """What those who meet do, by the back-end and the weights."""
        return SOLVE_WEIGHTS[self.solve_weights](BACKENDS[self.backend].solve)

    def _check_together(self) -> None:
        """Reject values that do not go with each other."""
        guard, backend = OUTLIER_METHODS[self.outliers], BACKENDS[self.backend]
        if self.incremental:
            rule = f"one of {_without_messages()} with {self.estimator}"
            require(not backend.sends, "GraphConfig.backend", rule, self.backend)
            rule = f"without 'gnc' and 'pcm', which solve again from scratch, with {self.estimator}"
            require(guard.incremental, "GraphConfig.outliers", rule, self.outliers)
        else:
            require(not self.aoa_factors, "GraphConfig.aoa_factors", "False but with every_step", True)
        if self.solve_weights != "information":
            plain = not self.incremental and guard.loss == "none" and not guard.bearings
            rule = "'information' with every_step, and with losses, bearings and PCM, which weigh by sigma"
            require(plain and guard.gate.by_agreement is None, _SOLVE_WEIGHTS, rule, self.solve_weights)
        rule = f"without bearings with the {self.backend} backend"
        require(backend.bearings or not guard.bearings, "GraphConfig.outliers", rule, self.outliers)
        rule = "0 but with a backend that sends messages, as 'distributed'"
        require(
            backend.sends or self.message_loss == 0.0, "GraphConfig.message_loss", rule, self.message_loss
        )


def _without_messages() -> str:
    """Names of the back-ends that send nothing while they solve."""
    return ", ".join(repr(name) for name, row in BACKENDS.items() if not row.sends)
