"""Braking in the plane: tyres from tables, brakes, wheels that may lock, a truck and its drawbar trailer.

Axes
    ISO 8855. Of the ground: x along the road, y to the left; heading psi from x to y. Of each unit (truck, drawbar,
    trailer body): x forward along it, y to its left, from its centre of mass. Of a wheel: those of its unit, turned
    by its steer angle.
Slip
    u, v: velocity of a wheel's centre along its own x and y. Slip s = (u - r w) / u, 0 of a rolling wheel and 1 of a
    locked one; tan(slip angle) = v / |u|. Backwards everything is mirrored.
Forces
    On the wheel: along x as -sign(u) mu_x F_z for s > 0, along y as -sign(v) mu_y F_z; F_z is the wheel's load.
Brake
    Pressures in bar, as brake engineers have them; torques in N m, never negative: they oppose the wheel's turning.
Order
    Wheels axle by axle from the front, the left one before the right one.
Units
    SI otherwise: m, s, kg, N, rad.
"""
