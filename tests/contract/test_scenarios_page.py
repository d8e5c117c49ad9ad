"""The files that docs/scenarios.md shows are scenarios, and make the rooms that it says they make."""

import re
from pathlib import Path

import numpy as np
import pytest

from envs.rendezvous_v0 import parallel_env

PAGE = (Path(__file__).parents[2] / "docs" / "scenarios.md").read_text(encoding="utf-8")
FILES = dict(re.findall(r"```toml\n# (\S+\.toml)\n(.*?)```", PAGE, re.DOTALL))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, text in FILES.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize("name", FILES)
def test_a_file_of_the_page_is_played(name: str, folder: Path) -> None:
    env = parallel_env(scenario=str(folder / name))
    env.reset(seed=0)
    for _ in range(3):
        env.step({agent: env.action_space(agent).sample() for agent in env.agents})


def test_every_file_of_the_page_has_a_name() -> None:
    assert len(FILES) == PAGE.count("```toml") == 3


@pytest.mark.parametrize(("name", "n_floor"), [("corridor.toml", 20 * 8), ("ell.toml", 20 * 8 + 8 * 12)])
def test_rooms_that_are_not_square(name: str, n_floor: int, folder: Path) -> None:
    """The floor to see is what is left, and nobody starts or drives anywhere else."""
    env = parallel_env(scenario=str(folder / name), n_robots=6, n_steps=20)
    env.reset(seed=0)
    free = env.tick.truth.cells.free[0]
    assert np.count_nonzero(free) == n_floor
    rng = np.random.default_rng(0)
    while env.agents:
        env.step({agent: rng.choice([-1.0, 1.0], 3) for agent in env.agents})
    x, y = np.floor(env.tick.truth.poses[:, :, :2]).astype(int).reshape(-1, 2).T
    assert free[x, y].all()
