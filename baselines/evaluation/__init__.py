"""Episodes played, counted and compared: plans, executors, results, statistics, pictures."""
