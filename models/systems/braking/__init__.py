"""Braking of a vehicle with an anti-lock controller in the loop, in test procedures."""

ENGINES = ("reference", "exudyn", "mujoco")
