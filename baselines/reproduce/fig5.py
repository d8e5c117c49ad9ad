"""Fig. 5: fifty robots, mean Err of active and random rendezvous over ten trials."""

from pathlib import Path

from baselines.evaluation.episodes import Episode
from baselines.evaluation.jobs import Task
from baselines.reproduce import _draw, _rules
from baselines.reproduce._claims import BESIDE, HEADLINE, Claim, Sentence, judged, row
from baselines.reproduce._held import Active, held
from baselines.reproduce._measures import err_ratio, late_level, truth_reduction
from baselines.reproduce._runs import TRIALS_MANY, Run, Setting, changed, tasks_of, write_data
from baselines.reproduce._sensitivity import all_runs, sensitivity, sensitivity_runs
from wifipgo.scenarios import Scenario

TITLE = "50 robots: mean Err under active and random rendezvous"
TRIALS = TRIALS_MANY
SCENARIO = changed("paper-sim-50")
HELD = Sentence(
    "fig5.held", "Active rendezvous bounds the mean error of 50 robots at the desired threshold.", "Fig. 5"
)
WITHIN = Sentence(
    "fig5.within", "The same robot by robot: nearly always at or below the threshold.", "Fig. 5"
)
RANDOM = Sentence(
    "fig5.random",
    "Random rendezvous does not hold the threshold in the long run.",
    "Sec. 7.1.2, Fig. 5",
)
RATIO = Sentence(
    "fig5.ratio",
    "Better long-term performance than random rendezvous (no number is given for 50 robots).",
    "Sec. 7.1.2",
)
FACTORS = Sentence(
    "fig5.aoa_factors",
    "Ours, not the paper's: bearings at ping range as factors cut the error without any meeting.",
    "-",
)
SENTENCES = (HELD, WITHIN, RANDOM, RATIO, FACTORS)


def runs() -> dict[str, Run]:
    """Every curve by its label."""
    found = {policy: Run(SCENARIO, policy) for policy in ("active", "random")}
    every = changed(SCENARIO, estimator="every_step")
    found |= {f"{policy}, every step": Run(every, policy) for policy in ("random", "active")}
    found["oracle bearing"] = Run(SCENARIO, "oracle_bearing")
    with_factors = changed(SCENARIO, estimator="every_step", aoa_factors=True)
    found["random, aoa_factors"] = Run(with_factors, "random")
    return found


def tasks(setting: Setting) -> list[Task]:
    """All episodes, those of the sensitivity included."""
    more = all_runs(sensitivity_runs(SCENARIO)) if setting.sensitivity else []
    return tasks_of([*runs().values(), *more], setting)


def make(setting: Setting, folder: Path) -> list[Claim]:
    """Draw, write the data, judge."""
    episodes = _played(setting)
    write_data(folder, episodes)
    _draw_err(folder / "fig5.png", episodes, setting.of(SCENARIO))
    return _judged(episodes, setting)


def claims(setting: Setting) -> list[Claim]:
    """Judge only."""
    return _judged(_played(setting), setting)


def _played(setting: Setting) -> dict[str, list[Episode]]:
    return {label: run.episodes(setting) for label, run in runs().items()}


def _judged(episodes: dict[str, list[Episode]], setting: Setting) -> list[Claim]:
    threshold = setting.of(SCENARIO).rendezvous.err_threshold
    both = held(HELD, WITHIN, {SCENARIO.name: Active(episodes["active"], threshold)})
    return [*both, _random_is_not(episodes, threshold), _ratio(episodes, setting), _bearings(episodes)]


def _draw_err(path: Path, episodes: dict[str, list[Episode]], scenario: Scenario) -> None:
    with _draw.page(path, (6.4, 4.0)) as figure:
        axes = figure.subplots()
        for label in (label for label in episodes if label in _draw.LOOKS):
            _draw.err_curve(axes, episodes[label], label)
        _draw.threshold_line(axes, scenario.rendezvous.err_threshold)
        _draw.err_axes(axes)
        n = len(episodes["active"])
        axes.set_title(f"{scenario.n_robots} robots, {n} trials; bands: 95 % of the mean", loc="left")
        _draw.from_zero(figure)
        _draw.key(figure)


def _random_is_not(episodes: dict[str, list[Episode]], threshold: float) -> Claim:
    return judged(
        RANDOM,
        quantity="mean Err of the last ten iterations, in thresholds",
        rule=_rules.above(_rules.HELD),
        found=[
            row(f"{SCENARIO.name}, {label}", lambda of: late_level(of, threshold), episodes[label], role=role)
            for label, role in (("random", HEADLINE), ("random, every step", BESIDE))
        ],
    )


def _ratio(episodes: dict[str, list[Episode]], setting: Setting) -> Claim:
    pairs = {
        "": ("active", "random", HEADLINE),
        ", random optimises at every step": ("active", "random, every step", BESIDE),
        ", bearings of an oracle": ("oracle bearing", "random", BESIDE),
        ", both optimise at every step": ("active, every step", "random, every step", BESIDE),
    }
    found = [
        row(SCENARIO.name + label, err_ratio, episodes[other], episodes[reference], role=role)
        for label, (reference, other, role) in pairs.items()
    ]
    changes = sensitivity(
        sensitivity_runs(SCENARIO), setting, lambda active, random: err_ratio(random, active)
    )
    return judged(
        RATIO,
        quantity="Err of the last ten iterations, random over active",
        unit="x",
        rule=_rules.above(1.0, "x"),
        goal="at least 4",
        found=[*found, *changes],
    )


def _bearings(episodes: dict[str, list[Episode]]) -> Claim:
    """What bearings at ping range are worth to those who never call (ours)."""
    where = f"{SCENARIO.name}, random, every step, with against without aoa_factors"
    return judged(
        FACTORS,
        quantity="ground-truth error (Eq. 12 + Eq. 13), reduction",
        unit=" %",
        rule=_rules.at_least(50.0, 0.0, " %"),
        goal="at least 50 %",
        found=[row(where, truth_reduction, episodes["random, aoa_factors"], episodes["random, every step"])],
    )
