"""Parameters of a wheelset in its primary suspension on two straight rails: cones on round heads, or profiles."""

from typing import Any

from pydantic import Field, ValidationError, model_validator
from scipy.optimize import brentq

from models.contact.hertz import HertzContact, by_load
from models.contact.material import STEEL, Material, MaterialPair
from models.core.strict import Strict, input_error_from_faults, quantity
from models.rail.laid_profiles import CrossSections

GRAVITY = 9.81
"""Acceleration of gravity (m/s^2)."""
LEAST_CONICITY, LARGEST_CONICITY = 1e-4, 0.5


class Wheelset(Strict):
    """Parameters of a wheelset on its track. Raises InputError for values that no wheelset can have.

    The wheelset turns about its axle, so its inertia about all axes across that is one number. On each side, at
    ``half_spacing`` from the middle, a spring and a damper along each axis of the track hold the axle to a frame that
    moves with the speed. What the frame weighs on the axle is ``load`` less the wheelset's own weight. With profiles,
    half_gauge, conicity, head_radius and the flange's values serve the linear theory alone (``coned``).
    """

    mass: float = quantity("kg", "of the wheelset")
    spin_inertia: float = quantity("kg m^2", "about the axle")
    yaw_inertia: float = quantity("kg m^2", "about every axis across the axle, for yaw and roll")
    radius: float = quantity("m", "of a wheel where it touches in the middle of the track")
    half_gauge: float = quantity("m", "half the distance of the two places of contact")
    conicity: float = Field(ge=LEAST_CONICITY, le=LARGEST_CONICITY, description="tangent of the cone's half angle")
    head_radius: float = quantity("m", "of the rails' heads across the track")
    load: float = quantity("N", "of the wheelset on both rails, its own weight included")
    half_spacing: float = quantity("m", "half the distance of the primary suspension's two sides")
    stiffness_x: float = quantity("N/m", "of one side, along the track", zero=True)
    stiffness_y: float = quantity("N/m", "of one side, across the track", zero=True)
    stiffness_z: float = quantity("N/m", "of one side, vertical", zero=True)
    damping_x: float = quantity("N s/m", "of one side, along the track", zero=True)
    damping_y: float = quantity("N s/m", "of one side, across the track", zero=True)
    damping_z: float = quantity("N s/m", "of one side, vertical", zero=True)
    friction: float = Field(ge=0.0, le=10.0, description="coefficient of friction")
    flange_clearance: float = quantity("m", "way of the wheelset from the middle until a flange touches")
    flange_stiffness: float = quantity("N/m", "lateral, of a flange on its rail", zero=True)
    contact_damping: float = quantity("s/m", "share of the elastic normal force by the speed of approach", zero=True)
    material: Material = STEEL
    profiles: CrossSections | None = Field(default=None, description="cross-sections in place of cones and round heads")

    def __init__(self, **parameters: Any) -> None:
        try:
            super().__init__(**parameters)
        except ValidationError as error:
            raise input_error_from_faults(error, type(self), "", "wheelset") from None

    @model_validator(mode="after")
    def _check_possible(self) -> "Wheelset":
        if self.conicity * self.radius >= self.half_gauge:
            raise ValueError("conicity times radius must be below half_gauge: such cones do not steer")
        if self.mass * GRAVITY > self.load:
            raise ValueError(f"load must be at least the wheelset's own weight, {self.mass * GRAVITY:.6g} N")
        return self

    @property
    def material_pair(self) -> MaterialPair:
        """Materials of wheel and rail, which are equal."""
        return MaterialPair(self.material, self.material)

    @property
    def cone_sine_and_cosine(self) -> tuple[float, float]:
        """Sine and cosine of the cone's half angle."""
        cosine = (1.0 + self.conicity**2) ** -0.5
        return self.conicity * cosine, cosine

    @property
    def roll_per_displacement(self) -> float:
        """Roll to the left per lateral displacement to the right (rad/m), for small displacements."""
        return self.conicity / (self.half_gauge - self.conicity * self.radius)

    @property
    def equivalent_conicity(self) -> float:
        """Change of a wheel's rolling radius per lateral displacement (-), including the effect of roll; exact for
        small displacements."""
        return self.roll_per_displacement * (self.half_gauge + self.head_radius * self.cone_sine_and_cosine[0])

    def coned(self, wanted_conicity: float) -> "Wheelset":
        """Returns a copy of the wheelset on cones with this equivalent conicity, as profiles have at some amplitude."""
        largest_conicity = min(LARGEST_CONICITY, 0.999 * self.half_gauge / self.radius)
        conicity = brentq(
            lambda c: self.changed(conicity=c).equivalent_conicity - wanted_conicity,
            LEAST_CONICITY,
            largest_conicity,
            xtol=1e-15,
        )
        return self.changed(conicity=float(conicity))

    def changed(self, **changed_parameters: Any) -> "Wheelset":
        """Returns a copy of the wheelset with some values changed, and checked as in a file."""
        return Wheelset(**{name: getattr(self, name) for name in type(self).model_fields} | changed_parameters)

    @property
    def ellipse(self) -> HertzContact:
        """Contact ellipse of one wheel in the middle of the track, under half the load."""
        cosine = self.cone_sine_and_cosine[1]
        load = self.load / (2.0 * cosine)
        return by_load(cosine / (2.0 * self.radius), 1.0 / (2.0 * self.head_radius), load, self.material_pair)


CHOSEN_WHEELSET = Wheelset(
    mass=1200.0,
    spin_inertia=100.0,
    yaw_inertia=750.0,
    radius=0.46,
    half_gauge=0.75,
    conicity=0.05,
    head_radius=0.3,
    load=1.0e5,
    half_spacing=1.0,
    stiffness_x=2.0e5,
    stiffness_y=4.0e5,
    stiffness_z=6.0e5,
    damping_x=2.0e3,
    damping_y=2.0e3,
    damping_z=4.0e3,
    friction=0.3,
    flange_clearance=0.007,
    flange_stiffness=1.5e7,
    contact_damping=0.5,
)
"""Wheelset with values of the usual size. They are chosen, not published: no source is claimed for them."""
