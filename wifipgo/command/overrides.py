"""``--set KEY=VALUE ...`` on a command line, as often as one likes."""

import re
import sys
from collections.abc import Iterable, Sequence
from typing import Annotated

import tyro

Overrides = Annotated[tuple[str, ...], tyro.conf.arg(name="set", metavar="KEY=VALUE ...")]
_AN_OPTION = re.compile(r"--?[A-Za-z]|--$")


def joined(args: Sequence[str] | None = None, options: Iterable[str] = ("--set",)) -> list[str]:
    """Arguments in which an option that takes a list stands once, with all that was given to it.

    The parser would take the last and drop the others without a word.

    Args:
        args: Words of the command line; those of this process if None.
        options: Names of the options, as on the command line.
    """
    words, options = list(sys.argv[1:] if args is None else args), tuple(options)
    kept: list[str] = []
    given: dict[str, list[str]] = {}
    into = kept
    for word in words:
        name, sign, value = word.partition("=")
        if name.replace("_", "-") in options:
            into = given.setdefault(name.replace("_", "-"), [])
            into += [value] if sign else []
            into = kept if sign else into
        else:
            into = kept if _AN_OPTION.match(word) else into
            into.append(word)
    return [*kept, *(word for name, values in given.items() for word in (name, *values))]
