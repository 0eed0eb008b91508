"""Eigenvalues of a wheelset about its rest position with linear creep forces, by any implementation of its equations of
motion."""

import math
from collections.abc import Iterable

import numpy as np

from models.rail.equations import WheelsetEquations, rate_jacobian
from models.rail.wheelset import Wheelset

SLOW_SPEED = 0.2
"""Speed (m/s) at which inertia has no effect on the wavelength of a free wheelset."""


def free_wheelset(wheelset: Wheelset) -> Wheelset:
    """Returns a copy of the wheelset without suspension."""
    return wheelset.changed(**{f"{kind}_{axis}": 0.0 for kind in ("stiffness", "damping") for axis in "xyz"})


def hunting_wavelength(equations_type: type[WheelsetEquations], wheelset: Wheelset) -> float:
    """Wavelength (m) of the free wheelset, from the slowest oscillation among the eigenvalues."""
    roots = eigenvalues_at_speed(equations_type, free_wheelset(wheelset), SLOW_SPEED)
    return 2.0 * math.pi * SLOW_SPEED / min(roots[roots.imag > 0.0], key=abs).imag


def eigenvalues_at_speed(equations_type: type[WheelsetEquations], wheelset: Wheelset, speed: float) -> np.ndarray:
    """Eigenvalues (9,) in 1/s of the wheelset at a speed (m/s)."""
    return np.linalg.eigvals(equations_type(wheelset, speed, "linear").state_matrix)


def hunting_uncertainty(equations_type: type[WheelsetEquations], wheelset: Wheelset, speed: float) -> float:
    """Uncertainty (1/s) of the hunting eigenvalue: its change when slopes are taken over twice the distance; NaN
    without a hunting mode."""
    equations = equations_type(wheelset, speed, "linear")
    wide = np.linalg.eigvals(rate_jacobian(equations.rates, equations.rest, 2.0))
    return float(abs(hunting_eigenvalue(wide) - hunting_eigenvalue(np.linalg.eigvals(equations.state_matrix))))


def largest_growth_rate(equations_type: type[WheelsetEquations], wheelset: Wheelset, speed: float) -> float:
    """Largest real part (1/s) of the wheelset's eigenvalues at a speed (m/s), as an argument for
    ``linear.critical_speed``."""
    return float(eigenvalues_at_speed(equations_type, wheelset, speed).real.max())


def root_locus(equations_type: type[WheelsetEquations], wheelset: Wheelset, speeds: Iterable[float]) -> np.ndarray:
    """Eigenvalues (speeds, 9) in 1/s of the wheelset at each speed (m/s), for a root locus."""
    return np.array([eigenvalues_at_speed(equations_type, wheelset, float(speed)) for speed in speeds])


def hunting_eigenvalue(eigenvalues_of_wheelset: np.ndarray) -> np.ndarray:
    """Eigenvalue of the hunting mode: among eigenvalues (..., 9) with positive imaginary part, the least damped one;
    NaN if there is none."""
    oscillates = np.where(eigenvalues_of_wheelset.imag > 0.0, eigenvalues_of_wheelset.real, -math.inf)
    root = np.take_along_axis(eigenvalues_of_wheelset, oscillates.argmax(axis=-1)[..., None], -1)[..., 0]
    return np.where(np.isfinite(oscillates.max(axis=-1)), root, math.nan)
