"""MUSIC over subcarriers (Schmidt 1986): directions that lie in the signal subspace."""

import numpy as np
from jaxtyping import Complex, Float, Int

from wifipgo.arithmetic import harmless_underflow
from wifipgo.errors import BadInputError, require
from wifipgo.radio.aoa.bartlett import bartlett_profiles


def signal_subspace(
    snapshots: Complex[np.ndarray, "links snapshots positions"], *, n_paths: int, fewer: bool = False
) -> Complex[np.ndarray, "links n_paths positions"]:
    """Orthonormal eigenvectors of the largest eigenvalues of ``R = sum_s z_s z_s^H``, as rows.

    Worked out from the Gram matrix of the snapshots, which has the same eigenvalues other
    than 0. A link that heard nothing has a basis of zeros.

    Args:
        snapshots: One vector over positions for each subcarrier.
        n_paths: Size of the signal subspace.
        fewer: What to do with a link whose R has too small a rank: take as many eigenvectors as it has
            and as leave something to tell them from, with rows of zeros before them, or refuse it.

    Raises:
        ValueError: Without ``fewer``, if R has no rank for it: more than one eigenvector takes a rank
            of more than ``n_paths``, or signal cannot be told from noise. Eq. 5 as printed has rank
            one, so nothing but ``n_paths = 1`` is defined there.
    """
    most = min(snapshots.shape[1:])
    require(n_paths == 1 or 1 <= n_paths < most, "n_paths", f"1, or in 1..{most - 1}", n_paths)
    wide = snapshots.astype(np.complex128)
    values, vectors = np.linalg.eigh(wide @ wide.conj().swapaxes(1, 2))
    size = _rank(values, snapshots)
    if fewer:
        size = np.minimum(size, np.count_nonzero(snapshots.any(axis=1), axis=1) - 1)
    else:
        _check_rank(size, n_paths)
        size = np.where(size > 0, n_paths, 0)
    chosen = vectors[:, :, -n_paths:].conj().swapaxes(1, 2) @ wide
    length = np.sqrt(np.maximum(values[:, -n_paths:], np.finfo(float).tiny))
    there = np.arange(n_paths, 0, -1) <= size[:, None]  # eigenvalues ascend
    basis = np.where(there[:, :, None], chosen / length[:, :, None], 0.0)
    return basis.astype(np.complex64)


def _rank(
    values: Float[np.ndarray, "links snapshots"], snapshots: Complex[np.ndarray, "links snapshots positions"]
) -> Int[np.ndarray, " links"]:
    """Eigenvalues above what rounding of the input leaves, as `numpy.linalg.matrix_rank` counts."""
    rounding = max(snapshots.shape[1:]) * np.finfo(snapshots.dtype).eps
    floor = np.maximum(values[:, -1:] * rounding**2, 30.0 * np.finfo(float).eps * values[:, -1:])
    return np.count_nonzero(values > np.maximum(floor, np.finfo(float).tiny), axis=1)


def _check_rank(rank: Int[np.ndarray, " links"], n_paths: int) -> None:
    """Refuse a subspace that is not defined, naming the first link."""
    short = (rank > 0) & (rank <= n_paths) & (n_paths > 1)
    if short.any():
        link = int(short.argmax())
        raise BadInputError(
            f"n_paths must be 1 or less than the rank of the covariance, "
            f"got {n_paths} at rank {rank[link]} of link {link}"
        )


@harmless_underflow
def music_profiles(
    snapshots: Complex[np.ndarray, "links snapshots positions"],
    steering: Complex[np.ndarray, "positions grid"],
    *,
    n_paths: int,
    fewer: bool = False,
) -> Float[np.ndarray, "links grid"]:
    """Share of each direction's steering vector that lies in the signal subspace, in [0, 1].

    ``g = sum_k |u_k^H a|^2 / n``. The spectrum of MUSIC is ``1 / sum_noise |e^H a|^2 =
    1 / (n (1 - g))``, a monotone map (`wifipgo.radio.aoa.bartlett.eq5_profiles`), so the peaks are
    the same; with one snapshot and one path g is the Bartlett profile.

    Args:
        snapshots: One vector over positions for each subcarrier.
        steering: Phase factors, one column per direction.
        n_paths: Size of the signal subspace.
        fewer: As in `signal_subspace`.

    Raises:
        ValueError: As `signal_subspace`.
    """
    basis = signal_subspace(snapshots, n_paths=n_paths, fewer=fewer)
    share = bartlett_profiles(basis.reshape(-1, basis.shape[-1]), steering)
    return np.minimum(share.reshape(*basis.shape[:2], steering.shape[1]).sum(axis=1), 1.0)
