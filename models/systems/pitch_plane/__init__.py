"""The pitch-plane vehicle: four coordinates, on a road or driven by measured wheel forces."""

ENGINES = ("reference", "exudyn", "mujoco")
