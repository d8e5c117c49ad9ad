"""Factorised normal equations; where they are singular, what is best in the least-squares sense."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.sparse import csc_array, csr_array, eye_array
from scipy.sparse.linalg import lsmr, splu

DENSE_UNKNOWNS = 600  # up to so many, a dense factor is faster than a sparse one

Solver = Callable[[Float[np.ndarray, "unknowns c"]], Float[np.ndarray, "unknowns c"]]


def factorised(H: csr_array, ridge: float = 0.0) -> Solver:
    """Solver of (H + ridge I) x = rhs, for H symmetric and positive semidefinite.

    Measurements that differ in their information by more than working precision leave H without
    a factor: then x is the shortest one of least residual. It is nan where H is not finite.
    """
    if not np.isfinite(H.data).all():
        return _nowhere
    n = H.shape[0]
    if n > DENSE_UNKNOWNS:
        return factorised_sparse(csc_array(H) + ridge * eye_array(n, format="csc"))
    dense = H.toarray()
    dense[np.diag_indices(n)] += ridge
    return _dense(dense)


def _dense(H: Float[np.ndarray, "unknowns unknowns"]) -> Solver:
    """Solver by Cholesky, else by singular values."""
    try:
        factor = cho_factor(H, check_finite=False)
    except LinAlgError:
        return lambda rhs: np.linalg.lstsq(H, rhs, rcond=None)[0]
    return lambda rhs: cho_solve(factor, rhs, check_finite=False)


def factorised_sparse(H: csc_array) -> Solver:
    """The same by LU, else by LSMR, column by column, whatever the size."""
    try:
        return splu(csc_array(H)).solve
    except RuntimeError:  # a pivot is exactly zero
        return lambda rhs: np.stack([lsmr(H, column, atol=1e-12, btol=1e-12)[0] for column in rhs.T], axis=1)


def _nowhere(rhs: Float[np.ndarray, "unknowns c"]) -> Float[np.ndarray, "unknowns c"]:
    return np.full_like(rhs, np.nan)
