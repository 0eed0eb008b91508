"""Statistics that a run in time samples of a linear scene, by a covariance of its steps: no sum over frequencies, no
chance.

Axle i meets the road D_i seconds late and moves the vehicle by x_i, so that x = sum x_i. A step of the classical
Runge-Kutta method reads the filters f of the road at its begin, middle and end:

    x_i(t + h) = R x_i(t) + sum_c B_ic f(t - D_i + c h),  c = 0, 1/2, 1

The covariance S(a - b) of f(a) and f(b) is exact, so that of x_i with f and of x_i with x_j follow from the recursion.
In the motions of the vehicle R is diagonal.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import expm, solve_continuous_lyapunov

from models.advice.ride_choice.march import March

STEP_SHARES = (0.0, 0.5, 1.0)
"""Of a step, where it reads the road."""


@dataclass(frozen=True)
class Sampled:
    """Statistics of sampled runs of ``march`` in steps (s); its quantities must have no weightings."""

    march: March
    step: float = 0.0

    @property
    def longest_stable_step(self) -> float:
        """Longest stable step (s)."""
        return self.march.longest_stable_step

    def deviations(self, step: float) -> np.ndarray:
        """Standard deviations (q,) of the quantities at the samples of a run in steps of ``step`` (s)."""
        assert not self.march.weightings
        run, axles = replace(self, step=step), range(len(self._delays))
        total = np.zeros(len(self.march.rows))
        for i in axles:
            for j in [i] if self.march.reduced.excitation.independent else axles:
                total += run._shared(i, j)
        return np.sqrt(total)

    def _shared(self, i: int, j: int) -> np.ndarray:
        """Covariances (q,) between the responses of the quantities to the road at axle i and at axle j."""
        read_modes, (by_i, by_j), late = (
            self.march.motions[1],
            (self._by_road(i), self._by_road(j)),
            self._axle_lag(i, j),
        )
        motions = np.einsum("ql,lm,qm->q", read_modes, self._motions(i, j), read_modes.conj())
        with_road = np.einsum("ql,lm,qm->q", read_modes, self._with_road(i, late), by_j)
        back = np.einsum("ql,lm,qm->q", read_modes, self._with_road(j, -late), by_i)
        road = np.einsum("ql,lm,qm->q", by_i, self._road(-late), by_j)
        return (motions + with_road + back + road).real

    def _axle_lag(self, i: int, j: int) -> float:
        """Time (s) by which the road at axle j is ahead of the road at axle i."""
        return self._delays[i] - self._delays[j]

    @cached_property
    def _delays(self) -> np.ndarray:
        return np.array(self.march.reduced.excitation.lengths) / self.march.speed

    @cached_property
    def _rate(self) -> np.ndarray:
        """System matrix (m, m) in 1/s of the road filters, as functions of time."""
        return self.march.speed * self.march.reduced.excitation.F

    @cached_property
    def _variance(self) -> np.ndarray:
        """Covariance of the road filters (m, m)."""
        G = self.march.reduced.excitation.G
        return solve_continuous_lyapunov(self._rate, -self.march.speed * G @ G.T)

    def _road(self, delay: float) -> np.ndarray:
        """S (m, m): covariance of the filter states with those ``delay`` seconds before."""
        if delay < 0:
            return self._road(-delay).T
        return expm(self._rate * delay) @ self._variance

    def _by_road(self, axle: int) -> np.ndarray:
        """Matrix (q, m) that gives the quantities from the states of the road filters of one axle."""
        m = len(self._rate)
        first_column = self.march.vehicle_state_count + axle * m
        return self.march.output_matrix[:, first_column : first_column + m]

    @cached_property
    def _motion_covariance(self) -> np.ndarray:
        """R (n,): factor by which the Runge-Kutta method multiplies each modal coordinate in a step."""
        z = self.step * self.march.motions[0]
        return 1 + z + z**2 / 2 + z**3 / 6 + z**4 / 24

    def _input_matrix(self, axle: int) -> list[np.ndarray]:
        """B (n, m) for each stage of a step: how the filter states drive the modal coordinates."""
        rates, _, forced = self.march.motions
        h, z, m, road = self.step, (self.step * rates)[:, None], len(self._rate), self.march.reduced.excitation
        axles = len(road.heights)
        force = forced[:, axle * m : (axle + 1) * m]
        white = forced[:, axles * m :].reshape(len(rates), axles, -1)[:, axle]
        noise = white @ np.linalg.pinv(self.march.speed**0.5 * road.G)
        begin, middle = 1 + z + z**2 / 2 + z**3 / 4, 4 + 2 * z + z**2 / 2
        mean = begin + middle + 1
        ends, between = np.eye(m) / h, self._rate / 6
        return [
            h / 6 * (begin * force - mean * (noise @ (ends + between))),
            h / 6 * (middle * force - mean * (noise @ (4 * between))),
            h / 6 * (force + mean * (noise @ (ends - between))),
        ]

    def _driven(self, axle: int, delay: float) -> np.ndarray:
        """Covariance (n, m) of a step's forcing with the filter states ``delay`` seconds after the step's start, in the
        axle's own time."""
        parts = zip(self._input_matrix(axle), STEP_SHARES, strict=True)
        return sum(B @ self._road(share * self.step - delay) for B, share in parts)

    def _with_road(self, axle: int, delay: float) -> np.ndarray:
        """Covariance (n, m) of an axle's response x with the filter states that it meets ``delay`` seconds later, or
        earlier if negative."""
        steps = max(int(np.ceil(-delay / self.step)), 0)
        begin = delay + steps * self.step
        value, driven_part = self._state_by_filters(axle) @ expm(self._rate.T * begin), np.zeros(())
        sooner = np.linalg.solve(self._variance, self._road(self.step))
        for i in range(steps):
            driven_part = driven_part @ sooner if i > 1 else self._driven(axle, begin - i * self.step)
            value = self._motion_covariance[:, None] * value + driven_part
        return value

    def _state_by_filters(self, axle: int) -> np.ndarray:
        """Covariance (n, m) of an axle's response x with the filter states that it meets at the same time."""
        decay, driven = expm(self._rate.T * self.step), self._driven(axle, self.step)
        return np.array(
            [
                np.linalg.solve((np.eye(len(decay)) - grown * decay).T, row)
                for grown, row in zip(self._motion_covariance, driven, strict=True)
            ]
        )

    def _motions(self, i: int, j: int) -> np.ndarray:
        """Covariance (n, n) of the responses x to axles i and j."""
        covariances = self._motion_covariance[:, None] * self._state_by_forces(i, j)
        covariances += (self._motion_covariance[:, None] * self._state_by_forces(j, i)).conj().T
        covariances += sum(
            B @ self._driven(j, share * self.step + self._axle_lag(j, i)).conj().T
            for B, share in zip(self._input_matrix(i), STEP_SHARES, strict=True)
        )
        return covariances / (1 - self._motion_covariance[:, None] * self._motion_covariance.conj())

    def _state_by_forces(self, i: int, j: int) -> np.ndarray:
        """Covariance (n, n) of the response x to axle i at a step's start with the forcing by axle j in this step."""
        return np.asarray(
            sum(
                self._with_road(i, self._axle_lag(i, j) + share * self.step) @ B.conj().T
                for B, share in zip(self._input_matrix(j), STEP_SHARES, strict=True)
            )
        )
