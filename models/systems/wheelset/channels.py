"""What is saved of a path."""

from models.rail import wheel_forces as wf
from models.rail.equations import ROLL, SPIN, YAW, Y, Z

STATES = {"y": (Y, "m"), "z": (Z, "m"), "roll": (ROLL, "rad"), "yaw": (YAW, "rad"), "spin": (SPIN, "rad/s")}
CONTACTS = {
    "normal": (wf.LOAD, "N"),
    "fx": (wf.FX, "N"),
    "fy": (wf.FY, "N"),
    "mz": (wf.MZ, "N m"),
    "power": (wf.POWER, "W"),
}
"""What is saved of every path, with its place and unit."""
