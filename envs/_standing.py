"""Where an environment stands, in a line: what its ``repr`` says."""

from collections.abc import Sequence

from envs._episode import Episode
from wifipgo.scenarios import Scenario


def standing(scenario: Scenario, episodes: Sequence[Episode], *, n_worlds: int = 0) -> str:
    """Scenario, robots, worlds, seed and iteration.

    Args:
        scenario: What is played.
        episodes: Those that are played, by when they began; none before the first reset.
        n_worlds: How many worlds there are side by side; 0 where there is one by itself.
    """
    worlds = [f"{n_worlds} worlds"] if n_worlds else []
    when = [*(_seed(episodes) if not n_worlds else []), _iterations(episodes)] if episodes else ["not reset"]
    return ", ".join([repr(scenario.name), f"{scenario.n_robots} robots", *worlds, *when])


def _seed(episodes: Sequence[Episode]) -> list[str]:
    """Seed and number of the episode of a world by itself."""
    ((seed, number),) = episodes[0].seeds
    return [f"seed {seed}"] + ([f"episode {number}"] if number else [])


def _iterations(episodes: Sequence[Episode]) -> str:
    """How far the episodes are, from the last that began to the first."""
    done = sorted({episode.tick.belief.t for episode in episodes})
    words = f"iteration {done[0]}" if len(done) == 1 else f"iterations {done[0]} to {done[-1]}"
    return f"{words} of {max(episode.scenario.n_steps for episode in episodes)}"
