"""Covariance of the state under white noise on the samples of the wheel forces, carried along the true path.

The noise belongs to the samples: held over each period or linear in between, as the scene says. From one sample to
the next x+ = Phi x + G0 w + G1 w+, with Phi, G0 and G1 from the exact linearisation of the Runge-Kutta steps, so
the recursion gives what a Monte Carlo with the same samples gives, as long as the errors are small. Linear samples
reach into two periods: x and w are correlated, E[x w^T] = s^2 G1 of the period before.

No matrix exponential is taken: van Loan's block form holds exp(-A T) of a pole at -697 1/s and overflows without
a word (filterpy's ``van_loan_discretization`` is wrong from T = 0.05 s on).
"""

from dataclasses import dataclass

import numpy as np

from models.engines.assembly import Assembly
from models.engines.reference import compiled
from models.systems.pitch_plane.tangent import STEP, Path, path_of
from models.vehicles.pitch_plane import STATES


@dataclass(frozen=True)
class Covariance:
    """times (n,) in s, those of the samples; matrices (n, 8, 8) in the units of the state, products of two."""

    times: np.ndarray
    matrices: np.ndarray

    def deviation(self, coordinate: str) -> np.ndarray:
        """Standard deviation (n,) of a coordinate by its name: m or rad."""
        i = STATES.index(coordinate)
        return np.sqrt(self.matrices[:, i, i])


def covariance(assembly: Assembly, deviation: float, longest: float = STEP) -> Covariance:
    """Covariance along a free force-excited run, of noise with a standard deviation (N) of each sample.

    longest : of the steps (s). Raises ValueError for any other run and for samples that a spline goes through:
    every sample of a spline reaches into all periods.
    """
    path = path_of(assembly, longest)
    if assembly.scene.effects["wheel_forces"].interpolation == "smooth":
        raise ValueError("the noise of samples that a spline goes through has no recursion: hold it, or take it linear")
    return Covariance(path.forces.period * np.arange(path.samples + 1), carried(path, deviation))


def carried(path: Path, deviation: float) -> np.ndarray:
    """Covariances (samples + 1, 8, 8) at the samples of a path, of noise of ``deviation`` (N); 0 at its start."""
    matrices = np.zeros((path.samples + 1, 8, 8))
    own, march = path.assembly, path.march(_compile_covariance)
    march(
        own.initial.copy(),
        path.step,
        path.per_sample,
        path.table(path.forces),
        _weights(path),
        path.rows,
        own.parameters.array(),
        deviation**2,
        matrices,
    )
    return matrices


def _weights(path: Path) -> np.ndarray:
    """Force errors (stages, 12, 2) of 1 N in the sample at the start (columns 8, 9) and at the end (10, 11)."""
    stages = np.arange(2 * path.per_sample + 1) / (2 * path.per_sample)
    found = np.zeros((len(stages), 12, 2))
    for wheel in range(2):
        found[:, 8 + wheel, wheel] = 1.0 if path.forces.held else 1.0 - stages
        found[:, 10 + wheel, wheel] = 0.0 if path.forces.held else stages
    return found


def _compile_covariance(one_step, key):
    def covariance_march(y, step, per_sample, inputs, weights, rows, p, intensity, matrices):
        """The recursion of this file; x holds the columns of Phi, G0 and G1."""
        to_middle, to_end, to_next = rows
        x, before = np.empty((12, 8)), np.zeros((2, 8))
        for i in range(len(matrices) - 1):
            x[:] = 0.0
            for j in range(8):
                x[j, j] = 1.0
            for j in range(per_sample):
                row = (i * per_sample + j) * to_next
                at = (row, row + to_middle, row + to_end)
                one_step(y, x, step, inputs, weights, (at, (2 * j, 2 * j + 1, 2 * j + 2)), p, p)
            moved, begun, ended = x[:8], x[8:10], x[10:]
            cross = intensity * moved.T @ before.T @ begun
            matrices[i + 1] = moved.T @ matrices[i] @ moved + intensity * (begun.T @ begun + ended.T @ ended)
            matrices[i + 1] += cross + cross.T
            before[:] = ended

    return compiled(covariance_march, key)
