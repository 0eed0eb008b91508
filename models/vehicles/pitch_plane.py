"""The pitch-plane test vehicle: a chassis that heaves and pitches on two wheels.

Source: "drift from noisy wheel forces" (Fraunhofer ITWM), Section 4 and Appendices A and B.
This file holds its parameters, its engine-neutral description and its static equilibrium; the
paper's equations of motion are in ``pitch_plane_equations.py``.
"""

import math

import numpy as np

from models.core.strict import Strict, quantity
from models.vehicles.description import Geometry, PlaneAxle, PlaneBody, PlaneVehicle, Point, Strut

STATES = ("z1", "z2", "z3", "pitch")
"""Names of the vehicle's four coordinates; its state consists of these and their rates."""
STATE_NAMES = (*STATES, *(f"{name}_rate" for name in STATES))
"""Names of the eight states, which are also the names of their channels."""


class PitchPlaneParameters(Strict):
    """Parameters of the pitch-plane vehicle, with the paper's symbols (Appendix B)."""

    a: float = quantity("m", "centre of mass to rear axle")
    b: float = quantity("m", "centre of mass to front axle")
    m1: float = quantity("kg", "front wheel")
    m2: float = quantity("kg", "rear wheel")
    m3: float = quantity("kg", "chassis")
    I: float = quantity("kg m^2", "pitch inertia of the chassis about its centre of mass")  # noqa: E741
    k1: float = quantity("N/m", "front tyre stiffness")
    k2: float = quantity("N/m", "rear tyre stiffness")
    k3: float = quantity("N/m", "front suspension stiffness")
    k4: float = quantity("N/m", "rear suspension stiffness")
    d1: float = quantity("N s/m", "front tyre damping", zero=True)
    d2: float = quantity("N s/m", "rear tyre damping", zero=True)
    d3: float = quantity("N s/m", "front suspension damping", zero=True)
    d4: float = quantity("N s/m", "rear suspension damping", zero=True)
    g: float = quantity("m/s^2", "gravity, acting down", default=9.81, zero=True)

    def array(self) -> np.ndarray:
        """All parameters in the order of the fields, shape (15,), as the compiled equations read them."""
        return np.array([getattr(self, name) for name in type(self).model_fields])


def pitch_plane_vehicle(parameters: PitchPlaneParameters, geometry: Geometry = "exact") -> PlaneVehicle:
    """Description of the pitch-plane vehicle on its tyres, over a flat road, as bodies and struts."""
    bodies = (
        PlaneBody("wheel1", parameters.m1),
        PlaneBody("wheel2", parameters.m2),
        PlaneBody("chassis", parameters.m3, parameters.I),
    )
    front, rear, ground = Point("wheel1"), Point("wheel2"), Point(None)
    struts = (
        Strut("tyre1", front, ground, parameters.k1, parameters.d1),
        Strut("tyre2", rear, ground, parameters.k2, parameters.d2),
        Strut("suspension3", Point("chassis", parameters.b), front, parameters.k3, parameters.d3),
        Strut("suspension4", Point("chassis", -parameters.a), rear, parameters.k4, parameters.d4),
    )
    axles = (PlaneAxle("front", "wheel1", parameters.b), PlaneAxle("rear", "wheel2", -parameters.a))
    return PlaneVehicle(bodies, struts, axles, parameters.g, geometry)


def equilibrium(parameters: PitchPlaneParameters, geometry: Geometry = "exact") -> np.ndarray:
    """Static equilibrium of the pitch-plane vehicle on the flat road: state, shape (8,), with zero rates.

    Closed form: the axle loads follow from the moment about the other axle, and the two strut lengths
    give heave and (the sine of) pitch.
    """
    f3, f4 = (
        parameters.m3 * parameters.g * parameters.a / (parameters.a + parameters.b),
        parameters.m3 * parameters.g * parameters.b / (parameters.a + parameters.b),
    )
    z1, z2 = (f3 + parameters.m1 * parameters.g) / parameters.k1, (f4 + parameters.m2 * parameters.g) / parameters.k2
    front, rear = z1 + f3 / parameters.k3, z2 + f4 / parameters.k4
    sine = (rear - front) / (parameters.a + parameters.b)
    pitch = math.asin(sine) if geometry == "exact" else sine
    return np.array([z1, z2, front + parameters.b * sine, pitch, 0.0, 0.0, 0.0, 0.0])
