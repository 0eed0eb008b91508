"""A vehicle on random roads: exact variances, and runs in time."""

ENGINES = ("reference", "exudyn", "mujoco")
NO_PRICE = "answers by covariances, which have no step; what its effects cost is told by `show SCENE --price`"
"""Why `twinrig price` has nothing to choose, and what there is instead."""
