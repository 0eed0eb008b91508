"""Limits of validity of the contact theories: what an elastic, half-infinite body of dry steel still represents.

Johnson, Contact Mechanics (1985): half-spaces stand for bodies that are large beside the contact (section 4.1); where
the mean pressure is three times the yield stress all around the contact flows (section 6.3), which for rails of 600 MPa
is a largest pressure of 2.7 GPa. Polach, Wear 258 (2005) 992: friction falls with the speed of slip, by a tenth or so
at 1 m/s.
"""

from models.contact.material import Material

LARGEST_AXIS_SHARE = 0.3
"""Ratio of a semi-axis of the contact to a radius of curvature up to which a body counts as a half-space."""
YIELD_PRESSURE = 2.7e9
"""Largest contact pressure (Pa) at which rail steel begins to flow."""
LEAST_STEEL_MODULUS = 1e11
"""Young's modulus (Pa) from which a body is taken for steel, whose yield stress is known."""
SMALL_CREEPAGE = 0.1
"""Creepage, and spin times the longer semi-axis, up to which the theories may neglect their squares."""
CONSTANT_FRICTION = 0.05
"""Creepage up to which friction is taken as constant where no speed is known: 1 m/s of slip at 20 m/s."""
FAST_SLIP = 1.0
"""Speed of slip (m/s) up to which friction is taken as constant."""
LINEAR_FORCE_SHARE = 0.5
"""Ratio of the linear theory's force to mu N up to which this theory is valid. Saturated by Shen's cubic the force
would be a sixth less.
"""


def yield_is_known(*bodies: Material) -> bool:
    """Whether a pressure limit for yielding is known: all bodies are of steel."""
    return all(body.E >= LEAST_STEEL_MODULUS for body in bodies)
