"""An axis on which rows stand set by set."""

from collections.abc import Sequence

from wifipgo.command.figures import Axes

import numpy as np

from wifipgo.command.palette import FRAME


def name_sets(axes: Axes, names: Sequence[str]) -> None:
    """Part the links of each set from the next, and name it under its middle."""
    begins = [k for k in range(len(names)) if k == 0 or names[k] != names[k - 1]]
    ends = [*begins[1:], len(names)]
    for begin in begins[1:]:
        axes.axvline(begin - 0.5, color=FRAME, lw=1.0)
    middles = 0.5 * (np.array(begins) + np.array(ends) - 1)
    labels = [f"{names[begin]}\n{end - begin} links" for begin, end in zip(begins, ends, strict=True)]
    axes.set_xticks(middles, labels)
    axes.set_xlabel("link, by set of recordings")
