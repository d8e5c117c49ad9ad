"""Run one policy on one seed, and keep what happened."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Shaped

from baselines.policies import Oracle, Policy, make_policy
from envs.rendezvous_v0 import parallel_env
from wifipgo.files.atomic_files import write_sealed
from wifipgo.files.npz_files import read_sealed_npz
from wifipgo.graph.metrics import ate_rot, ate_trans
from wifipgo.rendezvous import NOBODY
from wifipgo.scenarios import Scenario
from wifipgo.state import Tick, World
from wifipgo.threads import one_thread

LAST = 10

OnTick = Callable[[Tick, World], None]
Steps = Mapping[str, Shaped[np.ndarray, "iterations robots"]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Episode:
    """What one policy did with one seed.

    Attributes:
        policy: Its spec, e.g. ``active:err_threshold=0.5``.
        trial: Number of the trial.
        seed: Seed of the environment and of the policy.
        figures: The episode in numbers, by name: columns of ``episodes.parquet``.
        steps: After each iteration, from the first on, by robot: columns of ``steps.parquet``.
        meetings: Iteration, x and y (m) of the middle of each group that met.
        reference: True trajectories.
        estimate: The trajectories as the robots believe them at the end.
        walls_m: Edges of the room.
        obstacles_m: Corners of each obstacle.
    """

    policy: str
    trial: int
    seed: int
    figures: Mapping[str, float]
    steps: Steps
    meetings: Float[np.ndarray, "meetings 3"]
    reference: Float[np.ndarray, "robots times 3"]
    estimate: Float[np.ndarray, "robots times 3"]
    walls_m: Float[np.ndarray, "walls 2 2"]
    obstacles_m: tuple[Float[np.ndarray, "_ 2"], ...]

    def save(self, path: Path) -> None:
        """Write to a file that is there whole or not at all."""
        arrays = {f"steps/{name}": column for name, column in self.steps.items()}
        arrays |= {name: getattr(self, name) for name in _ARRAYS}
        arrays |= {f"obstacle/{k}": corners for k, corners in enumerate(self.obstacles_m)}
        scalars = {name: getattr(self, name) for name in _SCALARS}
        np.savez(buffer := BytesIO(), allow_pickle=False, scalars=np.array(json.dumps(scalars)), **arrays)
        write_sealed(path, buffer.getvalue())

    @classmethod
    def load(cls, path: Path) -> "Episode":
        """Read what `save` wrote.

        Raises:
            BadInputError: The file was damaged; names it.
        """
        arrays: dict[str, Any] = read_sealed_npz(path)
        return cls(
            **json.loads(str(arrays.pop("scalars"))),
            **{name: arrays[name] for name in _ARRAYS},
            steps={name[6:]: arrays[name] for name in arrays if name.startswith("steps/")},
            obstacles_m=tuple(arrays[name] for name in arrays if name.startswith("obstacle/")),
        )


_SCALARS = ("policy", "trial", "seed", "figures")
_ARRAYS = ("meetings", "reference", "estimate", "walls_m")


def trial_seed(seed: int, trial: int) -> int:
    """Seed of a trial, the same for every policy."""
    return int(np.random.SeedSequence([seed, trial]).generate_state(1)[0])


@one_thread
def run_episode(
    scenario: str | Scenario,
    policy: str | Policy,
    seed: int,
    *,
    trial: int = 0,
    on_tick: OnTick | None = None,
) -> Episode:
    """Run one policy from the start of a world to its end.

    Args:
        scenario: Name or value.
        policy: Spec such as ``active:err_threshold=0.5``, or anything that drives a team.
        seed: Seed of the world, its noise and the policy's own chance.
        trial: Number to file the episode under.
        on_tick: Called at the start and after each iteration, e.g. to draw.

    Raises:
        ValueError: Unknown scenario, policy or parameter.
    """
    env = parallel_env(scenario=scenario)
    driver = make_policy(policy, env.scenario) if isinstance(policy, str) else policy
    driver.reset(seed)
    observations, _ = env.reset(seed=seed)
    rows: list[dict[str, np.ndarray]] = []
    meetings: list[np.ndarray] = []
    look = on_tick or _look_away
    look(env.tick, env.world)
    while env.agents:
        if isinstance(driver, Oracle):
            driver.see_truth(env.tick.truth.poses[:, -1])
        observations, *_, infos = env.step(driver.act(observations))
        rows.append(_row(env.tick, [info["mapped_share_truth"] for info in infos.values()]))
        meetings += _meetings(env.tick)
        look(env.tick, env.world)
    steps = {name: np.stack([row[name] for row in rows]) for name in rows[0]}
    return Episode(
        policy=policy if isinstance(policy, str) else type(policy).__name__,
        trial=trial,
        seed=seed,
        figures=_figures(steps, env.tick, len(meetings), env.scenario),
        steps=steps,
        meetings=np.stack(meetings) if meetings else np.zeros((0, 3)),
        reference=env.tick.truth.poses,
        estimate=env.tick.belief.paths.estimate,
        walls_m=env.world.layout.walls_m,
        obstacles_m=tuple(env.world.layout.obstacles_m),
    )


def _look_away(tick: Tick, world: World) -> None:
    """Nobody watches."""


def _row(tick: Tick, mapped_share: Sequence[float]) -> dict[str, np.ndarray]:
    """Every robot after one iteration, poses as believed at that time; bumps and distance since the start."""
    truth, belief = tick.truth, tick.belief
    now, believed = truth.poses[:, -1], belief.paths.estimate[:, -1]
    return {
        "err": belief.err,
        "ate_trans": ate_trans(belief.paths.estimate, truth.poses),
        "ate_rot": ate_rot(belief.paths.estimate, truth.poses),
        **dict(zip(("x_true_m", "y_true_m", "yaw_true_rad"), now.T, strict=True)),
        **dict(zip(("x_estimate_m", "y_estimate_m", "yaw_estimate_rad"), believed.T, strict=True)),
        "mapped_share": np.array(mapped_share),
        "met": np.isin(np.arange(len(now)), [robot for group in belief.team.met for robot in group]),
        "calling": belief.team.calls.callee != NOBODY,
        "bumps": truth.collisions,
        "distance_m": truth.distance_m,
    }


def _meetings(tick: Tick) -> list[np.ndarray]:
    """Iteration and true middle of each group that met in it."""
    middles = [tick.truth.poses[list(group), -1, :2].mean(axis=0) for group in tick.belief.team.met]
    return [np.array([tick.belief.t, *middle]) for middle in middles]


def _figures(steps: Steps, end: Tick, n_meetings: int, scenario: Scenario) -> dict[str, float]:
    """The episode in numbers; errors against truth are the team's at the end (Eqs. 12 and 13)."""
    truth, belief = end.truth, end.belief
    return {
        "mapped_share": float(steps["mapped_share"][-1, 0]),
        "err_last10": float(steps["err"][-LAST:].mean()),
        "ate_trans": float(steps["ate_trans"][-1].mean()),
        "ate_rot": float(steps["ate_rot"][-1].mean()),
        "rendezvous": n_meetings,
        "share_above": float((steps["err"] > scenario.rendezvous.err_threshold).mean()),
        "coverage": float(truth.cells.share[0]),
        "bumps": int(truth.collisions.sum()),
        "distance_m": float(truth.distance_m.sum()),
        "bytes_sent": int(belief.team.bytes_sent.sum()),
        "n_steps": belief.t,
    }
