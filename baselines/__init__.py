"""Floor: baselines."""
