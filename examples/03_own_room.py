"""A room of one's own from a file: a wall in the shape of an L, unequal robots, boxes that grow in number.

Run: python examples/03_own_room.py
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from baselines.policies import make_policy
from envs.rendezvous_v0 import parallel_env
from wifipgo.scenarios import scenario_named, scenario_toml

ROOM = """
base = "paper-hw-2"        # or another file; every field that is not named stays as it is there
n_steps = 15

[arena]
size_m = 12
obstacle_material = "brick"
obstacles_m = [            # polygons of any shape; this one is an L
  [[4, 4], [8, 4], [8, 4.5], [4.5, 4.5], [4.5, 8], [4, 8]],
]
starts = [[2, 2, 0], [10, 10, 3.14]]
step_scale = [1.0, 0.5]    # the second robot is slow,

[sensing]
noise_scale = [1.0, 0.3]   # and knows better where it is
"""

with TemporaryDirectory() as folder:
    path = Path(folder) / "room.toml"
    path.write_text(ROOM, encoding="utf-8")
    env = parallel_env(scenario=str(path))  # --scenario room.toml does the same on the command line
    path.write_text(scenario_toml(env.scenario), encoding="utf-8")
    assert scenario_named(str(path)) == env.scenario  # the whole scenario, written and read
    try:
        scenario_named(str(path), starts=((2.0, 2.0, 0.0), (6.0, 4.2, 0.0)))
    except ValueError as problem:
        print("refused:", problem)

policy = make_policy("active", env.scenario)
for n_obstacles in (0, 2, 4):  # a curriculum: options hold for one episode
    observations, infos = env.reset(seed=3, options={"n_obstacles": n_obstacles})
    policy.reset(3)
    while env.agents:
        observations, *_, infos = env.step(policy.act(observations))
    distance_m = np.round([info["distance_m_truth"] for info in infos.values()], 1)
    seen = infos["robot_0"]["coverage_truth"]
    print(f"{n_obstacles} boxes beside the L: robots drove {distance_m} m and saw {seen:.0%} of the room")
