"""Parameters of Whipple's bicycle and its linear equations of motion.

Conventions of Meijaard, Papadopoulos, Ruina, Schwab, Proc. R. Soc. A 463 (2007), 1955-1982: origin at the rear contact,
x forward, y to the right, z down; lean to the right and steer to the right are positive. With q = (lean, steer),

    M q'' + (v C1 + D) q' + (g K0 + v^2 K2) q = (lean torque, steer torque),

D (v) what control and friction add (``SteeringControl``).
"""

from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import Polynomial
from pydantic import Field, model_validator

from models.core.errors import InputError
from models.core.scene_file import existing_file, parse_toml
from models.core.strict import Strict, quantity, read

PARAMETER_SET_FOLDER = Path(__file__).parents[1] / "vehicles" / "parameters" / "bicycles"
LARGEST_TILT = 1.5
"""Largest tilt (rad) of the steering axis."""
MEASURED_INERTIA_FACTOR = 1.05
"""Ratio up to which a measured inertia may exceed the largest one that a rigid body can have."""
HIGHEST_SPEED = 100.0
"""Highest speed (m/s) at which eigenvalues are computed, in either direction."""


class BicycleWheel(Strict):
    """A bicycle wheel. Its inertia about all axes across the axle is one number; zero inertia is allowed."""

    radius: float = quantity("m", "of the wheel")
    mass: float = quantity("kg", "of the wheel", zero=True)
    Ixx: float = quantity("kg m^2", "about axes across the axle", zero=True)
    Iyy: float = quantity("kg m^2", "about the axle", zero=True)

    @model_validator(mode="after")
    def _possible(self) -> "BicycleWheel":
        if self.Iyy > MEASURED_INERTIA_FACTOR * 2.0 * self.Ixx:
            allowed = (
                f"must be at most 2 Ixx = {2.0 * self.Ixx:g} kg m^2, {MEASURED_INERTIA_FACTOR - 1.0:.0%} "
                "for measuring apart"
            )
            raise ValueError(f"Iyy {allowed}: no wheel has more about its axle")
        return self


class BicycleFrame(Strict):
    """A bicycle's rear frame with a rigid rider, or its front frame; where Iyy is missing it is Ixx + Izz, as for a
    flat body.
    """

    x: float = quantity("m", "centre of mass, forward from the rear contact", signed=True)
    z: float = quantity("m", "centre of mass, down from the ground: above it is negative", signed=True)
    mass: float = quantity("kg", "of the body", zero=True)
    Ixx: float = quantity("kg m^2", "about the forward axis", zero=True)
    Iyy: float | None = quantity("kg m^2", "about the lateral axis", default=None, zero=True)
    Izz: float = quantity("kg m^2", "about the vertical axis", zero=True)
    Ixz: float = quantity("kg m^2", "product of inertia, -int x z dm", default=0.0, signed=True)

    @model_validator(mode="after")
    def _possible(self) -> "BicycleFrame":
        if self.Ixz**2 > self.Ixx * self.Izz * (1.0 + 1e-9):
            raise ValueError(f"Ixz must be at most {np.sqrt(self.Ixx * self.Izz):g} kg m^2, the root of Ixx Izz")
        if self.Iyy is not None and self.Iyy > MEASURED_INERTIA_FACTOR * (self.Ixx + self.Izz):
            raise ValueError(f"Iyy must be at most Ixx + Izz = {self.Ixx + self.Izz:g} kg m^2")
        return self

    @property
    def inertia(self) -> np.ndarray:
        """Inertia tensor (3, 3) about the centre of mass, kg m^2."""
        across = self.Ixx + self.Izz if self.Iyy is None else self.Iyy
        return np.array([[self.Ixx, 0.0, self.Ixz], [0.0, across, 0.0], [self.Ixz, 0.0, self.Izz]])


