"""Former names of modules, for one version: importing one warns, and gives the module that it is now."""

import importlib
import sys
import warnings
from collections.abc import Mapping, Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import MappingProxyType, ModuleType

FORMER: Mapping[str, str] = MappingProxyType(
    {
        "wifipgo.chance": "wifipgo.streams",
        "wifipgo.drift": "wifipgo.graph.covariance",
        "wifipgo.every_step": "wifipgo.graph.per_robot_smoothing",
        "wifipgo.graph.by_robots": "wifipgo.graph.distributed.simulated_team",
        "wifipgo.graph.consistency": "wifipgo.graph.outliers.pcm",
        "wifipgo.graph.growth": "wifipgo.graph.covariance",
        "wifipgo.graph.keyed": "wifipgo.graph.posegraph",
        "wifipgo.graph.parts": "wifipgo.graph.subgraphs",
        "wifipgo.graph.pcm": "wifipgo.graph.outliers.pcm",
        "wifipgo.graph.pings": "wifipgo.graph.anchor_bearings",
        "wifipgo.graph.reweighted": "wifipgo.graph.distributed.robust",
        "wifipgo.graph.robust": "wifipgo.graph.outliers.methods",
        "wifipgo.graph.solvers.ends": "wifipgo.graph.solvers.marginals",
        "wifipgo.graph.trajectories": "wifipgo.graph.files.tum_kitti",
        "wifipgo.listening": "wifipgo.loop.aoa_measurements",
        "wifipgo.mapped": "wifipgo.world.map_accuracy",
        "wifipgo.meetings": "wifipgo.loop.exchange",
        "wifipgo.radio.aperture": "wifipgo.radio.aoa.moving_aperture",
        "wifipgo.radio.bands": "wifipgo.radio.channel.bands",
        "wifipgo.radio.bartlett": "wifipgo.radio.aoa.bartlett",
        "wifipgo.radio.confidence": "wifipgo.radio.aoa.confidence",
        "wifipgo.radio.csi": "wifipgo.radio.channel.csi",
        "wifipgo.radio.diffuse": "wifipgo.radio.propagation.diffuse_scattering",
        "wifipgo.radio.expected_error": "wifipgo.radio.aoa.confidence",
        "wifipgo.radio.hearing": "wifipgo.radio.turn_profiles",
        "wifipgo.radio.images": "wifipgo.radio.propagation.image_method",
        "wifipgo.radio.impairments": "wifipgo.radio.channel.impairments",
        "wifipgo.radio.intel5300": "wifipgo.radio.recordings.intel5300",
        "wifipgo.radio.link": "wifipgo.radio.channel.rates",
        "wifipgo.radio.materials": "wifipgo.radio.propagation.materials",
        "wifipgo.radio.music": "wifipgo.radio.aoa.music",
        "wifipgo.radio.obstruction": "wifipgo.radio.propagation.obstruction",
        "wifipgo.radio.outline": "wifipgo.radio.propagation.outline",
        "wifipgo.radio.paths": "wifipgo.radio.propagation.paths",
        "wifipgo.radio.peaks": "wifipgo.radio.aoa.peaks",
        "wifipgo.radio.receiver": "wifipgo.radio.channel.receiver",
        "wifipgo.radio.steering": "wifipgo.radio.aoa.steering",
        "wifipgo.radio.surfaces": "wifipgo.radio.propagation.surfaces",
        "wifipgo.radio.theory": "wifipgo.radio.aoa.cramer_rao",
        "wifipgo.radio.visibility": "wifipgo.radio.propagation.face_pairs",
        "wifipgo.radio.wsr": "wifipgo.radio.recordings.wsr_dataset",
        "wifipgo.scenario_fields": "wifipgo.scenarios.field_table",
        "wifipgo.scenario_files": "wifipgo.scenarios.toml_files",
        "wifipgo.settings": "wifipgo.coerce",
        "wifipgo.stocktaking": "wifipgo.loop.uncertainty",
        "wifipgo.survey": "wifipgo.world.coverage_belief",
        "wifipgo.whole_files": "wifipgo.atomic_files",
        "wifipgo.world.maps": "wifipgo.world.map_checks",
    }
)


class FormerNames(MetaPathFinder, Loader):
    """Finds modules by the names that they had."""

    def __init__(self) -> None:
        """Nothing was asked for yet."""
        self._specs: dict[str, ModuleSpec | None] = {}

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Claim former names, and nothing else."""
        return ModuleSpec(fullname, self) if fullname in FORMER else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Warn, and hand out the module as it is now."""
        now = FORMER[spec.name]
        message = f"{spec.name} is now {now}; the former name goes with the next version"
        warnings.warn(message, DeprecationWarning, stacklevel=2)
        module = importlib.import_module(now)
        self._specs[spec.name] = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Give the module back its own spec, which the import has just replaced; it ran already."""
        former = module.__spec__
        if former is not None:
            module.__spec__ = self._specs.pop(former.name)


def answer_to_former_names() -> None:
    """Let imports by former names work from now on."""
    if not any(isinstance(finder, FormerNames) for finder in sys.meta_path):
        sys.meta_path.append(FormerNames())
