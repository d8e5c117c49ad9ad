"""Former names, for one version: asking for one warns, and gives what it is now.

Modules have names in `FORMER`; names that left a package's face, or have another name since, in `LEFT`.
"""

import importlib
import sys
import warnings
from collections.abc import Callable, Iterable, Mapping
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
        "wifipgo.processes": "wifipgo.command.processes",
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
        "wifipgo.whole_files": "wifipgo.files.atomic_files",
        "wifipgo.world.maps": "wifipgo.world.map_checks",
    }
)

LEFT: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        "wifipgo": {
            "AoaConfig": "wifipgo.radio.aoa.estimators:AoaConfig",
            "RecordingError": "wifipgo.errors:RecordingError",
            "UnknownNameError": "wifipgo.errors:UnknownNameError",
            "bartlett_profiles": "wifipgo.radio.aoa.bartlett:bartlett_profiles",
            "find_peaks": "wifipgo.radio.aoa.peaks:find_peaks",
            "surfaces_of": "wifipgo.radio.propagation.surfaces:surfaces_of",
            "trace_paths": "wifipgo.radio.propagation.paths:trace_paths",
        },
        "wifipgo.graph": {
            "ERR_WEIGHTS": "wifipgo.graph.metrics:ERR_WEIGHTS",
            "GUARDS": "wifipgo.graph.outliers.methods:OUTLIER_METHODS",
            "NO_PINGS": "wifipgo.graph.anchor_bearings:NO_PINGS",
            "THIRD_PARTY": "wifipgo.graph.solvers:THIRD_PARTY",
            "TOLD_SIGMA": "wifipgo.graph.solvers:REPORTED_SIGMA",
            "Bearings": "wifipgo.graph.bearings:Bearings",
            "Channel": "wifipgo.graph.distributed:Channel",
            "DistributedReport": "wifipgo.graph.distributed:DistributedReport",
            "Guard": "wifipgo.graph.outliers.methods:OutlierMethod",
            "Learned": "wifipgo.graph.solvers:SmootherResult",
            "News": "wifipgo.graph.solvers:SmootherUpdate",
            "Pings": "wifipgo.graph.anchor_bearings:Pings",
            "Report": "wifipgo.graph.solvers:Report",
            "Smoothers": "wifipgo.graph.solvers:IncrementalSmoothers",
            "WeighedDown": "wifipgo.graph.solvers:Downweighted",
            "anchors": "wifipgo.graph.subgraphs:anchors",
            "appended": "wifipgo.graph.subgraphs:appended",
            "bearing": "wifipgo.graph.outliers.aoa_weights:bearing",
            "components": "wifipgo.graph.subgraphs:components",
            "dead_reckoned": "wifipgo.graph.covariance:propagate_covariance",
            "direction_weights": "wifipgo.graph.outliers.methods:direction_weights",
            "end_covariances": "wifipgo.graph.solvers:last_pose_covariances",
            "extended_bearings": "wifipgo.graph.bearings:extended_bearings",
            "extended_pings": "wifipgo.graph.anchor_bearings:extended_pings",
            "from_team": "wifipgo.graph.subgraphs:from_team",
            "odometry": "wifipgo.graph.solvers:odometry",
            "of_robots": "wifipgo.graph.subgraphs:of_robots",
            "paper_weights": "wifipgo.graph.outliers.aoa_weights:paper_weights",
            "retold": "wifipgo.graph.edges:refresh_reported",
            "select": "wifipgo.graph.edges:select",
            "select_bearings": "wifipgo.graph.bearings:select_bearings",
            "select_pings": "wifipgo.graph.anchor_bearings:select_pings",
            "solve_by_robots": "wifipgo.graph.distributed.simulated_team:solve_by_robots",
            "solve_guarded": "wifipgo.graph.outliers.methods:solve_robust",
            "solve_team": "wifipgo.graph.solvers:solve_team",
        },
        "wifipgo.graph.files": {
            "Reading": "wifipgo.graph.files.g2o:Reading",
            "read_g2o": "wifipgo.graph.files.g2o:read_g2o",
            "symbols": "wifipgo.graph.files.g2o:symbols",
            "write_g2o": "wifipgo.graph.files.g2o:write_g2o",
        },
        "wifipgo.graph.outliers": {
            "PAPER_GATE_RAD": "wifipgo.graph.outliers.aoa_weights:PAPER_GATE_RAD",
            "PAPER_SIGMA_RAD": "wifipgo.graph.outliers.aoa_weights:PAPER_SIGMA_RAD",
            "bearing": "wifipgo.graph.outliers.aoa_weights:bearing",
            "elevation": "wifipgo.graph.outliers.aoa_weights:elevation",
            "likelihood": "wifipgo.graph.outliers.aoa_weights:likelihood",
            "paper_weights": "wifipgo.graph.outliers.aoa_weights:paper_weights",
            "range_aware_weights": "wifipgo.graph.outliers.aoa_weights:range_aware_weights",
        },
        "wifipgo.graph.solvers": {
            "Learned": "wifipgo.graph.solvers:SmootherResult",
            "News": "wifipgo.graph.solvers:SmootherUpdate",
            "Smoothers": "wifipgo.graph.solvers:IncrementalSmoothers",
            "TOLD_SIGMA": "wifipgo.graph.solvers:REPORTED_SIGMA",
            "WeighedDown": "wifipgo.graph.solvers:Downweighted",
            "end_covariances": "wifipgo.graph.solvers:last_pose_covariances",
        },
    }
)


class FormerNames(MetaPathFinder, Loader):
    """Finds modules by the names that they had."""

    def __init__(self) -> None:
        """Nothing was asked for yet."""
        self._specs: dict[str, ModuleSpec | None] = {}

    def find_spec(
        self, fullname: str, path: Iterable[str] | None = None, target: ModuleType | None = None
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


def of_face(face: str) -> Callable[[str], object]:
    """``__getattr__`` of a package: names that left it, from where they are now."""

    def former(name: str) -> object:
        """Warn, and hand out what the name meant."""
        now = LEFT[face].get(name)
        if now is None:
            raise AttributeError(f"module {face!r} has no attribute {name!r}")
        message = f"{face}.{name} is now {now}; the former name goes with the next version"
        warnings.warn(message, DeprecationWarning, stacklevel=2)
        module, _, name_now = now.partition(":")
        found: object = getattr(importlib.import_module(module), name_now)
        return found

    return former
