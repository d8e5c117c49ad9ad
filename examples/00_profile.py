"""From a room to a bearing: paths, CSI of two antennas during a quarter turn, profile, peaks.

Writes ``profile.png``. Run: python examples/00_profile.py
"""

from wifipgo.command.figures import Figure

import numpy as np

from wifipgo.radio import aoa
from wifipgo.radio.channel import csi
from wifipgo.radio.channel.csi import RadioConfig
from wifipgo.radio.propagation.materials import Slab
from wifipgo.radio.propagation.paths import surfaces_of, trace_paths
from wifipgo.world.layout import room_walls

radio, turn = RadioConfig(), aoa.AoaConfig()
box = np.array([[3.0, 2.0], [4.0, 2.0], [4.0, 4.5], [3.0, 4.5]])
sender_m, receiver_m, yaw_rad = np.array([[1.0, 3.0]]), np.array([[6.5, 4.0]]), np.array([0.4])

# 1. Which way does the signal go? Line of sight (through the box) and reflections.
scene = surfaces_of(
    room_walls(8.0), [box], carrier_hz=radio.carrier_hz, wall=Slab("brick", 0.1), obstacle=Slab("wood", 0.03)
)
paths = trace_paths(sender_m, receiver_m, scene, carrier_hz=radio.carrier_hz)
for gain, azimuth, order in zip(paths.gain[0], paths.azimuth_rx_rad[0], paths.order[0], strict=True):
    print(f"order {order}: from {np.rad2deg(azimuth):7.1f} deg, {20 * np.log10(abs(gain)):6.1f} dB")

# 2. What do the two antennas receive while the robot turns?
headings = aoa.turn_headings(turn)
channel = csi.pair_csi(
    paths,
    yaw_rad[:, None] + headings,
    antenna_gap_m=turn.antenna_gap_m,
    wavelength_m=radio.wavelength_m,
)
received = csi.received_csi(channel, snr_scale=radio.snr_scale, rng=np.random.default_rng(0))

# 3. Where does it come from, seen from the robot?
grid = aoa.azimuth_grid(turn.n_azimuths)
steering = aoa.turn_steering(
    headings, grid, antenna_gap_m=turn.antenna_gap_m, wavelength_m=radio.wavelength_m
)
profile = aoa.bartlett_profiles(aoa.product_signal(received), steering)
peaks = aoa.find_peaks(profile, n_peaks=2)
truth = np.rad2deg(np.arctan2(*(sender_m - receiver_m)[0, ::-1]) - yaw_rad[0])
print(f"truth {truth % 360:.1f} deg, peaks {np.rad2deg(peaks.azimuth_rad[0]) % 360} deg in the body frame")

figure = Figure(figsize=(5, 5.6), layout="constrained")
# Radial labels where the profile is low.
axes = figure.add_subplot(projection="polar", rlabel_position=truth + 180.0)
axes.plot(grid, profile[0], label="profile: share of power")
axes.axvline(np.deg2rad(truth), color="k", ls="--", label="truth")
axes.set_yticks([0.1, 0.2, 0.3, 0.4])
axes.set_title("Where the signal comes from, body frame")
figure.legend(loc="outside lower center", ncols=2)
figure.savefig("profile.png", dpi=120)
