"""Whether the error is held at the threshold: on average, nearly always; on our clock, on Algorithm 2's."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import NamedTuple

from baselines.evaluation.episodes import Episode
from baselines.evaluation.intervals import Estimate
from baselines.reproduce import _rules
from baselines.reproduce._claims import BESIDE, HEADLINE, Claim, Found, Sentence, judged, row
from baselines.reproduce._measures import level, share_within

_PASSES = ", read once a pass of Algorithm 2"


class Active(NamedTuple):
    """Episodes of active rendezvous, and the threshold that it is to hold."""

    episodes: Sequence[Episode]
    threshold: float


def held(on_average: Sentence, nearly_always: Sentence, rooms: Mapping[str, Active]) -> list[Claim]:
    """Judge both sentences.

    The highest point of a mean curve would say less the more trials it is a mean of, so it is not used.
    """
    return [
        judged(
            on_average,
            quantity="mean Err after iteration 10, in thresholds",
            rule=_rules.at_most(_rules.HELD),
            found=_on_both_clocks(level, rooms),
        ),
        judged(
            nearly_always,
            quantity="share of robots and iterations after iteration 10 at or below the threshold",
            rule=_rules.no_less(_rules.WITHIN),
            found=_on_both_clocks(share_within, rooms),
        ),
    ]


def _on_both_clocks(measure: Callable[..., Estimate], rooms: Mapping[str, Active]) -> list[Found]:
    """At every iteration, and beside it only where Algorithm 2 reads Err."""
    return [
        row(
            room + words,
            partial(measure, threshold=active.threshold, at_passes=bool(words)),
            active.episodes,
            role=BESIDE if words else HEADLINE,
        )
        for words in ("", _PASSES)
        for room, active in rooms.items()
    ]
