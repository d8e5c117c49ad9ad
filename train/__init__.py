"""Floor: train."""
