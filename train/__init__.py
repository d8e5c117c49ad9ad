"""Training of learned policies on the same environment; nothing here yet."""
