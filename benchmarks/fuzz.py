r"""Scenarios drawn from all that their fields allow, and what of their episodes is not as it should be.

::

    python -m benchmarks.fuzz --scenarios 500 --seed 0

Fields, types and limits are found where they are defined: a value is tried, and where it is refused
the message says which field it was; that field is left as it was. The ends of ranges, which are
allowed, are drawn as they stand there.
"""

import argparse
import re
import sys
import time
import traceback
import warnings
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np

from baselines.policies import make_policy
from envs.rendezvous_v0 import RendezvousEnv, parallel_env
from wifipgo.command.command_line import exit_code
from wifipgo.errors import DoubtfulError
from wifipgo.graph.backends import BACKENDS
from wifipgo.graph.config import ESTIMATORS
from wifipgo.graph.metrics import ERR_WEIGHTS
from wifipgo.graph.outliers.methods import OUTLIER_METHODS
from wifipgo.graph.solvers import THIRD_PARTY
from wifipgo.radio.aoa import ESTIMATORS as AOA_ESTIMATORS
from wifipgo.radio.channel.bands import BANDS
from wifipgo.radio.propagation.diffuse_scattering import DIFFUSE_POWERS
from wifipgo.radio.propagation.materials import MATERIALS
from wifipgo.scenarios import SCENARIOS, Scenario, field_kinds
from wifipgo.scenarios.field_table import field_rows

LONGEST_S = 20.0  # of processor time, for a step or a reset
# Names that a field of words may have, and the ends of numbers whose larger values cost time.
NAMES: Mapping[str, tuple[Any, ...]] = {
    "wall_material": tuple(MATERIALS),
    "obstacle_material": tuple(MATERIALS),
    "diffuse_power_of": tuple(DIFFUSE_POWERS),
    "err_weights": tuple(ERR_WEIGHTS),
    "estimator": tuple(ESTIMATORS),
    "backend": tuple(BACKENDS),
    "outliers": tuple(OUTLIER_METHODS),
    "third_party": tuple(THIRD_PARTY),
    "aoa_estimator": tuple(AOA_ESTIMATORS),
    "bandwidth_hz": tuple(BANDS),
    "n_azimuths": (72, 144, 360, 720),
}
CHEAP: Mapping[str, tuple[int, int]] = {
    "n_robots": (2, 6),
    "n_slots": (1, 5),
    "n_steps": (1, 999_000),
    "n_positions": (8, 128),
    "n_substeps": (1, 200),
    "n_obstacles": (0, 30),
}
# Drawn from when a scenario is made, and sizes: small rooms, where robots meet.
SIZES_M = (0.7, 3.0, 6.0, 6.0, 12.0, 12.0, 40.0, 400.0)
AT_A_LIMIT = 0.2  # share of numbers
FAR = (0.0, 1e-300, 1e-9, 1e-6, 1e-4, 1e-2, 1.0, 1e2, 1e4, 1e6, 1e9, 1e300)


def _number(value: float, rng: np.random.Generator) -> float:
    """Near what it is, of any size, or where something else begins."""
    way = rng.integers(5)
    if way == 0:
        return float(rng.choice(FAR)) * float(rng.choice([1.0, 1.0, 1.0, -1.0]))
    if way == 1:
        return float(rng.uniform(0.0, 1.0))
    return (value or 0.5) * float(np.exp(rng.normal(0.0, 0.3 if way < 4 else 3.0)))


@cache
def limits(name: str) -> tuple[float, ...]:
    """Ends of a field's range, as its refusal names them; none for a field without."""
    if name in CHEAP:
        return CHEAP[name]
    try:
        SCENARIOS["paper-hw-2"].with_overrides(**{name: 10**30 if field_kinds()[name] is int else 1e300})
    except ValueError as refused:
        found = re.search(rf"\b{name} must be in (\S+?)\.\.(\S+?),? ", str(refused))
        return tuple(map(float, found.groups())) if found else ()
    return ()


def _polygons(size_m: float, rng: np.random.Generator) -> tuple[tuple[tuple[float, float], ...], ...]:
    """Stars about random places, some clockwise or closed, and two squares that share a face."""
    out = []
    for _ in range(rng.integers(0, 4)):
        n = int(rng.integers(3, 9))
        angle, reach = 2.0 * np.pi / n * np.arange(n), size_m * rng.uniform(0.02, 0.12, n)
        ring = rng.uniform(0.15, 0.85, 2) * size_m + reach[:, None] * np.stack(
            [np.cos(angle), np.sin(angle)], 1
        )
        ring = ring[:: int(rng.choice([1, -1]))]
        out.append(tuple(map(tuple, np.vstack([ring, ring[: rng.integers(2)]]).tolist())))
    if rng.random() < 0.3:
        x, y, w = 0.1 * size_m, 0.1 * size_m, 0.05 * size_m
        out += [((a, y), (a + w, y), (a + w, y + w), (a, y + w)) for a in (x, x + w)]
    return tuple(out)


def _tuple_of(name: str, n_robots: int, size_m: float, rng: np.random.Generator) -> Any:
    """Values of the fields that are tuples: one a robot, places, polygons."""
    if name == "obstacles_m":
        return _polygons(size_m, rng)
    if name == "starts":
        return tuple(map(tuple, rng.uniform(0.0, size_m, (n_robots, 3)).tolist()))
    if name == "antennas_m":
        return tuple(map(tuple, rng.normal(0.0, 0.1, (rng.integers(0, 4), 2)).tolist()))
    if name == "obstacle_materials":
        return tuple(rng.choice(list(MATERIALS), rng.integers(0, 4)).tolist())
    return tuple(np.exp(rng.normal(0.0, 1.0, n_robots)).tolist())


