"""The paper's figures and claims, regenerated and judged: ``python -m baselines.reproduce --help``."""
