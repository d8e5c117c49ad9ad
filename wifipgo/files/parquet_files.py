"""Tables of results (.parquet) from outside."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd
from pyarrow import ArrowException

from wifipgo.errors import BadInputError, require

_BROKEN = (
    ArrowException,
    KeyError,
    OSError,  # a page that cannot be unpacked
    OverflowError,
    TypeError,
    ValueError,
)


def read_parquet(path: Path, columns: Sequence[str] = ()) -> pd.DataFrame:
    """Read a table.

    Args:
        path: File.
        columns: Those that it must have; others are read, too.

    Raises:
        BadInputError: No such table, damaged, cut, or a column is missing; names the file.
        OSError: It cannot be opened.
    """
    with path.open("rb") as file:
        try:
            table = pd.read_parquet(file)
        except _BROKEN as problem:
            why = str(problem).partition("\n")[0] or type(problem).__name__
            what = "cannot be read, it is no .parquet, damaged or cut"
            raise BadInputError(f"{path} {what}: {why}") from problem
    missing = [name for name in columns if name not in table]
    rule = f"a table with the columns {', '.join(columns)}"
    require(not missing, str(path), rule, list(table.columns))
    return table
