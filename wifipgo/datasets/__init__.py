"""Public multi-robot data in the library's own types: UTIAS MRCLAM, and the tunnels of Kimera-Multi."""

from wifipgo.datasets.cut_run import cut_run
from wifipgo.datasets.mrclam import read_mrclam
from wifipgo.datasets.team_run import Landmarks, TeamRun, known_ate
from wifipgo.datasets.tunnels import read_tunnels

__all__ = ["Landmarks", "TeamRun", "cut_run", "known_ate", "read_mrclam", "read_tunnels"]
