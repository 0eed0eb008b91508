"""A bicycle with a rigid rider, hands off: Whipple's, on tyres in engines, rolling ideally in the reference.

Axes of ISO 8855: x forward, y left, z up; lean to the right and steer to the left are positive. Parameters and linear
equations keep to the paper's axes, z down and steer to the right (``models.bicycle.whipple``).
"""

ENGINES = ("exudyn", "mujoco")
ON_REQUEST = ("reference",)
"""Plain equations with ideal rolling, the limit of stiff tyres; a second for every second of motion."""
