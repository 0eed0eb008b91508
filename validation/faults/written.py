"""Faults planted in what both engines share (parameter table, preloads, road, inertia), which the plain equations of a
car see.

Two engines that read the same table and call the same forces agree to rounding under each of these faults.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np

from models.engines.cut_vehicle import PLAIN_ENGINE
from models.engines.cut_vehicle import build as hub_model
from models.multibody import cut_kernel as cut_at
from models.multibody import forces as at
from models.multibody.cut_table import HubInputs
from models.multibody.parts import FRAME, PER_PART
from models.systems.handling.run import REFERENCE_ENGINE, build_in_engine
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.spatial_linear import Preloads
from validation.common.checks import largest_relative_difference
from validation.faults.campaign import Campaign, CampaignFault, Check
from validation.faults.patches import Patch, attribute_patch
from validation.faults.tyres import ALL_WHEELS, tyre_table_patch
from validation.spatial.written_equations import STEP, cut_cars, cut_state, hub_input_sets, rolling_cars, rolling_states

DIFFERENCE_BOUND = 1e-12


def _car_difference(car_name: str = "twin") -> float:
    """Relative difference of the accelerations of a steered and braked car on a rough slope, between MuJoCo and the
    plain equations."""
    car = rolling_cars()[car_name]
    ((t, q, v),) = islice(rolling_states(car, 3), 2, 3)
    return largest_relative_difference(
        *(build_in_engine(engine, car).acceleration(t, q, v) for engine in ("mujoco", REFERENCE_ENGINE))
    )


def _hub_twin_difference(choose_input: Callable[[list[HubInputs]], HubInputs]) -> float:
    """Relative difference of the accelerations of the asymmetric twin under hub forces, between MuJoCo and the plain
    equations. choose_input: picks the hub forces."""
    vehicle = cut_cars()["twin"]
    hub_inputs, (q, v) = choose_input(hub_input_sets(vehicle)), cut_state(vehicle, 3)
    return largest_relative_difference(
        *(
            hub_model(engine, vehicle, hub_inputs, STEP, STEP).acceleration(0.0, q, v)
            for engine in ("mujoco", PLAIN_ENGINE)
        )
    )


CHECKS = {
    "tyres": Check(
        "accelerations of a car on tyres by its plain equations", "of the largest", DIFFERENCE_BOUND, _car_difference
    ),
    "towing": Check(
        "accelerations of a train on tyres by its plain equations",
        "of the largest",
        DIFFERENCE_BOUND,
        lambda: _car_difference("train"),
    ),
    "hubs": Check(
        "accelerations of a cut car on hub forces",
        "of the largest",
        DIFFERENCE_BOUND,
        lambda: _hub_twin_difference(lambda all_of: all_of[0]),
    ),
    "road": Check(
        "accelerations of a cut car on a road",
        "of the largest",
        DIFFERENCE_BOUND,
        lambda: _hub_twin_difference(lambda all_of: all_of[-2]),
    ),
}


def _preload_patch(module_name: str) -> Patch:
    """Fault: the preload of one spring is 1 % too large."""

    def changed(original_function: Any) -> Any:
        def planted(vehicle: SpatialVehicle) -> Preloads:
            parts, tyres = original_function(vehicle)
            first = max(parts, key=lambda name: abs(parts[name]))
            return Preloads(parts | {first: 1.01 * parts[first]}, tyres)

        return planted

    return attribute_patch(f"{module_name}:static_preloads", changed)


def _scaled_wave(original_function: Any) -> Any:
    """Fault: the first wave of the road has a 1 % larger amplitude in the table."""

    def planted(car: Any) -> np.ndarray:
        numbers: np.ndarray = original_function(car)
        first = int(numbers[at.OF_WAVES])
        numbers[first + 2 : first + 4] *= 1.01
        return numbers

    return planted


def _raised_sample(original_function: Any) -> Any:
    """Fault: the road under the first hub is read 0.1 mm too high."""

    def planted(vehicle: Any, hub_inputs: HubInputs, step: float) -> np.ndarray:
        hubs = hub_inputs.hubs.copy()
        hubs[:, 0] += 1e-4
        return np.asarray(original_function(vehicle, replace(hub_inputs, hubs=hubs), step))

    return planted


def _towed_marks_cleared(
    section_index: int, count_index: int, columns_per_row: int, column_index: int
) -> Callable[[Any], Any]:
    """Fault: the table's column that marks the tyres or springs of a trailer is set to 0."""

    def changed(original_function: Any) -> Any:
        def planted(car: Any) -> np.ndarray:
            numbers: np.ndarray = original_function(car)
            first = int(numbers[section_index])
            rows = numbers[first : first + int(numbers[count_index]) * columns_per_row].reshape(-1, columns_per_row)
            rows[:, column_index] = 0.0
            return numbers

        return planted

    return changed


def _stiff_bars(original_function: Any) -> Any:
    """Fault: anti-roll bars of a car on tyres are 1 % too stiff."""

    def planted(*arguments: Any) -> Iterator[Any]:
        for row, curves in original_function(*arguments):
            yield [1.01 * row[0], *row[1:]], curves

    return planted


