"""How far robots that solve by themselves agree: what each holds of its own poses, and of others'."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wifipgo.graph.chordal import Poses, pose_rows
from wifipgo.graph.distributed.robot import Knowledge
from wifipgo.graph.team_accuracy import shared_variable_error


class Knows(NamedTuple):
    """What a robot knows at the end of a solution.

    Attributes:
        knowledge: What it was given.
        own: Its poses.
        others: Its separators, as it was last told; none if it never got there.
    """

    knowledge: Knowledge
    own: Poses
    others: Poses


def disagreement(held: Sequence[Knows]) -> tuple[float, float]:
    """SVE of the robots, m and rad, see `wifipgo.graph.team_accuracy.shared_variable_error`.

    A robot's last step is not known to those whose turn was before, so robots agree to their threshold.
    """
    told = {one.knowledge.number: one.knowledge.told_to for one in held}
    table: dict[int, dict[tuple[int, int], list[float]]] = {}
    for one in held:
        number, whose = one.knowledge.number, one.knowledge.separator_of
        table[number] = {(number, k): row for k, row in enumerate(pose_rows(one.own).tolist())}
        if len(one.others.R) < len(whose):
            continue
        rows = pose_rows(one.others)
        for other in np.unique(whose).tolist():
            places = told[other][number].tolist()
            theirs = rows[whose == other].tolist()
            table[number] |= {(other, k): row for k, row in zip(places, theirs, strict=True)}
    return shared_variable_error(table)
