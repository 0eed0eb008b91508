"""Linear lateral and yaw motion of a conical wheelset, with Kalker's linear theory of creep forces.

Coordinates are y and psi (yaw); roll and height follow from both cones touching their rails. With c the conicity,
g = atan c, r the radius, b half the distance of the contacts and R the radius of the rails' heads, geometry gives,
without further approximation at first order (second order for the height):

    roll             = -k y,  k = c / (b - c r)
    rolling radius   = r +- L y,  L = c (b + R sin g) / (b - c r), the equivalent conicity
    lateral slip     = (y' b / (b - c r) - V psi) / cos g
    height (down)    = -(k + (c b + r + R / cos g) k^2 / 2) y^2 + c (b - c r) psi^2 / 2

Without slip the path is a wave, y'' = -V^2 c (b + R sin g) / (r b^2) y: Klingel's 2 pi sqrt(r b / c) for rails that
are edges (R = 0).

Left out: that the coefficients of creep follow the normal forces of the two wheels, that the constant creep forces of
spin (opposite on the two wheels) turn with the geometry, and that the contact yields. ``equations`` has all of these.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from models.contact.inputs import Array
from models.contact.linear_theory import kalker_coefficients
from models.core.errors import InputError
from models.rail.wheelset import Wheelset

LOWEST_SPEED, HIGHEST_SPEED = 1.0, 200.0
"""Speeds (m/s) between which a critical speed is searched."""
SPEED_COUNT = 60
"""Count of speeds tried between the lowest and the highest."""
SPEED_PRECISION = 1e-12
"""Relative precision of a critical speed."""


class NoCriticalSpeed(InputError):
    """Error of a wheelset that does not change from stable to unstable at any speed; ``unstable`` is whether it is
    always unstable."""

    def __init__(self, is_always_unstable: bool) -> None:
        self.unstable = is_always_unstable
        super().__init__(
            "",
            "wheelset",
            None,
            f"is unstable at {LOWEST_SPEED:g} m/s already: its suspension is too soft"
            if is_always_unstable
            else f"is stable up to {HIGHEST_SPEED:g} m/s: there is no critical speed",
        )


@dataclass(frozen=True)
class LinearWheelsetMatrices:
    """Linear equations of motion M q'' + D q' + K q = 0 of a wheelset for q = (y, psi), lateral displacement and yaw;
    matrices (2, 2), SI units."""

    mass: Array
    damping: Array
    stiffness: Array

    @property
    def state_matrix(self) -> Array:
        """State matrix A (4, 4) of the state (y, psi, y', psi')."""
        rates = -np.linalg.solve(self.mass, np.hstack([self.stiffness, self.damping]))
        return np.vstack([np.hstack([np.zeros((2, 2)), np.eye(2)]), rates])


def klingel_wavelength(wheelset: Wheelset) -> float:
    """Wavelength (m) of the free wheelset without slip: Klingel's formula, extended by the radius of the rails' heads
    (see above)."""
    r, b, head = wheelset.radius, wheelset.half_gauge, wheelset.head_radius
    return 2.0 * math.pi * math.sqrt(r * b * b / (wheelset.conicity * (b + head * wheelset.cone_sine_and_cosine[0])))


def kalker_matrix(wheelset: Wheelset) -> Array:
    """Matrix (3, 3) of Kalker's linear theory, negative creep forces of one wheel per creepage: rows -fx, -fy, -mz,
    columns xi_x, xi_y, spin; N, N m, N m^2."""
    contact, pair = wheelset.ellipse, wheelset.material_pair
    c, area = kalker_coefficients(contact.a / contact.b, pair.nu), contact.a * contact.b
    turn = area**1.5 * c.c23
    return pair.G * np.array([[area * c.c11, 0, 0], [0, area * c.c22, turn], [0, -turn, area**2 * c.c33]], float)


def linear_matrices(wheelset: Wheelset, speed: float) -> LinearWheelsetMatrices:
    """``LinearWheelsetMatrices`` at a speed (m/s), which must be above 0. Raises InputError otherwise."""
    if not 0.0 < speed < math.inf:
        raise InputError("", "speed", speed, "must be a speed above 0, in m/s")
    w, creep = wheelset, kalker_matrix(wheelset)
    gyroscopic = w.roll_per_displacement * w.spin_inertia * speed / w.radius
    arm = w.half_spacing**2  # of the suspension; roll goes with the lateral displacement
    damping = 2.0 * np.diag([w.damping_y + w.damping_z * arm * w.roll_per_displacement**2, w.damping_x * arm])
    stiffness = 2.0 * np.diag([w.stiffness_y + w.stiffness_z * arm * w.roll_per_displacement**2, w.stiffness_x * arm])
    damping += np.array([[0.0, -gyroscopic], [gyroscopic, 0.0]])
    stiffness += gravity_stiffness(w)
    for motion, displacement in _contact_kinematics(w):
        damping += motion.T @ creep @ motion / speed
        stiffness += motion.T @ creep @ displacement
    return LinearWheelsetMatrices(
        np.diag([w.mass + w.yaw_inertia * w.roll_per_displacement**2, w.yaw_inertia]), damping, stiffness
    )


def _contact_kinematics(wheelset: Wheelset) -> list[tuple[Array, Array]]:
    """Linear kinematics of the right and the left wheel: matrices (3, 2) from (y', psi') / V and from (y, psi) to the
    two creepages and spin."""
    cosine, b = wheelset.cone_sine_and_cosine[1], wheelset.half_gauge
    across = b / (b - wheelset.conicity * wheelset.radius) / cosine
    return [
        (
            np.array([[0.0, -side * b], [across, 0.0], [0.0, cosine]]),
            np.array([[-side * wheelset.equivalent_conicity / wheelset.radius, 0.0], [0.0, -1.0 / cosine], [0.0, 0.0]]),
        )
        for side in (1.0, -1.0)
    ]


def gravity_stiffness(wheelset: Wheelset) -> Array:
    """Stiffness matrix (2, 2) of the weight on the wheelset, which lateral displacement y raises and yaw lowers."""
    b, c = wheelset.half_gauge, wheelset.conicity
    rise = (
        2.0 * wheelset.roll_per_displacement
        + (c * b + wheelset.radius + wheelset.head_radius / wheelset.cone_sine_and_cosine[1])
        * wheelset.roll_per_displacement**2
    )
    return wheelset.load * np.diag([rise, -c * (b - c * wheelset.radius)])


def kinematic_wavelength(wheelset: Wheelset) -> float:
    """Wavelength (m) from the eigenvalues of a wheelset with creep forces alone: no inertia, suspension or weight."""
    creep = kalker_matrix(wheelset)
    motion, displacement = (sum(pair[0].T @ creep @ pair[k] for pair in _contact_kinematics(wheelset)) for k in (0, 1))
    values = np.linalg.eigvals(-np.linalg.solve(motion, displacement))
    return float(2.0 * math.pi / np.abs(values.imag).max())


def largest_growth_rate(wheelset: Wheelset, speed: float) -> float:
    """Largest real part (1/s) of the linear wheelset's eigenvalues at a speed (m/s)."""
    return float(np.linalg.eigvals(linear_matrices(wheelset, speed).state_matrix).real.max())


