"""Measured recordings: files brought onto one clock, checked, simulated, judged, and section forces
written to files.
"""

ENGINES = ("reference", "exudyn", "mujoco")
NO_PRICE = "takes the samples of its files for steps"
"""Reason why `twinrig price` does not apply to scenes of recordings."""
