"""What guards an optimisation against outliers: weights by direction, PCM, the table of methods."""
