"""Ride of a vehicle on random roads: exact variances of its outputs, or runs in time where it is nonlinear."""

ENGINES = ("reference", "exudyn", "mujoco")
NO_PRICE = "answers by covariances, which have no step; what its effects cost is told by `show SCENE --price`"
"""Reason why `twinrig price` does not apply to scenes of ride, and what to use instead."""
