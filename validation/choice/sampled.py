"""Statistics of the samples of a time simulation of a linear scene, by the exact covariance of its time steps, without
sums over frequencies or random numbers.

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
"""Times within a Runge-Kutta step, divided by the step, at which it reads the road."""


@dataclass(frozen=True)
class SampledStatistics:
    """Statistics of sampled simulations of a linear ride ``march`` in steps (s); its quantities must have no
    weightings."""

    march: March
    step: float = 0.0

    @property
    def longest_stable_step(self) -> float:
        """Longest time step (s) at which the Runge-Kutta method is stable."""
        return self.march.longest_stable_step

    def deviations(self, time_step: float) -> np.ndarray:
        """Standard deviations (number of quantities,) at the samples of a run in steps of ``time_step`` (s)."""
        assert not self.march.weightings
        run, axles = replace(self, step=time_step), range(len(self._axle_delays))
        total = np.zeros(len(self.march.rows))
        for i in axles:
            for j in [i] if self.march.reduced.excitation.independent else axles:
                total += run._cross_covariance(i, j)
        return np.sqrt(total)

    def _cross_covariance(self, axle_i: int, axle_j: int) -> np.ndarray:
        """Covariances (number of quantities,) between the responses of the quantities to the road at axle i and at axle
        j."""
        read_modes, (by_i, by_j), late = (
            self.march.motions[1],
            (self._quantities_by_filters(axle_i), self._quantities_by_filters(axle_j)),
            self._axle_lag(axle_i, axle_j),
        )
        motions = np.einsum("ql,lm,qm->q", read_modes, self._response_covariance(axle_i, axle_j), read_modes.conj())
        with_road = np.einsum("ql,lm,qm->q", read_modes, self._response_road_covariance(axle_i, late), by_j)
        back = np.einsum("ql,lm,qm->q", read_modes, self._response_road_covariance(axle_j, -late), by_i)
        road = np.einsum("ql,lm,qm->q", by_i, self._filter_covariance(-late), by_j)
        return (motions + with_road + back + road).real

    def _axle_lag(self, axle_i: int, axle_j: int) -> float:
        """Delay (s) of the road at axle i minus the delay at axle j."""
        return self._axle_delays[axle_i] - self._axle_delays[axle_j]

    @cached_property
    def _axle_delays(self) -> np.ndarray:
        return np.array(self.march.reduced.excitation.lengths) / self.march.speed

    @cached_property
    def _filter_matrix(self) -> np.ndarray:
        """System matrix (m, m) in 1/s of the m states of the road filters, as functions of time."""
        return self.march.speed * self.march.reduced.excitation.F

    @cached_property
    def _filter_variance(self) -> np.ndarray:
        """Stationary covariance matrix (m, m) of the states of the road filters."""
        G = self.march.reduced.excitation.G
        return solve_continuous_lyapunov(self._filter_matrix, -self.march.speed * G @ G.T)

    def _filter_covariance(self, delay: float) -> np.ndarray:
        """S (m, m): covariance of the filter states with the filter states ``delay`` seconds before."""
        if delay < 0:
            return self._filter_covariance(-delay).T
        return expm(self._filter_matrix * delay) @ self._filter_variance

    def _quantities_by_filters(self, axle: int) -> np.ndarray:
        """Matrix (number of quantities, m) that gives the quantities from the states of an axle's road filters."""
        m = len(self._filter_matrix)
        first_column = self.march.vehicle_state_count + axle * m
        return self.march.output_matrix[:, first_column : first_column + m]

    @cached_property
    def _step_factors(self) -> np.ndarray:
        """R (n,): factors by which the Runge-Kutta method multiplies the modal coordinates in a step."""
        z = self.step * self.march.motions[0]
        return 1 + z + z**2 / 2 + z**3 / 6 + z**4 / 24

    def _stage_input_matrices(self, axle: int) -> list[np.ndarray]:
        """Input matrices B (n, m) from the filter states to the modal coordinates, for the beginning, middle and end of
        a step."""
        rates, _, forced = self.march.motions
        h, z, m, road = self.step, (self.step * rates)[:, None], len(self._filter_matrix), self.march.reduced.excitation
        axles = len(road.heights)
        force = forced[:, axle * m : (axle + 1) * m]
        white = forced[:, axles * m :].reshape(len(rates), axles, -1)[:, axle]
        noise = white @ np.linalg.pinv(self.march.speed**0.5 * road.G)
        begin, middle = 1 + z + z**2 / 2 + z**3 / 4, 4 + 2 * z + z**2 / 2
        mean = begin + middle + 1
        ends, between = np.eye(m) / h, self._filter_matrix / 6
        return [
            h / 6 * (begin * force - mean * (noise @ (ends + between))),
            h / 6 * (middle * force - mean * (noise @ (4 * between))),
            h / 6 * (force + mean * (noise @ (ends - between))),
        ]

    def _forcing_covariance(self, axle: int, delay: float) -> np.ndarray:
        """Covariance (n, m) of a step's forcing by an axle with the axle's filter states ``delay`` seconds after the
        step's start."""
        parts = zip(self._stage_input_matrices(axle), STEP_SHARES, strict=True)
        return sum(B @ self._filter_covariance(share * self.step - delay) for B, share in parts)

    def _response_road_covariance(self, axle: int, delay: float) -> np.ndarray:
        """Covariance (n, m) of the response x to an axle with the filter states at this axle ``delay`` seconds later,
        or earlier if negative."""
        steps = max(int(np.ceil(-delay / self.step)), 0)
        begin = delay + steps * self.step
        value, driven_part = self._response_filter_covariance(axle) @ expm(self._filter_matrix.T * begin), np.zeros(())
        sooner = np.linalg.solve(self._filter_variance, self._filter_covariance(self.step))
        for i in range(steps):
            driven_part = driven_part @ sooner if i > 1 else self._forcing_covariance(axle, begin - i * self.step)
            value = self._step_factors[:, None] * value + driven_part
        return value

    def _response_filter_covariance(self, axle: int) -> np.ndarray:
        """Covariance (n, m) of the response x to an axle with the filter states at this axle at the same time."""
        decay, driven = expm(self._filter_matrix.T * self.step), self._forcing_covariance(axle, self.step)
        return np.array(
            [
                np.linalg.solve((np.eye(len(decay)) - grown * decay).T, row)
                for grown, row in zip(self._step_factors, driven, strict=True)
            ]
        )

    def _response_covariance(self, axle_i: int, axle_j: int) -> np.ndarray:
        """Covariance (n, n) of the responses x to axles i and j."""
        covariances = self._step_factors[:, None] * self._response_forcing_covariance(axle_i, axle_j)
        covariances += (self._step_factors[:, None] * self._response_forcing_covariance(axle_j, axle_i)).conj().T
        covariances += sum(
            B @ self._forcing_covariance(axle_j, share * self.step + self._axle_lag(axle_j, axle_i)).conj().T
            for B, share in zip(self._stage_input_matrices(axle_i), STEP_SHARES, strict=True)
        )
        return covariances / (1 - self._step_factors[:, None] * self._step_factors.conj())

    def _response_forcing_covariance(self, axle_i: int, axle_j: int) -> np.ndarray:
        """Covariance (n, n) of the response x to axle i at a step's start with the forcing by axle j in this step."""
        return np.asarray(
            sum(
                self._response_road_covariance(axle_i, self._axle_lag(axle_i, axle_j) + share * self.step) @ B.conj().T
                for B, share in zip(self._stage_input_matrices(axle_j), STEP_SHARES, strict=True)
            )
        )