def critical_speed(
    wheelset: Wheelset, growth_at_speed: Callable[[Wheelset, float], float] = largest_growth_rate
) -> float:
    """Lowest speed (m/s) at which a motion of the wheelset no longer decays.

    growth_at_speed : largest real part of the eigenvalues as a function of wheelset and speed. Raises NoCriticalSpeed
    if the wheelset is unstable at the lowest speed, or stable up to the highest one that is looked at.
    """
    speeds = np.geomspace(LOWEST_SPEED, HIGHEST_SPEED, SPEED_COUNT)
    slower = speeds[0]
    if growth_at_speed(wheelset, slower) >= 0.0:
        raise NoCriticalSpeed(is_always_unstable=True)
    for speed in speeds[1:]:
        if growth_at_speed(wheelset, speed) >= 0.0:
            return float(
                brentq(
                    lambda v: growth_at_speed(wheelset, v),
                    slower,
                    speed,
                    xtol=SPEED_PRECISION * speed,
                    rtol=SPEED_PRECISION,
                )
            )
        slower = speed
    raise NoCriticalSpeed(is_always_unstable=False)


def critical_speed_or_reason(
    wheelset: Wheelset, growth_at_speed: Callable[[Wheelset, float], float] = largest_growth_rate
) -> tuple[float | None, str]:
    """Critical speed (m/s) of the wheelset and "", or None and the reason, as words that continue "the wheelset"."""
    try:
        return critical_speed(wheelset, growth_at_speed), ""
    except NoCriticalSpeed as error:
        return None, str(error.allowed)
