"""A car of two axles in the plane, driven by the steer angle and the speed that were measured on a real one.

Axes of ISO 8855: x forward, y left, z up; yaw rate, steer angle, lateral acceleration and side slip (atan of lateral by
forward velocity at the centre of mass) are positive to the left. It is quick enough to be fitted to a measurement.
"""

ENGINES: tuple[str, ...] = ()
