"""Handling of a road vehicle that is steered, driven and braked on the rolling contacts of its tyres.

Axes of ISO 8855: x forward, y left, z up; the vehicle is that of the ride on a carrier that yaws (see
``models.vehicles.free_vehicle``). Angles are right-handed: steer and yaw to the left are positive, a wheel's
inclination leans its top to the right. Slip is the velocity of the tyre on the road by the speed at which its tread
runs through the contact; forces act on the tyre, so that they oppose it.
"""

ENGINES = ("exudyn", "mujoco")
ON_REQUEST = ("reference",)
"""Engines that run only where the user names them: the independent reference, plain equations that take half a minute
for every second of a manoeuvre.
"""
