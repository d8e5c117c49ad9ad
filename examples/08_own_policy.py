"""A policy of your own beside the paper's and chance, on the same worlds; nothing is written.

Run: python examples/08_own_policy.py
With intervals and pictures: wifipgo evaluate --policies examples/08_own_policy.py:Wanderer,active,random
"""

import numpy as np

from baselines.evaluate import run_episodes
from baselines.policies import Actions, Observations
from envs.rendezvous_v0 import bin_azimuths, layout
from wifipgo.scenarios import Scenario, scenario_named

SCENARIO = scenario_named("paper-hw-2", size_m=10.0, n_steps=30)  # a small room, so that they meet soon
SEEDS = range(8)
SHOWN = ("mapped_share", "err_last10", "ate_trans", "rendezvous")


class Wanderer:
    """Keeps its way where that is free; when lost it waits and calls, when called it comes by the signal.

    A policy needs ``act`` alone. Who asks for the scenario, for options (``...:Wanderer:share=0.3``) or, with
    ``reset(seed)``, for the seed of an episode, gets them.
    """

    def __init__(self, scenario: Scenario, share: float = 0.5) -> None:
        """Find the parts of an observation; calls from this share of the scenario's threshold on."""
        self.where, self.share = {field.name: field.where for field in layout(scenario)}, share
        self.rays_rad = 2.0 * np.pi / 16 * np.arange(16)  # of the lidar, in the body frame, the first ahead
        self.on = 0.3 * np.cos(self.rays_rad + scenario.turn.turn_rad)  # the radio's turn is taken back

    def act(self, observations: Observations) -> Actions:
        """One action for each robot: a step ahead and to the left, and whether to call; each in [-1, 1]."""
        return {robot: self.action(seen) for robot, seen in observations.items()}

    def action(self, seen: np.ndarray) -> np.ndarray:
        """What one robot does."""
        part = {name: seen[where] for name, where in self.where.items()}
        if part["own/err"] > self.share and part["slot0/present"]:
            return np.array([0.0, 0.0, 1.0])
        angle = self.rays_rad[np.argmax(part["lidar"] + self.on)]
        if part["slot0/calls_me"]:
            angle = bin_azimuths()[np.argmax(part["slot0/profile"])]
        return np.array([np.cos(angle), np.sin(angle), -1.0])


if __name__ == "__main__":
    print(f"{'policy':10}", *(f"{name:>12}" for name in SHOWN))
    for policy in (Wanderer, "active", "random"):
        episodes = run_episodes(SCENARIO, policy, SEEDS)
        means = [np.mean([episode.figures[name] for episode in episodes]) for name in SHOWN]
        print(f"{episodes[0].policy:10}", *(f"{mean:12.3f}" for mean in means))
