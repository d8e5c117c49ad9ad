"""Trained policies as policies: numpy only, so a robot or an evaluation needs no torch."""

from collections.abc import Mapping
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np
from jaxtyping import Float

from baselines.policies.learned.interfaces import make_interface, names_read
from baselines.policies.learned.network import Network, layout_of, load_network, refuse_other_layout
from baselines.policies.observation_view import flat_rows
from wifipgo.arithmetic import plain_arithmetic
from wifipgo.errors import require
from wifipgo.scenarios import Scenario

SHIPPED = "paper-sim-2.npz"
_EPISODE_KEY = 0x99


class LearnedPolicy:
    """A trained network that drives every robot, each by its own observation.

    Args:
        scenario: Has to observe the blocks that the network reads, whatever else it does; `rays` takes any
            number of neighbours and any length of an episode.
        path: File that training exported; without one, the policy that ships with the package.
        sample: Draw actions with the probabilities of the network, as in training; else take the best.

    Raises:
        ValueError: The file is no trained policy, or of another layout (the message says which block).
        OSError: It cannot be read.
    """

    def __init__(self, scenario: Scenario, *, path: str = "", sample: bool = False) -> None:
        """Read the network and check that it fits."""
        network = load_network(Path(path)) if path else shipped()
        self._prepare(network, scenario, where=path or "the shipped policy", sample=sample)

    @classmethod
    def of(cls, network: Network, scenario: Scenario, *, sample: bool = False) -> "LearnedPolicy":
        """A network from memory."""
        policy = cls.__new__(cls)
        policy._prepare(network, scenario, where="the network", sample=sample)
        return policy

    def _prepare(self, network: Network, scenario: Scenario, *, where: str, sample: bool) -> None:
        trained = [name for name, _ in network.layout]
        refuse_other_layout(network, scenario, where, reads=names_read(network.interface, trained, scenario))
        self._interface = make_interface(network.interface, scenario, trained)
        self._n_numbers = sum(size for _, size in layout_of(scenario))
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
        self._network, self._sample = network, sample
        self.reset(0)

    def reset(self, seed: int, episode: int = 0) -> None:
        """Key the chance of sampled actions; nothing else is remembered."""
        self._rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(episode, _EPISODE_KEY)))

    @plain_arithmetic
    def act(
        self, observations: Mapping[str, Float[np.ndarray, " numbers"]]
    ) -> dict[str, Float[np.ndarray, "3"]]:
        """One action for each observation.

        Raises:
            ValueError: Observations of another scenario.
        """
        rows = flat_rows(observations)
        n, rule = rows.shape[1], f"{self._n_numbers} numbers of the scenario that the policy was made for"
        require(n == self._n_numbers, "observations", rule, n)
        scores = self._network.scores(self._interface.shown(rows))
        actions = self._interface.commands(self._answers(scores), rows)
        return dict(zip(observations, actions, strict=True))

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
