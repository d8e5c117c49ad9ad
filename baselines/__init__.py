"""Scripted policies, and the program that compares them: ``python -m baselines.evaluate``."""
