"""Singular normal equations against the pseudo-inverse, regular ones against the inverse."""

import numpy as np
import pytest
from scipy.sparse import block_diag, csc_array, csr_array

from wifipgo.graph.factorised import DENSE_UNKNOWNS, factorised

RNG = np.random.default_rng(0)
J = RNG.normal(size=(4, 3))
REGULAR = J.T @ J
# The last unknown is in no measurement; of the first two only the sum is measured.
SINGULAR = np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 0.0]])
SIZES = pytest.mark.parametrize("n_blocks", [2, DENSE_UNKNOWNS // 3 + 1], ids=["dense", "sparse"])


@SIZES
@pytest.mark.parametrize("block", [REGULAR, SINGULAR], ids=["regular", "singular"])
def test_shortest_of_the_best(n_blocks: int, block: np.ndarray) -> None:
    rhs = np.tile(block @ RNG.normal(size=(3, 2)), (n_blocks, 1))
    found = factorised(csr_array(block_diag([block] * n_blocks)))(rhs)
    expected = np.linalg.pinv(block) @ rhs[:3]
    np.testing.assert_allclose(found, np.tile(expected, (n_blocks, 1)), atol=1e-8)


@SIZES
def test_what_overflowed_is_no_number(n_blocks: int) -> None:
    H = csc_array(block_diag([REGULAR] * n_blocks))
    H.data[0] = np.inf
    assert np.isnan(factorised(csr_array(H))(np.ones((3 * n_blocks, 1)))).all()
