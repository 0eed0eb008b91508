"""A vehicle cut at its wheels and driven by the forces that were measured there: six components per hub."""

ENGINES = ("reference", "exudyn", "mujoco")
ON_REQUEST = ("plain",)
"""The independent reference: it shares no force with the three others, and takes seconds for every second of a run."""
NO_PRICE = 'takes whole parts of its samples for steps, the longest of which a choice, study = "choice", finds'
"""Why `twinrig price` has nothing to choose, and what there is instead."""
