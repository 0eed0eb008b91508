"""Elastic constants of two bodies in contact, their combined constants, and friction that falls with the speed of slip.

A pair is treated as two bodies of one material with combined constants (Kalker, Three-Dimensional Elastic Bodies in
Rolling Contact, 1990, section 1.7). That is exact for frictionless pressure. With friction it is exact for
quasi-identical bodies alone, those with Kalker's K = 0; otherwise it leaves out the surface strain 2 K p / G by which
the two bodies differ under a pressure p, a slip that nobody prescribed.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from pydantic import Field, ValidationError

from models.core.errors import InputError
from models.core.strict import Strict, input_error_from_faults

LARGEST_MISMATCH = 0.01
"""Largest |K| of a pair that theories without K accept: at mu = 0.3 the forces would be off by 7 % of mu N."""


class Material(Strict):
    """An isotropic elastic material, ``Material(E=2.1e11, nu=0.28)``; raises InputError for impossible constants."""

    E: float = Field(ge=1e6, le=1e13, description="Young's modulus, not in MPa", json_schema_extra={"unit": "Pa"})
    nu: float = Field(ge=0.0, le=0.5, description="Poisson's ratio")

    def __init__(self, **constants: Any) -> None:
        try:
            super().__init__(**constants)
        except ValidationError as error:
            raise input_error_from_faults(error, type(self), "", "material") from None

    @property
    def G(self) -> float:
        """Shear modulus E / (2 (1 + nu)) in Pa."""
        return self.E / (2.0 * (1.0 + self.nu))


STEEL = Material(E=2.1e11, nu=0.28)
"""Steel of wheel and rail as in the Manchester contact benchmark, G = 82 GPa."""


@dataclass(frozen=True)
class MaterialPair:
    """Two bodies in contact, ``wheel`` and ``rail``; a pair of equal materials has the constants of that material."""

    wheel: Material = STEEL
    rail: Material = STEEL

    def __post_init__(self) -> None:
        for name, body in (("wheel", self.wheel), ("rail", self.rail)):
            if not isinstance(body, Material):
                raise InputError("", f"pair.{name}", body, "must be a Material(E=..., nu=...)")

    @cached_property
    def modulus(self) -> float:
        """Contact modulus E* in Pa of normal contact: 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2, which is (1 - nu)/G."""
        return 1.0 / ((1.0 - self.wheel.nu**2) / self.wheel.E + (1.0 - self.rail.nu**2) / self.rail.E)

    @cached_property
    def G(self) -> float:
        """Combined shear modulus in Pa: 1/G = (1/G1 + 1/G2) / 2."""
        return 2.0 / (1.0 / self.wheel.G + 1.0 / self.rail.G)

    @cached_property
    def nu(self) -> float:
        """Combined Poisson's ratio: nu/G = (nu1/G1 + nu2/G2) / 2."""
        return self.G * (self.wheel.nu / self.wheel.G + self.rail.nu / self.rail.G) / 2.0

    @cached_property
    def mismatch(self) -> float:
        """Kalker's mismatch K = G/4 ((1 - 2 nu1)/G1 - (1 - 2 nu2)/G2), zero for equal bodies and for two incompressible
        ones.

        Dundurs' second constant is K / (1 - nu).
        """
        wheel, rail = self.wheel, self.rail
        return self.G / 4.0 * ((1.0 - 2.0 * wheel.nu) / wheel.G - (1.0 - 2.0 * rail.nu) / rail.G)

    def quasi_identity_error(self, friction: float) -> float:
        """Ratio of the force error by neglecting the mismatch K to mu N, at this coefficient of friction: up to 2 |K| /
        mu.

        The mean of the strain 2 K p / G over the patch is a creepage of K N / (pi a b G) on a circle and up to twice
        that on a band, which the linear theory answers with G a b C11 times as much: 1.3 to 2 times K N.
        """
        return 2.0 * abs(self.mismatch) / friction

    def require_likeness(self, file: str = "") -> None:
        """Raise InputError if the materials differ so much that the mismatch K must not be neglected where there is
        friction (see LARGEST_MISMATCH). file : of the scene that names the bodies, for the message.
        """
        if abs(self.mismatch) > LARGEST_MISMATCH:
            raise InputError(
                file,
                "bodies",
                None,
                f"materials too unlike for a theory that takes them as quasi-identical: "
                f"Kalker's K = {self.mismatch:.3g} must be within +-{LARGEST_MISMATCH:g}, or the pressure "
                "makes slip of its own",
            )


class FallingFriction(Strict):
    """[falling_friction]: ``FallingFriction(floor=0.4, decay=0.6, speed=20.0)``, friction that falls with the speed of
    slip.

    mu(s) = mu (floor + (1 - floor) exp(-decay s)), s in m/s: Polach's law (Wear 258 (2005) 992), taken point by point.
    ``fastsim_falling`` computes with it, and is not imported where friction is constant.
    """

    floor: float = Field(
        gt=0.0, le=1.0, description="friction at endless slip by that at none", json_schema_extra={"unit": ""}
    )
    decay: float = Field(ge=0.0, le=1e6, description="of the exponential", json_schema_extra={"unit": "s/m"})
    speed: float = Field(ge=0.0, le=1e4, description="rolling speed", json_schema_extra={"unit": "m/s"})

    @property
    def law(self) -> tuple[float, float]:
        """Parameters of the friction law: floor, and decay per unit of the ratio of slip speed to rolling speed."""
        return self.floor, self.decay * self.speed