class SteeringControl(Strict):
    """Steering control and friction of the bicycle, with the errors of its sensors and motor.

    Steer torque = torque_gain gain (until - measured speed) lean rate - friction steer rate - dry_friction of the steer
    rate's sign, the first where the measured speed, speed_gain v + speed_bias, is below ``until``. The encoder tells
    encoder_gain times the steer angle, which this feedback does not read.
    """

    gain: float = quantity("N s^2/m", "steer torque by lean rate and by missing speed", default=0.0, signed=True)
    until: float = quantity("m/s", "speed from which on there is no feedback", default=6.5, zero=True)
    friction: float = quantity("N m s/rad", "viscous, of the steering", default=0.0, zero=True)
    dry_friction: float = quantity("N m", "of the steering, at any rate", default=0.0, zero=True)
    dry_rate: float = quantity("rad/s", "steer rate at which dry friction is whole, within 24 %", default=0.05)
    torque_gain: float = quantity("-", "torque of the motor by its command", default=1.0, zero=True)
    encoder_gain: float = quantity("-", "steer angle of the encoder by the true one", default=1.0, zero=True)
    speed_gain: float = quantity("-", "slope of the measured over the true speed", default=1.0, zero=True)
    speed_bias: float = quantity("m/s", "measured speed at standstill", default=0.0, signed=True)

    def lean_rate_gain(self, speed: float) -> float:
        """Ratio of the feedback's steer torque to the lean rate (N m s/rad) at a speed (m/s), both positive to the
        right.
        """
        missing = max(self.until - self.speed_gain * abs(speed) - self.speed_bias, 0.0)
        return self.torque_gain * self.gain * missing

    def viscous(self, inverse_steer_rate: float) -> "SteeringControl":
        """The same control with viscous in place of dry friction, which does the same work in a given motion of the
        steering.

        inverse_steer_rate : ratio (s/rad) of the mean of |steer rate| to the mean of its square.
        """
        added = self.friction + inverse_steer_rate * self.dry_friction
        return self.model_copy(update={"friction": added, "dry_friction": 0.0})


NO_CONTROL = SteeringControl()
"""Steering without control and without friction."""


class LinearBicycle(NamedTuple):
    """Matrices (2, 2) of the linear bicycle equations: M (kg m^2), C1 (kg m), K0 (kg m), K2 (kg)."""

    M: np.ndarray
    C1: np.ndarray
    K0: np.ndarray
    K2: np.ndarray


