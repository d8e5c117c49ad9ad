"""The figures that there are."""

from collections.abc import Mapping
from types import MappingProxyType, ModuleType

from baselines.reproduce import (
    fig2,
    fig5,
    fig7,
    fig8,
    fig9,
    fig10,
    fig10_literal,
    fig_radio,
    real,
    sensitivity,
)
from wifipgo.errors import BadInputError, UnknownNameError

# Each has a TITLE, tasks(setting) and make(setting, folder).
FIGURES: Mapping[str, ModuleType] = MappingProxyType(
    {
        "fig2": fig2,
        "fig5": fig5,
        "fig7": fig7,
        "fig8": fig8,
        "fig9": fig9,
        "fig10": fig10,
        "fig10_literal": fig10_literal,
    }
)
# Beside the paper's figures, and not part of all; each has a page(folder, run, picture).
STUDIES: Mapping[str, ModuleType] = MappingProxyType(
    {"real": real, "sensitivity": sensitivity, "fig_radio": fig_radio}
)
ALL = "all"  # of the paper's figures
_MEASURE_NOTHING = frozenset({"fig1", "fig3", "fig4", "fig6"})
NOT_REDONE = (
    "Figures 1, 3, 4 and 6 of the paper are not redone: they show the idea (1), the angle of Eq. 8 (3), the "
    "simulator's window (4) and the robots (6), and measure nothing."
)


def chosen(names: tuple[str, ...]) -> list[str]:
    """Figures and studies by name, each once, in the paper's order.

    Raises:
        ValueError: One does not exist, or measures nothing; the message lists those that do.
    """
    names = tuple(name.replace("-", "_") for name in names)
    known = [ALL, *FIGURES, *STUDIES]
    for name in names:
        if name in _MEASURE_NOTHING:
            raise BadInputError(f"figure must be one of {', '.join(known)}, got {name!r}. {NOT_REDONE}")
        if name not in known:
            raise UnknownNameError("figure", name, known)
    figures = [name for name in FIGURES if name in names or ALL in names or not names]
    return figures + [name for name in STUDIES if name in names]
