"""Bounds against the information of the whole model by finite differences."""

from collections.abc import Callable

import numpy as np
import pytest

from wifipgo.radio.aoa import cramer_rao
from wifipgo.radio.aoa.steering import Aperture, moving_antenna, turning_pair

HEADINGS = np.linspace(-1.2, 0.0, 6)
PAIR = turning_pair(HEADINGS, antenna_gap_m=0.22, wavelength_m=0.06)
HELIX = moving_antenna(
    np.stack([0.2 * np.cos(HEADINGS), 0.2 * np.sin(HEADINGS), 0.1 * HEADINGS**2], axis=1), wavelength_m=0.06
)
N_SUBCARRIERS, SNR = 2, 10.0


def inverse_information(mean: Callable[[np.ndarray], np.ndarray], at: np.ndarray) -> float:
    """Bound of the first parameter of a complex Gaussian mean in noise of unit power."""
    step = 1e-6
    slopes = np.stack(
        [(mean(at + step * e) - mean(at - step * e)) / (2.0 * step) for e in np.eye(len(at))], axis=1
    )
    return float(np.linalg.inv(2.0 * (slopes.conj().T @ slopes).real)[0, 0])


def received(
    aperture: Aperture, elevation_rad: float, *, elevation_known: bool
) -> Callable[[np.ndarray], np.ndarray]:
    """CSI of both antennas from azimuth, chain offset, (elevation,) and every amplitude and phase."""
    n = len(aperture.baseline_m)

    def mean(at: np.ndarray) -> np.ndarray:
        azimuth, offset, rest = at[0], at[1], at[2:]
        up = elevation_rad
        if not elevation_known:
            up, rest = rest[0], rest[1:]
        u = np.array([np.cos(up) * np.cos(azimuth), np.cos(up) * np.sin(azimuth), np.sin(up)])
        turn = 2.0 * np.pi / aperture.wavelength_m * (aperture.baseline_m @ u) + offset
        size, phase = rest.reshape(2, n, N_SUBCARRIERS)
        common = size * np.exp(1j * phase)
        return np.concatenate([(common * np.exp(0.5j * s * turn[:, None])).ravel() for s in (1.0, -1.0)])

    return mean


@pytest.mark.parametrize("elevation_known", [True, False])
@pytest.mark.parametrize("elevation_rad", [0.0, 0.4])
@pytest.mark.parametrize("aperture", [PAIR, HELIX], ids=["pair", "helix"])
def test_bound_is_the_inverse_information(
    aperture: Aperture, elevation_rad: float, elevation_known: bool
) -> None:
    """Azimuth in one model with all that is unknown: chain offset, amplitudes, phases, elevation."""
    if not elevation_known and aperture.is_flat and elevation_rad == 0.0:
        pytest.skip("a flat aperture does not feel a small elevation: the information is singular")
    rng = np.random.default_rng(0)
    n = len(HEADINGS) * N_SUBCARRIERS
    nuisance = np.concatenate([np.full(n, np.sqrt(SNR)), rng.uniform(0.0, 6.0, n)])
    known = np.array([0.3, 0.7]) if elevation_known else np.array([0.3, 0.7, elevation_rad])
    expected = inverse_information(
        received(aperture, elevation_rad, elevation_known=elevation_known), np.concatenate([known, nuisance])
    )
    found = cramer_rao.azimuth_bound_rad2(
        aperture,
        known[:1],
        phase_variance_rad2=cramer_rao.phase_variance_rad2(
            SNR, n_subcarriers=N_SUBCARRIERS, random_amplitude=False
        ),
        elevation_rad=elevation_rad,
        elevation_known=elevation_known,
    )
    assert found[0] == pytest.approx(expected, rel=1e-3)


def test_noise_times_noise_is_what_the_product_has() -> None:
    """Variance of the summed product across its mean, relative to its mean: the phase's at first order."""
    rng, snr, n = np.random.default_rng(0), 0.5, 400_000
    noise = (rng.standard_normal((2, n)) + 1j * rng.standard_normal((2, n))) / np.sqrt(2.0 * snr)
    product = (1.0 + noise[0]) * (1.0 + noise[1]).conj()
    expected = cramer_rao.phase_variance_rad2(snr, n_subcarriers=1)
    assert product.imag.var() == pytest.approx(expected, rel=0.02)


def test_a_straight_drive_says_nothing_along_its_line() -> None:
    line = moving_antenna(np.linspace(0.0, 1.0, 9)[:, None] * [1.0, 0.0, 0.0], wavelength_m=0.06)
    bound = cramer_rao.azimuth_bound_rad2(line, np.array([0.0, np.pi, 1.0]), phase_variance_rad2=1.0)
    assert np.isinf(bound[:2]).all()
    assert np.isfinite(bound[2])


def test_an_unknown_elevation_costs_accuracy() -> None:
    bounds = [
        cramer_rao.azimuth_bound_rad2(
            PAIR, np.array([0.3]), phase_variance_rad2=1.0, elevation_rad=0.5, elevation_known=known
        )[0]
        for known in (True, False)
    ]
    assert bounds[0] < bounds[1]


def test_no_signal_is_refused() -> None:
    with pytest.raises(ValueError, match="snr must be >= 1e-09"):
        cramer_rao.phase_variance_rad2(0.0, n_subcarriers=30)
    with pytest.raises(ValueError, match="n_subcarriers must be > 0"):
        cramer_rao.phase_variance_rad2(1.0, n_subcarriers=0)
