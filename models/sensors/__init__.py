"""Accelerometers and inertial units: what they would read, and the motion that follows from their readings."""