def _swapped_numbers(first_index: int, second_index: int) -> Callable[[Any], Any]:
    """Fault: two numbers in a row of the table are exchanged."""

    def changed(original_function: Any) -> Any:
        def planted(*arguments: Any) -> list[float]:
            row = list(original_function(*arguments))
            row[first_index], row[second_index] = row[second_index], row[first_index]
            return row

        return planted

    return changed


def _turned_bar(original_function: Any) -> Any:
    """Fault: anti-roll bars of a cut car act in the opposite direction."""

    def planted(bar_element: Any, joined_bodies: Any) -> list[float]:
        row: list[float] = original_function(bar_element, joined_bodies)
        if not np.isclose(np.linalg.norm(bar_element.axis), 1.0):
            row[cut_at.AXIS : cut_at.AXIS + 3] = [-value for value in row[cut_at.AXIS : cut_at.AXIS + 3]]
        return row

    return planted


def _changed_inertia(change_inertia: Callable[[np.ndarray], np.ndarray]) -> Callable[[Any], Any]:
    """Fault: in the engine, the inertia of the heaviest body is replaced by change_inertia(inertia)."""

    def changed(original_function: Any) -> Any:
        def planted(vehicle: SpatialVehicle, *arguments: Any) -> Any:
            heavy = max(vehicle.bodies, key=lambda body: body.mass)
            x, y, z = change_inertia(np.array(heavy.inertia)).tolist()
            other_body = replace(heavy, inertia=(tuple(x), tuple(y), tuple(z)))
            bodies = tuple(other_body if body is heavy else body for body in vehicle.bodies)
            return original_function(replace(vehicle, bodies=bodies), *arguments)

        return planted

    return changed


def _turned_products(inertia_matrix: np.ndarray) -> np.ndarray:
    return 2.0 * np.diag(np.diag(inertia_matrix)) - inertia_matrix


TABLE_WRITER, CUT_TABLE = "models.multibody.numbers", "models.multibody.cut_table"
FAULTS = (
    CampaignFault("bristles of all tyres 30 % stiffer", "tyre", tyre_table_patch(at.BRISTLES, 1.3, ALL_WHEELS)),
    CampaignFault("half widths of patches 1 % off", "tyre", tyre_table_patch(at.HALF_WIDTH, 1.01, ALL_WHEELS)),
    CampaignFault("preload of a spring 1 % off, on tyres", "preload", _preload_patch(TABLE_WRITER)),
    CampaignFault("preload of a spring 1 % off, cut", "preload", _preload_patch("models.vehicles.cut_vehicle")),
    CampaignFault(
        "one wave of the road 1 % higher", "road", attribute_patch(f"{TABLE_WRITER}:free_vehicle_table", _scaled_wave)
    ),
    CampaignFault(
        "road under one hub 0.1 mm higher",
        "road",
        attribute_patch("models.engines.cut_vehicle:cut_vehicle_table", _raised_sample),
    ),
    CampaignFault(
        "axes of springs fixed in space",
        "frame",
        attribute_patch("models.multibody.plain.parts:frame_of", lambda real: lambda part, default: None),
    ),
    CampaignFault(
        "wheels of a trailer keep to the car's heading",
        "towing",
        attribute_patch(
            f"{TABLE_WRITER}:free_vehicle_table", _towed_marks_cleared(at.OF_TYRES, at.TYRES, at.PER_TYRE, at.TOWED)
        ),
    ),
    CampaignFault(
        "springs of a trailer keep to the car's heading",
        "towing",
        attribute_patch(
            f"{TABLE_WRITER}:free_vehicle_table", _towed_marks_cleared(at.OF_PARTS, at.PARTS, PER_PART, FRAME)
        ),
    ),
    CampaignFault("bars 1 % stiffer, on tyres", "bar", attribute_patch(f"{TABLE_WRITER}:_bar_rows", _stiff_bars)),
    CampaignFault("a bar turned round, cut", "bar", attribute_patch(f"{CUT_TABLE}:_element_numbers", _turned_bar)),
    CampaignFault(
        "inertia of the chassis 1 % off, on tyres",
        "inertia",
        attribute_patch("models.systems.handling.run:LoadedVehicle", _changed_inertia(lambda inertia: 1.01 * inertia)),
    ),
    CampaignFault(
        "products of inertia with the other sign, cut",
        "inertia",
        attribute_patch("models.engines.cut_vehicle:LoadedVehicle", _changed_inertia(_turned_products)),
    ),
    CampaignFault(
        "shares of brake and drive swapped in the table",
        "packing",
        attribute_patch(f"{TABLE_WRITER}:_tyre_row", _swapped_numbers(at.BRAKED, at.DRIVEN)),
    ),
    CampaignFault(
        "stiffness and damping swapped in the table, cut",
        "packing",
        attribute_patch(f"{CUT_TABLE}:_element_numbers", _swapped_numbers(cut_at.STIFFNESS, cut_at.DAMPING)),
    ),
    CampaignFault(
        "cornering stiffness and roll steer swapped in the table, cut",
        "packing",
        attribute_patch(f"{CUT_TABLE}:_hub_numbers", _swapped_numbers(cut_at.CORNERING, cut_at.ROLL_STEER)),
    ),
)

CAMPAIGN = Campaign("planted.written", "what engines of a car share", "rolling-vehicle", CHECKS, FAULTS)
