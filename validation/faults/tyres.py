"""Faults planted in the parameter table of a car on rolling tyres, which its compiled forces read, and the checks that
see them."""

from functools import cache
from typing import Any

import numpy as np

from models.multibody import forces as at
from models.multibody.numbers import Controls, Handling, TyreParameters
from models.systems.handling.energy import bodies_energy
from models.systems.handling.run import build_in_engine
from models.vehicles.vehicle_file import load_vehicle
from validation.common.checks import largest_relative_difference
from validation.faults.campaign import Campaign, CampaignFault, Check
from validation.faults.patches import Patch, attribute_patch
from validation.spatial.cars import cornering_error, mirrored_coordinates


def car_in_a_turn(steer: float = 0.05) -> tuple[Handling, np.ndarray, np.ndarray]:
    """The vehicle R19-free with a steer angle (rad) at 25 m/s, and coordinates and rates of a state within the
    turn."""
    car = Handling(load_vehicle("r19_free"), controls=Controls(steer=((0.0, steer),)))
    q, v = car.straight(25.0)
    coordinates, direction = car.vehicle.coordinates(), np.sign(steer)
    for name, freedom, move, rate in (
        ("carrier", "y", 0.1, 0.4),
        ("carrier", "rz", 0.02, 0.3),
        ("sway", "rx", 0.01, 0.05),
    ):
        k = coordinates.index((name, freedom))
        q[k], v[k] = direction * move, direction * rate
    q[coordinates.index(("sway", "z"))], v[coordinates.index(("sway", "z"))] = -5e-3, 0.1
    return car, q, v


def _accelerations(engine: str, steer: float = 0.05) -> np.ndarray:
    car, q, v = car_in_a_turn(steer)
    return build_in_engine(engine, car).acceleration(0.0, q, v)


@cache
def _accelerations_by_exudyn() -> np.ndarray:
    return _accelerations("exudyn")


def _mirror_error() -> float:
    return largest_relative_difference(
        mirrored_coordinates(car_in_a_turn()[0], _accelerations("mujoco", -0.05)), _accelerations("mujoco")
    )


def _read_report(handling_car: Handling, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    report, ledger = np.empty((1, len(handling_car.vehicle.tyres), at.REPORTED)), np.empty((1, at.LEDGER))
    at.fill_reports(handling_car.numbers, np.zeros(1), q[None].copy(), v[None].copy(), report, ledger)
    return report[0], ledger[0]


def _energy_balance_error() -> float:
    """Error of the car's energy balance along its motion, divided by the largest power of a tyre."""
    car, q, v = car_in_a_turn()
    a, (report, ledger) = build_in_engine("mujoco", car).acceleration(0.0, q, v), _read_report(car, q, v)
    ends = [
        bodies_energy(car, state, rate) + _read_report(car, state, rate)[1][at.POTENTIAL]
        for state, rate in ((q + time_shift * v, v + time_shift * a) for time_shift in (1e-5, -1e-5))
    ]
    power = ledger[at.DISSIPATED] + ledger[at.TORQUE_POWER] + ledger[at.STEER_POWER] + report[:, at.POWER].sum()
    return float(abs((ends[0] - ends[1]) / 2e-5 - power) / np.abs(report[:, at.POWER]).max())


def _locked_wheel_error() -> float:
    """Relative error of the force on locked wheels, which should be mu N against the sliding velocity."""
    car = Handling(load_vehicle("r19_free"), TyreParameters(cells=11, fixed=("fl", "fr", "rl", "rr")))
    report, _ = _read_report(car, *car.straight(15.0))
    return float(np.abs(report[:, at.FX] / (car.tyres.friction * report[:, at.PRESS]) + 1.0).max())


CHECKS = {
    "engine": Check(
        "accelerations in a turn by Exudyn",
        "of the largest",
        1e-10,
        lambda: largest_relative_difference(_accelerations("mujoco"), _accelerations_by_exudyn()),
    ),
    "mirror": Check("accelerations of the mirror image", "of the largest", 1e-10, _mirror_error),
    "balance": Check("change of energy by the powers", "of the tyres'", 1e-6, _energy_balance_error),
    "cornering": Check(
        "cornering stiffness of the ride vehicle", "relative", 1e-3, lambda: cornering_error(car_in_a_turn()[0])
    ),
    "sliding": Check("locked wheels by mu N", "relative", 1e-9, _locked_wheel_error),
}


ALL_WHEELS = (0, 1, 2, 3)


def tyre_table_patch(
    column_number: int, value_factor: float, tyre_numbers: tuple[int, ...] = (0,), value_shift: float = 0.0
) -> Patch:
    """Fault: a parameter (column of the table) of some tyres is multiplied by a factor and shifted."""

    def table(original_function: Any) -> Any:
        def planted(car: Handling) -> np.ndarray:
            numbers: np.ndarray = original_function(car)
            for i in tyre_numbers:
                index_in_table = int(numbers[at.OF_TYRES]) + at.PER_TYRE * i + column_number
                numbers[index_in_table] = value_factor * numbers[index_in_table] + value_shift
            return numbers

        return planted

    return attribute_patch("models.multibody.numbers:free_vehicle_table", table)


FAULTS = tuple(
    CampaignFault(name, "tyre", patch)
    for name, patch in (
        ("bristles of one tyre 1 % stiffer", tyre_table_patch(at.BRISTLES, 1.01)),
        ("bristles of all tyres 1 % stiffer", tyre_table_patch(at.BRISTLES, 1.01, ALL_WHEELS)),
        ("friction of all tyres 1 % off", tyre_table_patch(at.GRIP, 1.01, ALL_WHEELS)),
        ("one wheel steered the other way", tyre_table_patch(at.STEERED, -1.0)),
        ("load of one tyre at rest 1 % off", tyre_table_patch(at.STATIC, 1.01)),
        (
            "inclination of one wheel, which has none, by half a degree",
            tyre_table_patch(at.INCLINED, 1.0, value_shift=9e-3),
        ),
    )
)

CAMPAIGN = Campaign("planted.tyres", "a car on tyres", "rolling-vehicle", CHECKS, FAULTS)