def _value(name: str, value: Any, fields: Mapping[str, Any], rng: np.random.Generator) -> Any:
    kind = field_kinds()[name]
    if name in NAMES:
        return NAMES[name][rng.integers(len(NAMES[name]))]
    if kind not in {bool, int, float}:
        return _tuple_of(name, fields["n_robots"], fields["size_m"], rng)
    if kind is not bool and limits(name) and rng.random() < AT_A_LIMIT:
        return kind(rng.choice(limits(name)))
    return _number(value, rng) if kind is float else _count(name, rng)


def _count(name: str, rng: np.random.Generator) -> int | bool:
    """A number of things, or whether."""
    if name in CHEAP:
        return int(rng.integers(*CHEAP[name], endpoint=True))
    if field_kinds()[name] is bool:
        return bool(rng.integers(2))
    return int(rng.choice([0, 1, 2, 3, 5, 7, 100, 10**6, 10**400 % 10**30]))


def drawn_fields(seed: int) -> dict[str, Any]:
    """A third of all fields with other values; team and room are always drawn."""
    rng = np.random.default_rng(seed)
    rows = {row.name: row.value for row in field_rows(SCENARIOS["paper-hw-2"])}
    out: dict[str, Any] = {"n_robots": int(rng.integers(2, 7)), "size_m": float(rng.choice(SIZES_M))}
    for name, value in rows.items():
        if name not in out and rng.random() < 0.3:
            out[name] = _value(name, value, out, rng)
    return out


def _made(fields: dict[str, Any], rng: np.random.Generator) -> Scenario | None:
    """The scenario with as many of the fields as go together; those that are refused are left out."""
    scenario, order = SCENARIOS["paper-hw-2"], list(fields)
    try:
        first = {name: fields[name] for name in ("n_robots", "size_m")}
        scenario = scenario.with_overrides(**first)
    except ValueError:
        return None
    for k in rng.permutation(len(order)).tolist():
        try:
            scenario = scenario.with_overrides(**{order[k]: fields[order[k]]})
        except ValueError:
            continue
    return scenario


def _drive(env: RendezvousEnv, rng: np.random.Generator) -> Callable[[Mapping[str, Any]], dict[str, Any]]:
    """Actions at random, or those of the active policy."""
    if rng.random() < 0.5:
        policy = make_policy("active", env.scenario)
        policy.reset(int(rng.integers(1000)))
        return policy.act
    return lambda seen: {agent: rng.uniform(-1.0, 1.0, 3) for agent in env.agents}


def _finite(value: Any) -> bool:
    if isinstance(value, dict):
        return all(map(_finite, value.values()))
    return bool(np.isfinite(np.asarray(value, dtype=float)).all())


def _faults(scenario: Scenario, rng: np.random.Generator, n_steps: int) -> list[str]:
    """What is wrong with a few steps of an episode."""
    found, env = [], parallel_env(scenario)
    begin = time.process_time()
    try:
        seen, infos = env.reset(seed=int(rng.integers(2**31)))
    except ValueError:
        return []  # a room that does not hold what was asked for
    act = _drive(env, rng)
    for t in range(n_steps):
        if not all(env.observation_space(agent).contains(seen[agent]) for agent in seen):
            found.append(f"iteration {t}: an observation outside its space")
        if not _finite(infos) or not np.isfinite(env.state()).all():
            found.append(f"iteration {t}: an info or the state that is not finite")
        if (spent_s := time.process_time() - begin) > LONGEST_S:
            found.append(f"iteration {t}: {spent_s:.0f} s")
        if not env.agents:
            break
        begin = time.process_time()
        seen, rewards, _, _, infos = env.step(act(seen))
        if not _finite(rewards):
            found.append(f"iteration {t + 1}: a reward that is not finite")
    return found


def escaped(seed: int, *, n_steps: int = 5) -> list[str]:
    """What of one scenario is not as it should be, with what makes it again."""
    rng, fields = np.random.default_rng((seed, 1)), drawn_fields(seed)
    try:
        scenario = _made(fields, rng)
        found = [] if scenario is None else _faults(scenario, rng, n_steps)
    except Exception as problem:
        place = traceback.extract_tb(problem.__traceback__)[-1]
        where = f"{place.filename.rsplit('/', 1)[-1]}:{place.lineno}"
        found = [f"{type(problem).__name__} at {where}: {str(problem)[:200]}"]
    return [f"seed {seed}: {fault}" for fault in found]


def main() -> None:
    """Try scenarios one after the other and print what escaped.

    Raises:
        DoubtfulError: Something did.
    """
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenarios", type=int, default=500)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    warnings.simplefilter("error")
    n_bad = 0
    for seed in range(given.seed, given.seed + given.scenarios):
        faults = escaped(seed)
        n_bad += bool(faults)
        for fault in faults:
            print(fault, flush=True)
    print(f"{given.scenarios} scenarios, {n_bad} escaped")
    if n_bad:
        raise DoubtfulError(f"{n_bad} of {given.scenarios} scenarios escaped")


if __name__ == "__main__":
    sys.exit(exit_code(main))
