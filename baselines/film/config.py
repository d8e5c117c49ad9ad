"""The command line of `baselines.watch`, checked."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Annotated

import tyro

from baselines.evaluation.config import SCENARIO
from baselines.evaluation.drivers import try_policy
from baselines.evaluation.episodes import trial_seed
from baselines.film.video import KINDS
from baselines.policies import make_policy
from baselines.policies.registry import specs_of
from baselines.policies.specs import Spec
from envs.render.config import DEFAULT_HEIGHT_PX, RenderConfig
from wifipgo.coerce import settings
from wifipgo.command.extras import find_extra
from wifipgo.command.overrides import Overrides
from wifipgo.errors import require
from wifipgo.files.targets import check_target
from wifipgo.scenarios import Scenario, scenario_named

_RECORDINGS: Mapping[str, str] = MappingProxyType({".rrd": "for the Rerun viewer"})


@dataclass(frozen=True, slots=True, kw_only=True)
class WatchConfig:
    """Film a policy, or record it for the Rerun viewer.

    The film shows the arena with true and estimated trajectories, links, calls, the directions from which
    robots hear their callers, rendezvous, and Err of each robot. It needs the extra video; a recording
    the extra viz. Neither needs a display.

    Example: wifipgo watch --scenario paper-hw-2-obstacles --policy active --seed 3
    --set n_obstacles=6 --out run.mp4
    Example: --policies active,random --fps 10 --out both.gif

    Attributes:
        scenario: Scenario to play, e.g. paper-hw-2, or a file, e.g. room.toml; an unknown one lists those
            that exist.
        policy: Policy; parameters follow a colon: active:err_threshold=0.5. Your own: path/file.py:Class or
            my.module:Class; a trained one: ppo:path=RUN_OR_NPZ; NAME=POLICY gives a name for the film.
        policies: Several instead, separated by commas, side by side in the same world: active,random.
        seed: Seed of the world, its noise and the policy's chance, as in the column seed of an evaluation's
            tables.
        trial: Watch this trial of an evaluation with this seed instead.
        overrides: Other values for fields of the scenario: --set n_obstacles=4 size_m=30.
        out: Film (.mp4, .gif) or, of the last picture only, a still (.png).
        rerun: Recording (.rrd).
        until: Draw no further than this iteration; the episode is played to its end.
        fps: Iterations a second.
        between: Pictures between two iterations of a film, in which robots drive on; fewer where a second
            has no room for them.
        height_px: Height of the pictures, a multiple of 16.
        overwrite: Replace files that are there.
    """

    scenario: Annotated[str | Scenario, SCENARIO] = "paper-hw-2"
    policy: str = "active"
    policies: str = ""
    seed: int = 0
    trial: int | None = None
    overrides: Overrides = ()
    out: Path | None = None
    rerun: Path | None = None
    until: int | None = None
    fps: int = 5
    between: int = 3
    height_px: int = DEFAULT_HEIGHT_PX
    overwrite: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False

    @property
    def world_seed(self) -> int:
        """Seed of the episode."""
        return self.seed if self.trial is None else trial_seed(self.seed, self.trial)

    @property
    def specs(self) -> tuple[Spec, ...]:
        """All that is played."""
        return specs_of(self.policies or [self.policy])

    @property
    def played(self) -> tuple[str, ...]:
        """Labels of all that is played."""
        return tuple(spec.label for spec in self.specs)

    @property
    def caption(self) -> str:
        """Who drives, and with which seed."""
        return f"{', '.join(self.played)}, seed {self.world_seed}"


def checked(config: WatchConfig) -> Scenario:
    """The scenario that a configuration asks for, once everything else of it was found to be possible.

    Raises:
        ValueError: A name that does not exist (the message lists those that do), a value that is refused, or
            a file that cannot be written.
        MissingExtraError: Packages that draw or record are not installed.
    """
    _check_numbers(config)
    require(bool(config.out or config.rerun), "out or rerun", "given, e.g. --out run.mp4", None)
    given = config.scenario
    scenario = given if isinstance(given, Scenario) else scenario_named(given)
    scenario = scenario.with_overrides(**settings(config.overrides))
    for spec in config.specs:
        driver = make_policy(str(spec), scenario, label=spec.label)
        if spec.where:
            try_policy(scenario, driver, config.world_seed)
    if config.out is not None:
        check_target("out", config.out, KINDS, overwrite=config.overwrite)
        find_extra("a film", "video", "pygame", "imageio", "imageio_ffmpeg")
    if config.rerun is not None:
        check_target("rerun", config.rerun, _RECORDINGS, overwrite=config.overwrite)
        find_extra("a recording", "viz", "rerun")
    return scenario


def _check_numbers(config: WatchConfig) -> None:
    """Refuse numbers that cannot mean anything."""
    for name in ("seed", "trial", "until", "between"):
        value = getattr(config, name)
        require(value is None or value >= 0, name, ">= 0", value)
    alone = len(config.played) == 1 or config.rerun is None
    require(alone, "rerun", "of one policy", config.policies)
    require(1 <= config.fps <= 100, "fps", "in 1..100", config.fps)
    RenderConfig(height_px=config.height_px)
