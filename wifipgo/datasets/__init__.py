"""Public multi-robot data in the library's own types: UTIAS MRCLAM, and the tunnels of Kimera-Multi."""

from wifipgo.datasets.mrclam import read_mrclam
from wifipgo.datasets.team_run import Landmarks, TeamRun, known_ate

__all__ = ["Landmarks", "TeamRun", "known_ate", "read_mrclam"]