class Whipple(Strict):
    """A bicycle of four rigid bodies whose wheels touch the ground in one point each."""

    wheelbase: float = quantity("m", "distance of the contacts")
    trail: float = quantity("m", "how far the front contact lies behind the steering axis on the ground", signed=True)
    tilt: float = Field(ge=-LARGEST_TILT, le=LARGEST_TILT, description="of the steering axis, top to the rear, rad")
    gravity: float = quantity("m/s^2", "gravity", default=9.81, zero=True)
    rear_wheel: BicycleWheel
    body: BicycleFrame
    front_frame: BicycleFrame
    front_wheel: BicycleWheel

    def changed(self, **values: Any) -> "Whipple":
        """The bicycle with some parameters changed, checked as when it is read from a file."""
        return read(Whipple, {name: getattr(self, name) for name in type(self).model_fields} | values, "", "bicycle")

    @cached_property
    def linear(self) -> LinearBicycle:
        """Matrices of the bicycle's linear equations, from appendix A of the paper; InputError where the mass matrix is
        singular.
        """
        R, B, H, F, w = self.rear_wheel, self.body, self.front_frame, self.front_wheel, self.wheelbase
        sine, cosine = np.sin(self.tilt), np.cos(self.tilt)
        mass, front = R.mass + B.mass + H.mass + F.mass, H.mass + F.mass
        if not mass > 0.0 or not front > 0.0:
            raise InputError("", "front_frame.mass", H.mass, "front frame and front wheel need a mass, together")
        xT = (B.x * B.mass + H.x * H.mass + w * F.mass) / mass
        zT = (-R.radius * R.mass + B.z * B.mass + H.z * H.mass - F.radius * F.mass) / mass
        Txx = R.Ixx + B.Ixx + H.Ixx + F.Ixx + R.mass * R.radius**2 + B.mass * B.z**2
        Txx += H.mass * H.z**2 + F.mass * F.radius**2
        Txz = B.Ixz + H.Ixz - B.mass * B.x * B.z - H.mass * H.x * H.z + F.mass * w * F.radius
        Tzz = R.Ixx + B.Izz + H.Izz + F.Ixx + B.mass * B.x**2 + H.mass * H.x**2 + F.mass * w**2
        xA, zA = (H.x * H.mass + w * F.mass) / front, (H.z * H.mass - F.radius * F.mass) / front
        Axx = H.Ixx + F.Ixx + H.mass * (H.z - zA) ** 2 + F.mass * (F.radius + zA) ** 2
        Axz = H.Ixz - H.mass * (H.x - xA) * (H.z - zA) + F.mass * (w - xA) * (F.radius + zA)
        Azz = H.Izz + F.Ixx + H.mass * (H.x - xA) ** 2 + F.mass * (w - xA) ** 2
        u = (xA - w - self.trail) * cosine - zA * sine
        All = front * u**2 + Axx * sine**2 + 2.0 * Axz * sine * cosine + Azz * cosine**2
        Alx = -front * u * zA + Axx * sine + Axz * cosine
        Alz = front * u * xA + Axz * sine + Azz * cosine
        mu = self.trail / w * cosine
        SF, ST = F.Iyy / F.radius, R.Iyy / R.radius + F.Iyy / F.radius
        SA = front * u + mu * mass * xT
        lean_steer, gyro = Alx + mu * Txz, mu * ST + SF * cosine
        M = np.array([[Txx, lean_steer], [lean_steer, All + 2.0 * mu * Alz + mu**2 * Tzz]])
        if not np.linalg.det(M) > 1e-14 * M[0, 0] ** 2:
            raise InputError("", "bicycle", None, "lean and steer have no inertia of their own: raise the inertias")
        C1 = np.array(
            [[0.0, gyro + Txz * cosine / w - mu * mass * zT], [-gyro, Alz * cosine / w + mu * (SA + Tzz * cosine / w)]]
        )
        K0 = np.array([[mass * zT, -SA], [-SA, -SA * sine]])
        K2 = np.array([[0.0, (ST - mass * zT) * cosine / w], [0.0, (SA + SF * sine) * cosine / w]])
        return LinearBicycle(M, C1, K0, K2)

    def state_matrix(self, speed: float, control: SteeringControl = NO_CONTROL) -> np.ndarray:
        """State matrix (4, 4) of (lean, steer, lean rate, steer rate) at a speed (m/s) of either sign."""
        M, C1, K0, K2 = self.linear
        damping = speed * C1 + np.array([[0.0, 0.0], [-control.lean_rate_gain(speed), control.friction]])
        stiffness = self.gravity * K0 + speed**2 * K2
        lower_rows = np.linalg.solve(M, -np.hstack([stiffness, damping]))
        return np.vstack([np.eye(2, 4, 2), lower_rows])

    def eigenvalues(self, speed: float, control: SteeringControl = NO_CONTROL) -> np.ndarray:
        """Eigenvalues (4,) in 1/s of the linear bicycle at a speed (m/s), sorted by real, then imaginary part."""
        if not abs(speed) <= HIGHEST_SPEED:
            raise InputError("", "speed", speed, f"must be from -{HIGHEST_SPEED:g} to {HIGHEST_SPEED:g} m/s")
        return np.sort_complex(np.linalg.eigvals(self.state_matrix(speed, control)))

    def weave(self, speed: float, control: SteeringControl = NO_CONTROL) -> complex:
        """Eigenvalue (1/s) of the weave: the oscillatory one with positive imaginary part, the faster one of two; NaN
        if there is none.
        """
        values = self.eigenvalues(speed, control)
        fastest = complex(values[np.argmax(values.imag)])
        return fastest if fastest.imag > 1e-9 * np.abs(values).max() else complex(np.nan, np.nan)

    @property
    def characteristic(self) -> list[Polynomial]:
        """Coefficients of 1, s, ..., s^4 in det(M s^2 + v C1 s + g K0 + v^2 K2), each a polynomial of the speed v."""
        M, C1, K0, K2 = self.linear

        def entry(row: int, column: int) -> list[Polynomial]:
            return [
                Polynomial([self.gravity * K0[row, column], 0.0, K2[row, column]]),
                Polynomial([0, C1[row, column]]),
                Polynomial(M[row, column]),
            ]

        diagonal_product, other_product = (
            _product_of_quadratics(entry(0, 0), entry(1, 1)),
            _product_of_quadratics(entry(0, 1), entry(1, 0)),
        )
        return [a - b for a, b in zip(diagonal_product, other_product, strict=True)]

    @property
    def weave_speed(self) -> float | None:
        """Speed (m/s) above which the uncontrolled bicycle's weave decays: the last root of Hurwitz' condition; None if
        there is none.
        """
        E, D, C, B, A = self.characteristic
        roots = _positive_roots(B * C * D - A * D * D - B * B * E)
        oscillating = [v for v in roots if D(v) * B(v) > 0.0]  # a pair +-i w has w^2 = D / B
        return oscillating[-1] if oscillating else None

    @property
    def capsize_speed(self) -> float | None:
        """Speed (m/s) above which the uncontrolled bicycle slowly falls over, where the stiffness becomes singular;
        None if there is none."""
        roots = _positive_roots(self.characteristic[0])
        return roots[-1] if roots else None


