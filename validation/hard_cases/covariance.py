"""Hard case of the covariance of force noise with a stiff pole: recursion along the path, against van Loan's block
form."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from models.core.signals import SampledSignal
from models.engines.assembly import Assembly
from models.systems.pitch_plane.tangent import TangentPath as ErrorPath
from models.systems.pitch_plane.tangent import noise_covariances
from validation.hard_cases import setups
from validation.hard_cases.case import HardCase

SAMPLE_PERIOD, SAMPLES, STEP = 0.05, 10, 1e-3
"""Period (s) of the held force samples, 35 times the decay time of the fastest pole; number of samples; step (s)."""


def vehicle_with_added_forces(added_forces: np.ndarray) -> Assembly:
    """The linearised vehicle under its weight, with ``added_forces`` (n, 2) in N added to its wheel force samples."""
    base = setups.vehicle(geometry="linear")
    forces = setups.static_forces(base, SAMPLES, SAMPLE_PERIOD)
    return setups.driven_by_forces(base, replace(forces, values=forces.values + added_forces))


def covariance_error(engine_name: str, work_folder: Path) -> float:
    """Case: a force error of 1 N in each single sample is simulated. Error: relative difference between the sum of
    squared responses and the covariance recursion."""
    quiet = setups.run(
        engine_name, vehicle_with_added_forces(np.zeros((SAMPLES, 2))), STEP, SAMPLE_PERIOD * SAMPLES
    ).states[-1]
    responses = []
    for sample in range(SAMPLES):
        for wheel in range(2):
            values = np.zeros((SAMPLES, 2))
            values[sample, wheel] = 1.0
            responses.append(
                setups.run(engine_name, vehicle_with_added_forces(values), STEP, SAMPLE_PERIOD * SAMPLES).states[-1]
                - quiet
            )
    covariance, expected = np.array(responses).T @ np.array(responses), _covariance_recursion()
    return setups.largest_magnitude(covariance - expected) / setups.largest_magnitude(expected)


def _covariance_recursion() -> np.ndarray:
    """Covariance of the states after all samples under force errors of 1 N, by the recursion along the path."""
    assembly = vehicle_with_added_forces(np.zeros((SAMPLES, 2)))
    assert isinstance(assembly.input, SampledSignal)
    return noise_covariances(ErrorPath(assembly, assembly.input, round(SAMPLE_PERIOD / STEP), SAMPLES), 1.0)[-1]


def van_loan_naive_result(work_folder: Path) -> str:
    """Result without the remedy, as text: process noise over one and over twenty periods by filterpy's van Loan
    discretisation."""
    from filterpy.common import van_loan_discretization

    from models.engines.stability import first_order, linearised_matrices

    base = vehicle_with_added_forces(np.zeros((SAMPLES, 2)))
    p, linear = base.parameters, linearised_matrices(base.vehicle)
    pushes = np.zeros((8, 2))
    pushes[4, 0], pushes[5, 1] = -1 / p.m1, -1 / p.m2
    smallest = []
    with np.errstate(all="ignore"):
        for length in (SAMPLE_PERIOD, 20 * SAMPLE_PERIOD):
            noise = van_loan_discretization(first_order(linear), pushes, length)[1]
            smallest.append(float(np.linalg.eigvalsh(0.5 * (noise + noise.T)).min() / np.abs(noise).max()))
    return (
        f"filterpy's van Loan gives a covariance with a negative eigenvalue of {smallest[0]:.0e} of its size over "
        f"{SAMPLE_PERIOD:g} s and {smallest[1]:.0e} over {20 * SAMPLE_PERIOD:g} s, without a word"
    )


CASES = (
    HardCase(
        "covariance beside a stiff pole",
        "noise held over 50 ms, 35 times the decay time of a pole at -697 1/s: a block exponential overflows",
        "each sample alone, squared and summed",
        "",
        1e-9,
        "the same sum in another order, rounding aside",
        covariance_error,
        naive_result=van_loan_naive_result,
        answer_independence="native",
    ),
)
