"""In a program in which numpy raises at every flag, what underflows in the radio is harmless."""

import numpy as np
import pytest

from wifipgo.radio import aoa
from wifipgo.radio.aoa.confidence import confidence, expected_errors_rad
from wifipgo.radio.channel import rates
from wifipgo.radio.channel.csi import RadioConfig
from wifipgo.radio.channel.impairments import ImpairmentConfig, draw_episode_impairments
from wifipgo.radio.links import probe_links
from wifipgo.radio.propagation.diffuse_scattering import with_diffuse
from wifipgo.radio.propagation.materials import Slab
from wifipgo.radio.propagation.paths import surfaces_of, trace_paths
from wifipgo.radio.turn_profiles import listen
from wifipgo.segments import polygon_edges

ROOM_M = polygon_edges(np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [0.0, 20.0]]))
BOXES_M = [np.array([[x, 1.0], [x + 0.5, 1.0], [x + 0.5, 19.0], [x, 19.0]]) for x in (4.0, 8.0, 12.0)]
P_M = np.array([[2.0, 3.0], [18.0, 6.5], [10.0, 15.0], [3.0, 3.1]])
WALLS = Slab("metal", 5.0)


@pytest.mark.parametrize("estimator", sorted(aoa.ESTIMATORS))
@pytest.mark.parametrize("noise_floor", [True, False])
def test_what_is_too_small_to_tell_from_nothing_is_nothing(estimator: str, noise_floor: bool) -> None:
    """Metal 5 m thick lets e^(-1e6) through; so do narrow clusters and weights of profiles."""
    with np.errstate(all="raise"):
        scene = surfaces_of(ROOM_M, BOXES_M, carrier_hz=5e9, wall=WALLS, obstacle=WALLS)
        radio, rng = RadioConfig(max_order=2), np.random.default_rng(0)
        cfg = ImpairmentConfig(noise_floor=noise_floor, diffuse_ratio=0.1, diffuse_spread_rad=1e-3, agc=True)
        standing = draw_episode_impairments(cfg, n_robots=4, n_antennas=2, size_m=20.0, rng=rng)
        links = probe_links(P_M, scene, radio, standing)
        receiver, sender = np.nonzero(~np.eye(4, dtype=bool))
        turn = aoa.AoaConfig(aoa_estimator=estimator)
        profile = listen(
            links, receiver, sender, np.zeros(4), radio=radio, turn=turn, rng=rng, standing=standing
        )
        paths = trace_paths(P_M[:1], P_M[1:2], scene, carrier_hz=5e9)
        with_diffuse(paths, P_M[:1], P_M[1:2], standing.diffuse, carrier_hz=5e9)  # type: ignore[arg-type]
        confidence(profile), expected_errors_rad(profile, np.zeros(len(profile)))
        expected_errors_rad(np.full((1, 72), 1e-30) ** np.linspace(0.0, 4.0, 72), np.zeros(1))
        (
            rates.rate_and_esnr(np.geomspace(1e-300, 1e300, 30)[None].clip(0.0, 1e30)),
            rates.esnr_db(np.ones((2, 30))),
        )
    assert np.isfinite(profile).all()
