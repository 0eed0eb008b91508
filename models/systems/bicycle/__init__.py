"""A bicycle with a rigid rider, hands off the handlebar (Whipple bicycle). It rides on tyres in the engines, and rolls
without slip in the reference.

Axes of ISO 8855: x forward, y left, z up; lean to the right and steer to the left are positive. Parameters and linear
equations keep to the paper's axes, z down and steer to the right (``models.bicycle.whipple``).
"""

ENGINES = ("exudyn", "mujoco")
ON_REQUEST = ("reference",)
"""Engines that run only where the user names them: the reference, with equations of rolling without slip, the limit of
stiff tyres. It computes for a second for every second of motion.
"""
