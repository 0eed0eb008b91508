"""Hard cases of impossible wheel forces and vehicles, which must be refused or doubted before the run; true forces
raise nothing.

Forces of the asymmetric vehicle on hills for 20 s are spoilt; the error counts what is not named as it must be.
"""

from collections.abc import Callable
from functools import cache, partial
from pathlib import Path

import numpy as np

from models.core.errors import InputError
from models.measured.axle_forces import FILE_REMEDIES, AxleForces, check_axle_forces
from models.measured.signal import MeasuredSignal
from models.systems.pitch_plane.run import run as simulate
from models.vehicles.parameters.asymmetric_twin import PARAMETERS as TWIN
from models.vehicles.plausible_plane import implausible_plane_values
from validation.common.scenes import road_scene
from validation.hard_cases.case import IMPLEMENTATIONS, HardCase, OutcomeWord

SAMPLE_PERIOD, DURATION = 1e-3, 20.0
WHEEL_WEIGHTS = np.array([TWIN.m1, TWIN.m2]) * TWIN.g
STATIC_WHEEL_LOADS = TWIN.m3 * TWIN.g * np.array([TWIN.a, TWIN.b]) / (TWIN.a + TWIN.b) + WHEEL_WEIGHTS
ForceChange = Callable[[np.ndarray], np.ndarray]
REFUSED: dict[str, ForceChange] = {
    "wheel forces with the other sign": lambda f: -f,
    "front wheel force with the other sign": lambda f: f * [-1, 1],
    "rear wheel force with the other sign": lambda f: f * [1, -1],
    "wheel forces in kN": lambda f: f / 1e3,
    "wheel forces in daN": lambda f: f / 10,
    "rear wheel force in kN": lambda f: f * [1, 1e-3],
    "wheel forces of exchanged axles": lambda f: f[:, ::-1],
    "wheel forces without the static load": lambda f: f - STATIC_WHEEL_LOADS,
    "front wheel force without the static load": lambda f: f - STATIC_WHEEL_LOADS * [1, 0],
    "wheel forces measured above the wheels": lambda f: f - WHEEL_WEIGHTS,
    "wheel forces of one side": lambda f: f / 2,
    "wheel forces 15 % low": lambda f: f * 0.85,
}
DOUBTED: dict[str, ForceChange] = {
    "wheel forces 5 % low": lambda f: f * 0.95,
    "wheel forces 2 % high": lambda f: f * 1.02,
    "front wheel force 2 % high": lambda f: f * [1.02, 1],
    "offset of the rear wheel force": lambda f: f + np.array([0, 60.0]),
    "front wheel force that never changes": lambda f: np.column_stack(
        [np.full(len(f), STATIC_WHEEL_LOADS[0]), f[:, 1]]
    ),
}
QUERIED: dict[str, dict[str, float]] = {
    "chassis in tonnes": {"m3": 1.35},
    "wheelbase in mm": {"a": 1300.0, "b": 800.0},
    "springs in N/mm": {"k3": 90.0, "k4": 120.0},
    "tyre in N/mm": {"k1": 190.0},
    "dampers in N s/mm": {"d3": 9.0, "d4": 12.0},
    "pitch inertia in t m^2": {"I": 0.54},
}


@cache
def true_forces() -> np.ndarray:
    """True wheel forces (n, 2) in N of the asymmetric vehicle on hills."""
    road = {"source": "hills", "speed": 20.0}
    run = simulate(road_scene("asymmetric_twin", SAMPLE_PERIOD, DURATION, road), "reference")
    return np.column_stack([run["f1"], run["f2"]])


def error_texts(change_forces: ForceChange) -> list[str]:
    """Texts of the doubts that the input check finds in changed wheel forces. Raises InputError if it finds an
    error."""
    front, rear = (
        MeasuredSignal(axle, "forces.csv", axle, "force", axle, "z", "inertial", 1, "N", 1.0)
        for axle in ("front", "rear")
    )
    forces = np.ascontiguousarray(change_forces(true_forces()))
    findings = check_axle_forces(AxleForces(forces, SAMPLE_PERIOD, TWIN, ((front,), (rear,)), DURATION, FILE_REMEDIES))
    errors = [finding.text for finding in findings if finding.weight == "error"]
    if errors:
        raise InputError("forces.csv", "", None, " ".join(errors))
    return [finding.text for finding in findings if finding.weight == "doubt"]


def _missed_doubt_error(change_forces: ForceChange, is_doubted: bool, _: str, work_folder: Path) -> float:
    """Difference between the number of doubts about changed wheel forces and the wanted number, 1 or 0."""
    return abs(len(error_texts(change_forces)) - is_doubted)


def _unqueried_vehicle_error(parameter_changes: dict[str, float], _: str, work_folder: Path) -> float:
    """1 if the check of vehicle parameters has no doubt about a vehicle with changed parameters, else 0."""
    return float(not implausible_plane_values(TWIN.model_copy(update=parameter_changes)))


def _input_check_case(
    case_name: str, error_function: Callable[[str, Path], float], expected_ending: OutcomeWord, message: str
) -> HardCase:
    """Hard case of an input that the check must refuse, doubt or accept, with a phrase on what it must say."""
    expected: dict[str, OutcomeWord] = (
        dict.fromkeys(IMPLEMENTATIONS, expected_ending) if expected_ending != "right" else {}
    )
    return HardCase(
        case_name,
        "engines run it without a word",
        message,
        "unnamed",
        0.0,
        "it is named or it is not",
        error_function,
        expected,
        is_without_engine=True,
    )


CASES = (
    *(
        _input_check_case(
            name, partial(_missed_doubt_error, change, True), "refused", "refused before the run, with what is wrong"
        )
        for name, change in REFUSED.items()
    ),
    *(
        _input_check_case(
            name,
            partial(_missed_doubt_error, change, True),
            "right",
            "one doubt before the run, with the fall or turn to come",
        )
        for name, change in DOUBTED.items()
    ),
    _input_check_case(
        "true wheel forces", partial(_missed_doubt_error, lambda f: f, False), "right", "nothing is said"
    ),
    *(
        _input_check_case(
            name, partial(_unqueried_vehicle_error, change), "right", "queried, with the value and what is usual"
        )
        for name, change in QUERIED.items()
    ),
)
