"""Floor: envs."""
