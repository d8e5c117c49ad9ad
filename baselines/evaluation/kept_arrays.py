"""Work whose result is arrays in a sealed file of its own."""

from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

import numpy as np

from wifipgo.files.atomic_files import write_sealed
from wifipgo.files.npz_files import read_sealed_npz

Arrays = Mapping[str, np.ndarray]


class KeptArrays:
    """What a piece of work does with its result; who derives from it has a path."""

    __slots__ = ()
    path: Path

    def keep(self, result: Arrays) -> None:
        """Write to a file that is there whole or not at all."""
        np.savez(buffer := BytesIO(), allow_pickle=False, **result)
        write_sealed(self.path, buffer.getvalue())

    def load(self) -> Arrays:
        """Read what `keep` wrote."""
        return read_sealed_npz(self.path)
