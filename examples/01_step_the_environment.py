"""Two robots explore; the paper's policy calls them together when their error passes the threshold.

Run: python examples/01_step_the_environment.py
"""

from baselines.policies import make_policy
from envs.rendezvous_v0 import parallel_env

env = parallel_env(scenario="paper-hw-2", n_obstacles=4)  # any field of the scenario can be overridden
policy = make_policy("active", env.scenario)  # or write your own: act(observations) -> actions

for field in env.layout[:6]:
    print(f"[{field.start}:{field.start + field.size}]  {field.name:14s} {field.meaning} ({field.unit})")

observations, infos = env.reset(seed=7)
policy.reset(7)
while env.agents:
    observations, rewards, terminations, truncations, infos = env.step(policy.act(observations))
    errors = "  ".join(f"{agent} Err {info['err']:6.2f}" for agent, info in infos.items())
    met = infos["robot_0"]["met"].any()  # one boolean a robot
    print(f"{env.tick.belief.t:3d}  {errors}  {'<- rendezvous' if met else ''}")

print("mean square position error, m^2:", {a: round(i["ate_trans_truth"], 3) for a, i in infos.items()})
