"""Variances of a quarter car and of a half car on a random road in closed form, as a check of all other methods.

A body m_s on spring k and damper c, a wheel m_u, a tyre k_t without damping; the road's height is white noise of
intensity q per second through z' = -corner z + w (corner in rad/s; 0: a random walk, whose height has no variance,
while the outputs here have one). The integrals over the rational spectra were solved by computer algebra.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm


@dataclass(frozen=True)
class QuarterCar:
    """Quarter car: body mass m_s and wheel mass m_u (kg), suspension stiffness k and tyre stiffness k_t (N/m),
    suspension damping c (N s/m)."""

    m_s: float
    m_u: float
    k: float
    c: float
    k_t: float

    @property
    def mass(self) -> float:
        """Mass of body and wheel together (kg)."""
        return self.m_s + self.m_u

    def body_acceleration_variance(self, noise_intensity: float, corner_wavenumber: float = 0.0) -> float:
        """Variance of the body's acceleration, m^2/s^4; noise_intensity : intensity of the road's white noise,
        m^2/s.
        """
        s, u, k, c, t, w = self.m_s, self.m_u, self.k, self.c, self.k_t, corner_wavenumber
        top = c**3 * t * w + c**2 * k * t + c**2 * t * s * w**2 + c * k**2 * self.mass * w + k**3 * self.mass
        return noise_intensity * t / (2 * c * s**2) * (top + k**2 * s * u * w**2) / self._common(w)

    def suspension_travel_variance(self, noise_intensity: float, corner: float = 0.0) -> float:
        """Variance of the suspension travel (body height minus wheel height), m^2."""
        slow = self.mass * (self.c * corner + self.k) + self.m_s * self.m_u * corner**2
        return noise_intensity * self.k_t / (2 * self.c) * slow / self._common(corner)

    def tyre_deflection_variance(self, noise_intensity: float) -> float:
        """Variance of the tyre deflection (wheel height minus road height), m^2, on a random-walk road; times k_t^2 it
        is the variance of the wheel load."""
        s, u, k, c, t, m = self.m_s, self.m_u, self.k, self.c, self.k_t, self.mass
        return (
            noise_intensity
            / 2
            * (c * m**2 / (t * s**2) + (k**2 * m**3 / (t * s) ** 2 - 2 * k * m * u / (t * s) + u) / c)
        )

    def _common(self, w: float) -> float:
        s, u, k, c, t = self.m_s, self.m_u, self.k, self.c, self.k_t
        slow = c * t * w + k * t + (k * self.mass + t * s) * w**2
        return slow + c * self.mass * w**3 + s * u * w**4

    def correlation_of_acceleration(self, noise_intensity: float, delay: float) -> float:
        """Correlation E[a(t) a(t + delay)] of the body's acceleration a on a random-walk road, m^2/s^4: C e^(A delay) P
        C' of four states with covariance P.

        States: tyre deflection, wheel speed, suspension travel, body speed. None of them walks with the road, so P
        solves a Lyapunov equation without cancellation.
        """
        from control import lyap

        s, u, k, c, t = self.m_s, self.m_u, self.k, self.c, self.k_t
        A = np.array([[0, 1, 0, 0], [-t / u, -c / u, k / u, c / u], [0, -1, 0, 1], [0, c / s, -k / s, -c / s]])
        P = lyap(A, np.diag([noise_intensity, 0.0, 0.0, 0.0]), method="scipy")
        return float(A[3] @ expm(A * delay) @ P @ A[3])


def half_car_acceleration(
    quarter_car: QuarterCar, noise_intensity: float, front_distance: float, rear_distance: float, speed: float
) -> float:
    """Variance (m^2/s^4) of the vertical acceleration at the centre of gravity of a half car that splits into two
    similar quarter cars; the front axle is a (m) ahead of the centre, the rear one b behind.

    It splits if its pitch inertia is m a b, and if springs, dampers, tyres and wheels of the axles are in the ratio of
    their shares of the mass, front b / (a + b), rear a / (a + b). ``quarter_car`` is the quarter car of both, up to
    this factor.
    """
    base = front_distance + rear_distance
    at_axle = quarter_car.body_acceleration_variance(noise_intensity)
    delayed_correlation = quarter_car.correlation_of_acceleration(noise_intensity, base / speed)
    return (
        (front_distance**2 + rear_distance**2) * at_axle + 2 * front_distance * rear_distance * delayed_correlation
    ) / base**2


def quarter_cars_of_half_car(
    quarter_car: QuarterCar, front_distance: float, rear_distance: float
) -> tuple[QuarterCar, QuarterCar, float]:
    """Front and rear quarter car of a half car that splits: 2 b / (a + b) and 2 a / (a + b) times ``quarter_car``; and
    its pitch inertia in kg m^2.
    """
    front, rear = (
        QuarterCar(*(2 * share / (front_distance + rear_distance) * value for value in vars(quarter_car).values()))
        for share in (rear_distance, front_distance)
    )
    return front, rear, 2 * quarter_car.m_s * front_distance * rear_distance
