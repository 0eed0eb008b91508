"""Rolling contact: forces, pressures and slip of two elastic bodies where they touch and roll.

Axes
    x in the direction of rolling, z from the wheel (body 1) into the rail (body 2), y to the right of x.
    The leading edge of a contact area is at its largest x.
Motion
    Creepages ``xi_x``, ``xi_y`` (dimensionless) and spin ``spin`` (1/m) are the velocity of the wheel relative to the
    rail, divided by the rolling speed. The rigid slip at a point is (xi_x - spin y, xi_y + spin x).
Forces
    Act on the wheel: ``fx`` opposes ``xi_x``. Pressure and load are positive in compression; ``mz`` is the moment of
    the tractions about the z axis through the centre of contact, the integral of x p_y - y p_x.
Geometry
    ``a`` is the semi-axis of an ellipse along x, ``b`` along y. The undeformed distance of two bodies in touch is
    A x^2 + B y^2 with A = (1/R_x1 + 1/R_x2) / 2 and B likewise, radii positive for convex bodies.
Units
    SI: m, N, Pa, rad.
"""
