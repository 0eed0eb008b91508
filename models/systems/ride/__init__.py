"""A vehicle on random roads: exact variances, and runs in time."""

ENGINES = ("reference", "exudyn", "mujoco")
