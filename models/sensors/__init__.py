"""Accelerometers and inertial measurement units on a vehicle: simulated readings, and the motion recovered from
readings."""
