"""A single-track car in the plane, driven by the steer angle and the speed that were measured on a real car.

Axes of ISO 8855: x forward, y left, z up; yaw rate, steer angle, lateral acceleration and side slip (atan of lateral by
forward velocity at the centre of mass) are positive to the left. A run is quick enough to fit the car to a measurement.
"""

ENGINES: tuple[str, ...] = ()
