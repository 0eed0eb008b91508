"""An engineer's own measurements: files on one clock, checked, run, judged and handed on."""

ENGINES = ("reference", "exudyn", "mujoco")
