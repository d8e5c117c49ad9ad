"""Figures that are measured, not tested: speed, and comparisons with others."""
