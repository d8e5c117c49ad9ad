"""Learned policies on the same environment."""
