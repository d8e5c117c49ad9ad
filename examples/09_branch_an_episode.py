"""What was one rendezvous worth? Branch an episode where it is due: one half meets, the other drives on.

Run: python examples/09_branch_an_episode.py

Both branches begin from one snapshot, chance included, so all that differs is what the robots do.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from baselines.policies import make_policy
from envs.rendezvous_v0 import RendezvousEnv, parallel_env

N_STEPS_AFTER = 12
Act = Callable[[Mapping[str, Any]], Mapping[str, np.ndarray]]


def to_the_first_call(env: RendezvousEnv, act: Act) -> Mapping[str, Any]:
    """Play until somebody calls for a rendezvous; the observations then."""
    observations, _ = env.reset(seed=1)
    while env.agents:
        calls = env.tick.belief.team.calls.callee
        if (calls >= 0).any():
            return observations
        observations, *_ = env.step(act(observations))
    raise SystemExit("nobody called in this episode: take another seed")


def branch(env: RendezvousEnv, observations: Mapping[str, Any], act: Act) -> tuple[float, float, bool]:
    """Play some steps: mean squared position error, mapped share, and whether robots met."""
    met = False
    for _ in range(N_STEPS_AFTER):  # the call comes early enough for as many
        observations, _, _, _, infos = env.step(act(observations))
        met = met or any(info["met"].any() for info in infos.values())
    error_m2 = float(np.mean([info["ate_trans_truth"] for info in infos.values()]))
    return error_m2, infos["robot_0"]["mapped_share_truth"], met


def main() -> None:
    """Print both branches."""
    env = parallel_env("paper-hw-2")
    active, alone = (make_policy(name, env.scenario) for name in ("active", "frontier"))
    active.reset(1)
    alone.reset(1)
    observations = to_the_first_call(env, active.act)
    snapshot = env.snapshot()
    print(f"a call is up at iteration {env.tick.belief.t}; {N_STEPS_AFTER} iterations later:")
    for name, policy in (("meet", active), ("explore alone", alone)):
        env.restore(snapshot)
        error_m2, share, met = branch(env, observations, policy.act)
        print(
            f"  {name:14s} met: {'yes' if met else 'no ':4s} error {error_m2:6.3f} m^2   mapped {share:.3f}"
        )


if __name__ == "__main__":
    main()
