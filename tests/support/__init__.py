"""What tests share: makers of graphs, shapes and recordings, independent answers, readers of the project."""
