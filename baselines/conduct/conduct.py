"""What teams did in many worlds, iteration by iteration, as arrays."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from baselines.evaluation.episodes import Episode

Curves = Float[np.ndarray, "worlds iterations"]
OfRobots = Float[np.ndarray, "worlds iterations robots"]


class Conduct(NamedTuple):
    """What teams did. A world that ended early stays as it ended; nobody meets or calls there.

    Attributes:
        mapped: Mapped share, the score.
        seen: Share of the floor that the team has seen.
        met: Whether a robot met.
        calling: Whether a call of its own is up.
        from_start_m: True distance from where it started.
        error_m: True distance of its position from where it believes to be.
        driven_m: Its way so far.
        bumps: Its bumps so far.
    """

    mapped: Curves
    seen: Curves
    met: Bool[np.ndarray, "worlds iterations robots"]
    calling: Bool[np.ndarray, "worlds iterations robots"]
    from_start_m: OfRobots
    error_m: OfRobots
    driven_m: OfRobots
    bumps: OfRobots


def conduct_of(episodes: Sequence[Episode], n_steps: int) -> Conduct:
    """What teams did in some episodes.

    Args:
        episodes: One a world.
        n_steps: Iterations of the longest possible.
    """
    each = [_columns(episode, n_steps) for episode in episodes]
    return Conduct(*(np.stack([columns[name] for columns in each]) for name in Conduct._fields))


def joined(parts: Sequence[Conduct]) -> Conduct:
    """The worlds of some parts, one after the other."""
    return Conduct(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def mean_curves(conduct: Conduct) -> dict[str, Float[np.ndarray, " iterations"]]:
    """Every array as its mean over worlds and robots, by iteration."""
    return {
        name: array.reshape(*array.shape[:2], -1).mean(axis=(0, 2))
        for name, array in conduct._asdict().items()
    }


def _columns(episode: Episode, n_steps: int) -> dict[str, np.ndarray]:
    """Arrays of one world, as long as those of all others."""
    steps, start_m = episode.steps, episode.reference[:, 0, :2]
    true_m = np.stack([steps["x_true_m"], steps["y_true_m"]], axis=-1)
    believed_m = np.stack([steps["x_estimate_m"], steps["y_estimate_m"]], axis=-1)
    iteration = np.arange(n_steps)
    last, goes_on = np.minimum(iteration, len(true_m) - 1), (iteration < len(true_m))[:, None]
    return {
        "mapped": steps["mapped_share"][last, 0],
        "seen": steps["coverage"][last, 0],
        "met": steps["met"][last] & goes_on,
        "calling": steps["calling"][last] & goes_on,
        "from_start_m": np.linalg.norm(true_m - start_m, axis=-1)[last],
        "error_m": np.linalg.norm(true_m - believed_m, axis=-1)[last],
        "driven_m": steps["distance_m"][last].astype(np.float64),
        "bumps": steps["bumps"][last].astype(np.float64),
    }
