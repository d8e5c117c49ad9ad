"""Pose graphs and trajectories as files: g2o, TUM, KITTI."""
