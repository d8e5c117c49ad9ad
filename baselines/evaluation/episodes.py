"""Run one policy on some seeds, all at once, and keep what happened."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from baselines.evaluation.drivers import AnyPolicy, driver_of, is_made_anew, name_of
from baselines.evaluation.recording import End, Now, Recording, Steps
from baselines.policies import Oracle, TeamsPolicy, drives_teams
from envs.rendezvous_v0 import RendezvousVectorEnv, vector_env
from wifipgo.files.atomic_files import write_sealed
from wifipgo.files.npz_files import read_sealed_npz
from wifipgo.scenarios import Scenario
from wifipgo.state import Tick, World
from wifipgo.threads import one_thread

LAST = 10

OnTick = Callable[[Tick, World], None]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Episode:
    """What one policy did with one seed.

    Attributes:
        policy: Its label, e.g. ``mine`` or ``active:err_threshold=0.5``.
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
        arrays = {name: getattr(self, name) for name in _ARRAYS} | {"steps": _packed(self.steps)}
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
        steps = arrays["steps"]
        return cls(
            **json.loads(str(arrays.pop("scalars"))),
            **{name: arrays[name] for name in _ARRAYS},
            steps={name: np.ascontiguousarray(steps[name]) for name in steps.dtype.names},
            obstacles_m=tuple(arrays[name] for name in arrays if name.startswith("obstacle/")),
        )


_SCALARS = ("policy", "trial", "seed", "figures")
_ARRAYS = ("meetings", "reference", "estimate", "walls_m")


def trial_seed(seed: int, trial: int) -> int:
    """Seed of a trial, the same for every policy."""
    return int(np.random.SeedSequence([seed, trial]).generate_state(1)[0])


def run_episode(
    scenario: str | Scenario,
    policy: AnyPolicy,
    seed: int,
    *,
    trial: int = 0,
    label: str = "",
    on_tick: OnTick | None = None,
) -> Episode:
    """Run one policy from the start of a world to its end.

    Args:
        scenario: Name or value.
        policy: Spec such as ``active:err_threshold=0.5`` or ``own.py:Policy``, anything with
            ``act(observations)``, or a class or function that makes such.
        seed: Seed of the world, its noise and the policy's own chance.
        trial: Number to file the episode under.
        label: Name to file it under; without one that of the policy.
        on_tick: Called at the start and after each iteration, e.g. to draw.

    Raises:
        ValueError: Unknown scenario, policy or parameter, or actions that cannot be carried out.
    """
    look = on_tick or _look_away

    def look_at(env: RendezvousVectorEnv) -> object:
        return look(env.tick_of(0), env.world_of(0))

    return _run(scenario, policy, [seed], trials=[trial], label=label, look=look_at)[0]


def run_episodes(
    scenario: str | Scenario,
    policy: AnyPolicy,
    seeds: Sequence[int],
    *,
    trials: Sequence[int] | None = None,
    label: str = "",
) -> list[Episode]:
    """Run one policy in many worlds at once; each episode is what `run_episode` makes of its seed.

    Args:
        scenario: Name or value.
        policy: As for `run_episode`. An object that knows one team only plays one world after the other; a
            class or a spec is made anew for each world.
        seeds: Of each world.
        trials: Numbers to file the episodes under; without them those of the places.
        label: Name to file them under; without one that of the policy.

    Raises:
        ValueError: Unknown scenario, policy or parameter, or actions that cannot be carried out.
    """
    numbers = range(len(seeds)) if trials is None else trials
    if is_made_anew(policy) or drives_teams(policy):
        return _run(scenario, policy, seeds, trials=numbers, label=label, look=_look_away)
    each = zip(seeds, numbers, strict=True)
    return [run_episode(scenario, policy, seed, trial=k, label=label) for seed, k in each]


@one_thread
def _run(
    scenario: str | Scenario,
    policy: AnyPolicy,
    seeds: Sequence[int],
    *,
    trials: Sequence[int],
    label: str,
    look: Callable[[RendezvousVectorEnv], object],
) -> list[Episode]:
    """Play all worlds to their ends, and put the episodes together."""
    env = vector_env(scenario, n_worlds=len(seeds))
    name = label or name_of(policy)
    driver = driver_of(policy, env.scenario, name)
    ends: dict[int, End] = {}

    def keep_end(world: int) -> None:
        ends[world] = End.of(env, world)

    recording = play(env, driver, seeds, at_end=keep_end, look=look)
    threshold = env.scenario.rendezvous.err_threshold
    return [
        _episode(recording, k, ends[k], policy=name, trial=trial, seed=seed, threshold=threshold)
        for k, (trial, seed) in enumerate(zip(trials, seeds, strict=True))
    ]


def play(
    env: RendezvousVectorEnv,
    driver: TeamsPolicy,
    seeds: Sequence[int],
    *,
    at_end: Callable[[int], object],
    look: Callable[[RendezvousVectorEnv], object] | None = None,
) -> Recording:
    """Play every world to its end.

    Args:
        env: The worlds.
        driver: Drives their teams.
        seeds: Of each world.
        at_end: Called with the number of each world when it ends, while it stands there.
        look: Called at the start and after each iteration.
    """
    driver.reset_rows(seeds)
    observations, _ = env.reset(seed=list(seeds))
    recording, now = Recording(env.n_worlds, env.scenario.n_steps), Now.of(env)
    look = look or _look_away
    look(env)
    while (live := ~env.over).any():
        if isinstance(driver, Oracle):
            driver.see_truth(now.true)
        observations, *_, infos = env.step(driver.act_rows(observations))
        now = Now.of(env)
        recording.add(now, infos, live)
        for k in np.flatnonzero(live & env.over).tolist():
            at_end(k)
        look(env)
    return recording


def _look_away(*_: object) -> None:
    """Nobody watches."""


def _episode(
    recording: Recording, world: int, end: End, *, policy: str, trial: int, seed: int, threshold: float
) -> Episode:
    """What was recorded of one world."""
    steps, meetings = recording.steps(world), recording.meetings(world)
    figures = _figures(steps, threshold=threshold, n_meetings=len(meetings), end=end)
    return Episode(
        policy=policy,
        trial=trial,
        seed=seed,
        figures=figures,
        steps=steps,
        meetings=meetings,
        reference=end.reference,
        estimate=end.estimate,
        walls_m=end.layout.walls_m,
        obstacles_m=tuple(end.layout.obstacles_m),
    )


def _figures(steps: Steps, *, threshold: float, n_meetings: int, end: End) -> dict[str, float]:
    """The episode in numbers; errors against truth are the team's at the end (Eqs. 12 and 13)."""
    return {
        "mapped_share": float(steps["mapped_share"][-1, 0]),
        "err_last10": float(steps["err"][-LAST:].mean()),
        "ate_trans": float(steps["ate_trans"][-1].mean()),
        "ate_rot": float(steps["ate_rot"][-1].mean()),
        "rendezvous": n_meetings,
        "share_above": float((steps["err"] > threshold).mean()),
        "coverage": float(steps["coverage"][-1, 0]),
        "bumps": int(steps["bumps"][-1].sum()),
        "distance_m": float(steps["distance_m"][-1].sum()),
        "bytes_sent": end.bytes_sent,
        "airtime_s": end.airtime_s,
        "n_steps": len(steps["err"]),
    }


def _packed(steps: Steps) -> np.ndarray:
    """Columns as one array of records: an archive of few arrays is read several times faster."""
    of = np.dtype([(name, column.dtype) for name, column in steps.items()])
    out = np.empty(steps["err"].shape, dtype=of)
    for name, column in steps.items():
        out[name] = column
    return out
