"""An engineer's own measurements: files on one clock, checked, run, judged and handed on."""

ENGINES = ("reference", "exudyn", "mujoco")
NO_PRICE = "takes the samples of its files for steps"
"""Why `twinrig price` has nothing to choose, and what there is instead."""
