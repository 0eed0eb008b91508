"""A vehicle without tyres, driven by measured forces and moments at its wheel hubs: six components per hub."""

ENGINES = ("reference", "exudyn", "mujoco")
ON_REQUEST = ("plain",)
"""Engines that run only where the user names them: the independent reference "plain". It shares no force with the three
others, and takes seconds for every second of a run.
"""
NO_PRICE = 'takes whole parts of its samples for steps, the longest of which a choice, study = "choice", finds'
"""Reason why `twinrig price` does not apply to scenes of hub forces, and what to use instead."""
