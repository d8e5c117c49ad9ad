"""Tables from outside: read whole, or refused in one sentence that names the file."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from wifipgo.errors import BadInputError
from wifipgo.files.parquet_files import read_parquet

TABLE = pd.DataFrame({"agent_steps": np.arange(50), "policy": ["mesh"] * 50, "score": np.linspace(0, 1, 50)})


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(place=st.floats(0.0, 1.0, exclude_max=True), bit=st.integers(0, 7), cut=st.booleans())
def test_a_damaged_table_is_read_or_refused(tmp_path: Path, place: float, bit: int, cut: bool) -> None:
    path = tmp_path / "scores.parquet"
    TABLE.to_parquet(path, index=False)
    content = bytearray(path.read_bytes())
    at = int(place * len(content))
    if cut:
        del content[at:]
    else:
        content[at] ^= 1 << bit
    path.write_bytes(content)
    refused = ""
    try:
        read_parquet(path)
    except BadInputError as problem:
        refused = str(problem)
    assert refused or not cut
    assert not refused or refused.startswith(f"{path} cannot be read, it is no .parquet, damaged or cut: ")


def test_a_table_is_read_as_it_was_written(tmp_path: Path) -> None:
    TABLE.to_parquet(path := tmp_path / "scores.parquet", index=False)
    pd.testing.assert_frame_equal(read_parquet(path, ["score"]), TABLE)
    rule = r"scores\.parquet must be a table with the columns score, seed, got \['agent_steps', 'policy', "
    with pytest.raises(BadInputError, match=rule):
        read_parquet(path, ["score", "seed"])
    with pytest.raises(FileNotFoundError):
        read_parquet(tmp_path / "none.parquet")