def _product_of_quadratics(first_entry: list[Polynomial], second_entry: list[Polynomial]) -> list[Polynomial]:
    """Coefficients of the product of two quadratic polynomials in s, by power of s."""
    total = [Polynomial([0.0]) for _ in range(5)]
    for i, a in enumerate(first_entry):
        for j, b in enumerate(second_entry):
            total[i + j] = total[i + j] + a * b
    return total


def _positive_roots(condition: Polynomial) -> list[float]:
    """Positive roots v (m/s) of a polynomial with only even or only odd powers of v, solved as one of at most second
    degree in v^2.
    """
    scale = np.abs(condition.coef).max()
    lowest = int(np.argmax(np.abs(condition.coef) > 1e-12 * scale))
    in_square = Polynomial(condition.coef[lowest::2])
    squares = in_square.trim(1e-14 * scale).roots()
    real = squares[np.abs(squares.imag) <= 1e-9 * np.abs(squares)].real
    return sorted(float(np.sqrt(square)) for square in real if square > 0.0)


def load_bicycle(
    bicycle_name: str, scene_folder: str | Path = ".", scene_path: str = "", key_path: str = "bicycle"
) -> Whipple:
    """The bicycle's parameter set with this name, or in a TOML file with all parameters; ``scene_path`` and
    ``key_path`` name the scene in error messages.
    """
    sets = {path.stem: path for path in sorted(PARAMETER_SET_FOLDER.glob("*.toml"))}
    if bicycle_name not in sets and not bicycle_name.endswith(".toml"):
        raise InputError(
            scene_path,
            key_path,
            bicycle_name,
            "must be a TOML file with all parameters, or a parameter set",
            tuple(sets),
        )
    path = sets.get(bicycle_name) or existing_file(bicycle_name, Path(scene_folder), scene_path, key_path)
    bicycle = read(Whipple, parse_toml(path), path.name)
    try:
        bicycle.linear  # noqa: B018
    except InputError as error:
        raise InputError(path.name, error.place, error.value, error.allowed) from None
    return bicycle
