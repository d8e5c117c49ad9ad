"""What robots hear: profiles with packets lost, headings off, other antennas; and no link at all."""

from typing import Any

import numpy as np
import pytest

from wifipgo import se2
from wifipgo.radio import aoa
from wifipgo.radio.channel import rates
from wifipgo.radio.channel.csi import RadioConfig
from wifipgo.radio.channel.impairments import EpisodeImpairments, ImpairmentConfig, draw_episode_impairments
from wifipgo.radio.links import Links, probe_links
from wifipgo.radio.propagation.materials import Slab
from wifipgo.radio.propagation.paths import Surfaces, surfaces_of
from wifipgo.radio.turn_profiles import listen
from wifipgo.scenarios import scenario_named
from wifipgo.world.layout import room_walls

P_M, YAW_RAD = np.array([[2.0, 3.0], [7.0, 6.5], [5.0, 1.5]]), np.array([0.3, -2.0, 1.0])
RECEIVER, SENDER = np.array([0, 0, 1, 2]), np.array([1, 2, 0, 1])
QUIET: dict[str, Any] = {"noise_floor": False, "common_phase": False, "timing_jitter_s": 0.0}
TURN = aoa.AoaConfig()


def scene(*boxes: np.ndarray) -> Surfaces:
    return surfaces_of(
        room_walls(9.0),
        list(boxes),
        carrier_hz=5.0e9,
        wall=Slab("brick", 0.1),
        obstacle=Slab("concrete", 0.2),
    )


def standing(seed: int = 0, **changes: Any) -> EpisodeImpairments:
    cfg = ImpairmentConfig(**changes)
    return draw_episode_impairments(
        cfg, n_robots=3, n_antennas=2, size_m=9.0, rng=np.random.default_rng(seed)
    )


def heard(
    *, radio: RadioConfig | None = None, turn: aoa.AoaConfig = TURN, seed: int = 0, **changes: Any
) -> np.ndarray:
    """Profiles of four links; line of sight only, unless the radio says otherwise."""
    radio, kept = radio or RadioConfig(max_order=0), standing(**changes)
    links = probe_links(P_M, scene(), radio, kept)
    rng = np.random.default_rng(seed)
    return listen(links, RECEIVER, SENDER, YAW_RAD, radio=radio, turn=turn, rng=rng, standing=kept)


def top_rad(profile: np.ndarray) -> np.ndarray:
    return aoa.find_peaks(profile, n_peaks=1).azimuth_rad[:, 0]


def true_rad() -> np.ndarray:
    way_m = P_M[SENDER] - P_M[RECEIVER]
    return np.asarray(se2.wrap_angle(np.arctan2(way_m[:, 1], way_m[:, 0]) - YAW_RAD[RECEIVER]))


def off_deg(estimate_rad: np.ndarray, reference_rad: np.ndarray) -> np.ndarray:
    return np.rad2deg(np.abs(se2.wrap_angle(estimate_rad - reference_rad)))


@pytest.mark.parametrize(
    "antennas_m",
    [
        (),
        ((0.0, 0.11), (0.0, -0.11)),
        ((0.11, 0.0), (-0.11, 0.0), (0.0, 0.1)),
    ],
)
@pytest.mark.parametrize("bandwidth_hz", [20e6, 40e6])
def test_one_path_is_heard_from_where_it_comes(antennas_m: Any, bandwidth_hz: float) -> None:
    radio = RadioConfig(max_order=0, antennas_m=antennas_m, bandwidth_hz=bandwidth_hz)
    profile = heard(radio=radio, **QUIET)
    assert off_deg(top_rad(profile), true_rad()).max() < 0.1
    np.testing.assert_allclose(profile.max(axis=1), 1.0, atol=2e-2)  # the grid may miss the direction
    assert profile.max() <= 1.0


def test_the_pair_given_by_its_places_is_the_default_pair() -> None:
    default = heard(radio=RadioConfig())
    by_place = heard(radio=RadioConfig(antennas_m=((0.11, 0.0), (-0.11, 0.0))))
    np.testing.assert_allclose(by_place, default, atol=2e-3)


@pytest.mark.parametrize("estimator", ["product", "ratio"])
def test_a_profile_is_that_of_the_packets_that_arrive(estimator: str) -> None:
    """Noise-free single path: the share explained is 1 however many are lost."""
    turn = aoa.AoaConfig(aoa_estimator=estimator, n_azimuths=7200)
    all_of_them, half = (heard(turn=turn, packet_loss=p, **QUIET) for p in (0.0, 0.5))
    np.testing.assert_allclose(half.max(axis=1), all_of_them.max(axis=1), atol=1e-4)
    np.testing.assert_allclose(half.max(axis=1), 1.0, atol=1e-4)


