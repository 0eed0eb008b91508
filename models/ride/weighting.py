"""Frequency weightings of ISO 2631-1 as filters behind a vehicle's outputs: what a person feels of an acceleration.

A weighting is a product of second-order sections: band limit (high-pass at f1, low-pass at f2), transition from
acceleration to velocity (f3, f4), upward step (f5, f6) (ISO 2631-1:1997, Annex A; the parameters also in ISO 8041).
Every section keeps two states scaled by its own frequency: as one polynomial of eighth order the same filter loses
four digits in a Lyapunov equation, its coefficients lie twenty decades apart.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from models.core.errors import InputError
from models.ride.excited import DelayedSystem


@dataclass(frozen=True)
class FilterSection:
    """Second-order filter section (n0 + n1 p + n2 p^2) / (1 + p / quality + p^2) with p = s / (2 pi frequency),
    frequency in Hz."""

    frequency: float
    quality: float
    numerator: tuple[float, float, float]


@dataclass(frozen=True)
class FrequencyWeighting:
    """Frequency weighting as a product of filter sections; its name is that in the standard."""

    name: str
    sections: tuple[FilterSection, ...]

    def response(self, frequency: np.ndarray) -> np.ndarray:
        """Complex frequency response of the weighting at frequencies (Hz)."""
        transfer = np.ones(np.shape(frequency), complex)
        for section in self.sections:
            p = 1j * np.asarray(frequency) / section.frequency
            n0, n1, n2 = section.numerator
            transfer *= (n0 + n1 * p + n2 * p**2) / (1.0 + p / section.quality + p**2)
        return transfer

    def matrices(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """State-space form A (n, n), B (n,), C (n,) of the weighting, x' = A x + B u, y = C x, with n = 2 per section
        and no direct transmission."""
        size = 2 * len(self.sections)
        A, B = np.zeros((size, size)), np.zeros(size)
        input_row, direct = np.zeros(size), 1.0  # what reaches the next section: before . x + direct u
        for i, section in enumerate(self.sections):
            rate = 2.0 * math.pi * section.frequency
            x, v = 2 * i, 2 * i + 1  # p^2 x = before - x - p x / quality, v = p x
            A[x, v] = rate
            A[v] += rate * input_row
            A[v, x], A[v, v] = -rate, -rate / section.quality
            B[v] = rate * direct
            n0, n1, n2 = section.numerator
            input_row = n2 * input_row
            input_row[x], input_row[v] = n0 - n2, n1 - n2 / section.quality
            direct = n2 * direct
        return A, B, input_row


def weighting_of_standard(
    weighting_name: str,
    transition_section: tuple[float, float, float] | None,
    upward_step: tuple[float, float, float, float] | None = None,
) -> FrequencyWeighting:
    """Weighting from parameters of ISO 2631-1: transition (f3, f4, Q4), step (f5, Q5, f6, Q6); frequencies in Hz.

    The band limit is that of all weightings for comfort and health: 0.4 to 100 Hz, Q = 1 / sqrt(2).
    """
    sections = [FilterSection(100.0, 0.5**0.5, (1.0, 0.0, 0.0)), FilterSection(0.4, 0.5**0.5, (0.0, 0.0, 1.0))]
    if transition_section is not None:
        f3, f4, q4 = transition_section
        sections.append(FilterSection(f4, q4, (1.0, f4 / f3, 0.0)))
    if upward_step is not None:
        f5, q5, f6, q6 = upward_step
        sections.append(FilterSection(f6, q6, ((f5 / f6) ** 2, f5 / f6 / q5, 1.0)))
    return FrequencyWeighting(weighting_name, tuple(sections))


WEIGHTINGS = {
    "Wk": weighting_of_standard("Wk", (12.5, 12.5, 0.63), (2.37, 0.91, 3.35, 0.91)),
    "Wd": weighting_of_standard("Wd", (2.0, 2.0, 0.63)),
    "Wc": weighting_of_standard("Wc", (8.0, 8.0, 0.63)),
    "We": weighting_of_standard("We", (1.0, 1.0, 0.63)),
    "Wj": weighting_of_standard("Wj", None, (3.75, 0.91, 5.32, 0.91)),
}
"""Weightings of ISO 2631-1 by name. Wk: vertical, seat and floor; Wd: fore and aft, sideways; Wc: backrest; We:
rotations; Wj: under the head."""

HEALTH_FACTORS = {"x": 1.4, "y": 1.4, "z": 1.0}
"""Factors of the axes on the seat for health (Wd, Wd, Wk); for comfort all are 1."""


def system_with_weightings(delayed_system: DelayedSystem, weighting_filters: Mapping[str, str]) -> DelayedSystem:
    """Returns the system with weighted outputs after its own: {"seat_z": "Wk"} adds the output "seat_z Wk".

    Filter states stand after the system's. A weighted output is finite even where white noise reaches the output
    itself: every weighting falls at high frequency. Raises InputError for an unknown output or weighting.
    """
    for output, name in weighting_filters.items():
        if output not in delayed_system.names:
            raise InputError("", "weighted output", output, "must be an output of the vehicle", delayed_system.names)
        if name not in WEIGHTINGS:
            raise InputError("", f"weighting of {output}", name, "must be a weighting", tuple(WEIGHTINGS))
    if not weighting_filters:
        return delayed_system
    rows = [delayed_system.names.index(output) for output in weighting_filters]
    sections = [WEIGHTINGS[name].matrices() for name in weighting_filters.values()]
    A, inputs, C = (
        block_diag(*(a for a, _, _ in sections)),
        _block_columns([b for _, b, _ in sections]),
        _block_columns([c for *_, c in sections]),
    )
    n, p = len(delayed_system.A), len(weighting_filters)
    corner, silent = np.zeros((n, len(A))), np.zeros((p, delayed_system.B[0].shape[1]))
    return DelayedSystem(
        A=np.block([[delayed_system.A, corner], [inputs @ delayed_system.C[rows], A]]),
        B=tuple(np.vstack([B, inputs @ D[rows]]) for B, D in zip(delayed_system.B, delayed_system.D, strict=True)),
        delays=delayed_system.delays,
        C=np.block([[delayed_system.C, np.zeros((len(delayed_system.C), len(A)))], [np.zeros((p, n)), C.T]]),
        D=tuple(np.vstack([D, silent]) for D in delayed_system.D),
        names=(*delayed_system.names, *(f"{output} {name}" for output, name in weighting_filters.items())),
        independent=delayed_system.independent,
    )


def total_value(weighted_accelerations: Mapping[str, float], axis_factors: Mapping[str, float]) -> float:
    """Vibration total value a_v = sqrt(sum (k a_w)^2) of weighted rms accelerations (m/s^2), by axis (eq. 10)."""
    return math.sqrt(sum((axis_factors[axis] * value) ** 2 for axis, value in weighted_accelerations.items()))


def _block_columns(column_vectors: Sequence[np.ndarray]) -> np.ndarray:
    """Block-diagonal matrix in which each given vector is one column."""
    return block_diag(*(vector[:, None] for vector in column_vectors))
