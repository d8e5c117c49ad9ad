"""World wing: arena, obstacles, what robots sense of it."""
