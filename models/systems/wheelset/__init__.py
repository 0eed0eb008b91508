"""Motion of a railway wheelset on straight track: hunting paths, eigenvalues, limit cycles, equivalent conicity."""

ENGINES = ("reference", "exudyn", "mujoco")
