"""Whether arrays from a file can take the place of those that are there."""

from collections.abc import Mapping

import numpy as np

from wifipgo.errors import require


def require_alike(arrays: Mapping[str, np.ndarray], present: Mapping[str, np.ndarray], where: str) -> None:
    """Refuse arrays that are missing, or of another shape or type than the present ones, or not finite.

    Args:
        arrays: What a file holds; more than is present will do.
        present: What is to be replaced.
        where: What messages call the file.

    Raises:
        BadInputError: Names the file, the array and what it should be.
    """
    for name, array in present.items():
        require(name in arrays, where, f"with the array {name!r}", sorted(arrays))
        found, what = arrays[name], f"{where}: {name}"
        require(found.shape == array.shape, what, f"of shape {array.shape}", found.shape)
        require(found.dtype == array.dtype, what, f"of type {array.dtype}", found.dtype)
    for name, array in arrays.items():
        finite = array.dtype.kind != "f" or bool(np.isfinite(array).all())
        require(finite, f"{where}: {name}", "finite", "nan or infinity")
