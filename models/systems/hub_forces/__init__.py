"""A vehicle cut at its wheels and driven by the forces that were measured there: six components per hub."""

ENGINES = ("reference", "exudyn", "mujoco")
