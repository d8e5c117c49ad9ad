"""Pose graphs and trajectories as files: g2o, TUM, KITTI."""

from typing import TYPE_CHECKING

from wifipgo.former_names import of_face

if not TYPE_CHECKING:
    __getattr__ = of_face(__name__)
