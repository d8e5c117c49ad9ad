"""Trained policies as policies: numpy only, so a robot or an evaluation needs no torch."""

from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from baselines.policies.learned.ablations import Without
from baselines.policies.learned.interfaces import make_interface, names_read
from baselines.policies.learned.network import Network, load_network, refuse_other_layout
from baselines.policies.learned.run_files import network_file
from baselines.policies.learned.training_scenarios import trained_elsewhere
from baselines.policies.observation_view import View
from baselines.policies.policy import DrivesTeams
from wifipgo.errors import require
from wifipgo.scenarios import Scenario

SHIPPED = "everywhere.npz"
_EPISODE_KEY = 0x99


class LearnedPolicy(DrivesTeams):
    """A trained network that drives every robot, each by its own observation.

    Args:
        scenario: Has to observe the blocks that the network reads, whatever else it does; `rays` takes any
            number of neighbours and any length of an episode.
        path: File that training exported, or the folder of a training run; without one, the policy that ships
            with the package.
        checkpoint: Of a run: best or last.
        sample: Draw actions with the probabilities of the network, as in training; else take the best.
        without: What it is played without, of profile, camera and calls: one, or several as profile+camera.

    Attributes:
        remark: What differs from the scenario that it was trained on; empty where nothing does.

    Raises:
        ValueError: The file is no trained policy, or of another layout (the message says which block).
        OSError: It cannot be read.
    """

    def __init__(
        self,
        scenario: Scenario,
        *,
        path: str = "",
        checkpoint: str = "best",
        sample: bool = False,
        without: str = "",
    ) -> None:
        """Read the network and check that it fits."""
        network = load_network(network_file(Path(path), checkpoint)) if path else shipped()
        where = path or "the shipped policy"
        self._prepare(network, scenario, where=where, sample=sample, without=without)

    @classmethod
    def of(cls, network: Network, scenario: Scenario, *, sample: bool = False) -> "LearnedPolicy":
        """A network from memory."""
        policy = cls.__new__(cls)
        policy._prepare(network, scenario, where="the network", sample=sample)
        return policy

    def _prepare(
        self, network: Network, scenario: Scenario, *, where: str, sample: bool, without: str = ""
    ) -> None:
        trained = [name for name, _ in network.layout]
        refuse_other_layout(network, scenario, where, reads=names_read(network.interface, trained, scenario))
        self._interface = make_interface(network.interface, scenario, trained)
        require(
            len(network.mean) == self._interface.n_shown,
            f"numbers that {where} is shown",
            f"{self._interface.n_shown}, as the interface {network.interface!r} of this version has it",
            len(network.mean),
        )
        can_sample = bool(self._interface.n_choices) or not sample
        require(
            can_sample, "sample", f"False for the interface {network.interface!r}: it has no choices", sample
        )
        self._without = Without(without, scenario)
        self._memory: Any = None
        self._network, self._sample, self.remark = network, sample, trained_elsewhere(network, scenario)
        super().__init__(scenario, key=_EPISODE_KEY)

    def _actions(self, view: View) -> Float[np.ndarray, "rows 3"]:
        rows = self._without.shown(view.rows)
        before = None if self._without.forgets else self._memory
        self._memory = self._interface.remembered(rows, before, view.begins)
        shown = self._interface.shown(rows, self._memory)
        # A product's rounding depends on how many rows it has: each team's is a product of its own.
        teams = shown.reshape(-1, view.n_robots, shown.shape[1])
        scores = self._network.scores(teams).reshape(len(shown), -1)
        return self._without.commanded(self._interface.commands(self._answers(scores), rows))

    def _answers(self, scores: Float[np.ndarray, "rows outputs"]) -> np.ndarray:
        """The best choice of each kind, or one drawn with the softmax of its scores."""
        choices = self._interface.n_choices
        if not choices:
            return scores
        if self._sample:  # the greatest of scores with Gumbel noise has the probability of the softmax
            scores = scores + self._rng.gumbel(size=scores.shape)
        parts = np.split(scores, np.cumsum(choices)[:-1], axis=1)
        return np.stack([part.argmax(axis=1) for part in parts], axis=1)


def shipped() -> Network:
    """The network that comes with the package."""
    with as_file(files("baselines") / "trained" / SHIPPED) as path:
        return load_network(path)