@pytest.mark.parametrize("estimator", sorted(aoa.ESTIMATORS))
def test_all_packets_lost_is_a_profile_of_zeros(estimator: str) -> None:
    turn = aoa.AoaConfig(aoa_estimator=estimator)
    assert not heard(turn=turn, packet_loss=1.0).any()
    nearly = heard(turn=turn, packet_loss=0.97)  # two of 64 packets
    assert np.isfinite(nearly).all()
    assert nearly.max() <= 1.0


def no_path_links() -> tuple[Links, RadioConfig]:
    """Boxes that let nothing through around the first robot."""
    lying = np.array([[1.0, 1.0], [3.0, 1.0], [3.0, 1.2], [1.0, 1.2]])
    upright = np.array([[1.0, 1.2], [1.2, 1.2], [1.2, 4.0], [1.0, 4.0]])
    around = [lying, lying + np.array([[0.0, 3.0]]), upright, upright + np.array([[1.8, 0.0]])]
    radio = RadioConfig(penetration=False)
    return probe_links(P_M, scene(*around), radio), radio


def test_no_path_is_no_link_and_never_nan() -> None:
    links, radio = no_path_links()
    assert links.rate_mbit_s[0, 1] == links.rate_mbit_s[0, 2] == 0.0
    assert links.esnr_db[0, 1] == -30.0
    assert links.rate_mbit_s[1, 2] > 0.0
    for estimator in aoa.ESTIMATORS:
        turn, rng = aoa.AoaConfig(aoa_estimator=estimator), np.random.default_rng(0)
        profile = listen(links, RECEIVER, SENDER, YAW_RAD, radio=radio, turn=turn, rng=rng)
        assert not profile[:3].any()
        assert profile[3].max() > 0.3
        assert np.isfinite(profile).all()


def test_a_heading_bias_turns_the_profile_back_by_as_much() -> None:
    """Who really looks further left than he believes finds everything further right."""
    bias_rad = float(np.deg2rad(10.0))
    biased = top_rad(heard(heading_bias_rad=bias_rad, **QUIET))
    assert off_deg(biased, true_rad() - bias_rad).max() < 0.1


def test_a_chain_offset_leaves_the_profile_as_it_is() -> None:
    """One phase on the whole turn: the Bartlett profile does not know it."""
    np.testing.assert_allclose(heard(chain_phase_rad=1.0, **QUIET), heard(**QUIET), atol=1e-5)


def test_multipath_repeats_at_the_same_poses() -> None:
    """Noise off: same poses, same channel and profile, whatever else was drawn; other poses, others."""
    radio, changes = RadioConfig(), QUIET | {"diffuse_ratio": 0.3}
    first, again = heard(radio=radio, seed=0, **changes), heard(radio=radio, seed=7, **changes)
    np.testing.assert_array_equal(first, again)
    links = [probe_links(P_M + shift, scene(), radio, standing(**changes)) for shift in (0.0, 0.0, 0.4)]
    np.testing.assert_array_equal(links[0].esnr_db, links[1].esnr_db)
    assert (links[0].esnr_db != links[2].esnr_db)[~np.eye(3, dtype=bool)].all()


def test_quantised_reports_still_point_there() -> None:
    profile = heard(agc=True, int8=True, heading_noise_rad=0.005)
    assert off_deg(top_rad(profile), true_rad()).max() < 1.0


def test_rates_of_a_strong_link_are_the_tops_of_the_tables() -> None:
    for bandwidth_hz, top in ((20e6, 65.0), (40e6, 135.0)):
        radio = RadioConfig(bandwidth_hz=bandwidth_hz, tx_power_dbm=15.0)
        rate = probe_links(P_M, scene(), radio).rate_mbit_s
        assert (rate[~np.eye(3, dtype=bool)] == top).all()
    assert rates.LinkConfig(q_mbit_s=135.0).q_mbit_s == 135.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"q_mbit_s": 70.0}, r"LinkConfig.q_mbit_s must be <= 65, the top rate of the bandwidth, got 70.0"),
        ({"antennas_m": ((0.0, 0.0),)}, r"RadioConfig.antennas_m must be 2 or 3 positions for a turn, got"),
        ({"packet_loss": 2}, r"ImpairmentConfig.packet_loss must be in 0..1, got 2.0"),
        ({"int8": 1}, r"int8 must be of type bool"),
    ],
)
def test_a_scenario_names_what_it_refuses(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        scenario_named("paper-hw-2", **changes)
    assert scenario_named("paper-hw-2", q_mbit_s=70.0, bandwidth_hz=40e6).link.q_mbit_s == 70.0
