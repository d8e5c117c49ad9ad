"""Graph wing: pose graphs, their solvers, outliers and metrics."""
