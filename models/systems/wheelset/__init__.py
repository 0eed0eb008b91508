"""A wheelset on straight track."""

ENGINES = ("reference", "exudyn", "mujoco")
