"""The paper as a library: world, radio and graph, joined by one loop."""
