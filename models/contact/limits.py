"""Limits of the theories of contact: what an elastic, half-infinite body of dry steel still represents.

Johnson, Contact Mechanics (1985): half-spaces stand for bodies that are large beside the contact (section 4.1); where
the mean pressure is three times the yield stress all around the contact flows (section 6.3), which for rails of 600 MPa
is a largest pressure of 2.7 GPa. Polach, Wear 258 (2005) 992: friction falls with the speed of slip, by a tenth or so
at 1 m/s.
"""

from models.contact.material import Material

HALF_SPACE = 0.3
"""Of a radius of curvature, that a semi-axis of the contact may be."""
YIELDS = 2.7e9
"""Pa, the largest pressure at which rail steel flows."""
STEEL_LIKE = 1e11
"""Young's modulus (Pa) from which on a body is taken for steel, whose yield stress is known."""
SMALL_CREEPAGE = 0.1
"""Creepage, and spin times the longer semi-axis: the theories leave out their squares."""
CONSTANT_FRICTION = 0.05
"""Creepage up to which friction is taken as constant, where no speed is known: 1 m/s of slip at 20 m/s."""
FAST_SLIP = 1.0
"""m/s of slip up to which friction is taken as constant."""
NO_SLIP = 0.5
"""Of mu N: what the linear theory's force may be. Saturated by Shen's cubic it would be a sixth less."""


def yields(*bodies: Material) -> bool:
    """Whether a pressure limit for yielding is known."""
    return all(body.E >= STEEL_LIKE for body in bodies)
