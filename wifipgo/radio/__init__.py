"""Radio wing: paths, CSI, links, angle of arrival, recordings.

From a room to a bearing: `surfaces_of` obstacles, `trace_paths` among them, `pair_csi` of the paths,
`pair_profiles` of the CSI, and `find_peaks` of the profiles.
"""

from wifipgo.radio.aoa.bartlett import bartlett_profiles
from wifipgo.radio.aoa.cramer_rao import azimuth_bound_rad2
from wifipgo.radio.aoa.estimators import ESTIMATORS, AoaConfig, pair_profiles
from wifipgo.radio.aoa.moving_aperture import aperture_bearing
from wifipgo.radio.aoa.peaks import find_peaks
from wifipgo.radio.channel.csi import RadioConfig, pair_csi
from wifipgo.radio.channel.rates import LinkConfig, rate_mbit_s, service_discrepancy
from wifipgo.radio.channel.receiver import received_csi
from wifipgo.radio.propagation.materials import MATERIALS
from wifipgo.radio.propagation.paths import trace_paths
from wifipgo.radio.propagation.surfaces import surfaces_of
from wifipgo.radio.recordings.intel5300 import read_csi_log

__all__ = [
    "ESTIMATORS",
    "MATERIALS",
    "AoaConfig",
    "LinkConfig",
    "RadioConfig",
    "aperture_bearing",
    "azimuth_bound_rad2",
    "bartlett_profiles",
    "find_peaks",
    "pair_csi",
    "pair_profiles",
    "rate_mbit_s",
    "read_csi_log",
    "received_csi",
    "service_discrepancy",
    "surfaces_of",
    "trace_paths",
]
