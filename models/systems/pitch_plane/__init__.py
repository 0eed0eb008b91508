"""The pitch-plane vehicle (two wheels, heave and pitch of the chassis), on a road or driven by
measured wheel forces.
"""

ENGINES = ("reference", "exudyn", "mujoco")
