"""A braked vehicle with a controller in the loop, in test procedures."""

ENGINES = ("reference", "exudyn", "mujoco")
