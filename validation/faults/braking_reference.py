"""Faults planted in the inputs of the compiled step of braking on the suspension, which the independent reference sees.

A comparison of the engines sees none of them, as both use the same compiled forces.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from models.multibody import forces as at
from models.multibody.numbers import Handling
from models.multibody.parts import DAMPING, FRICTION, ON_TRAVEL, PER_PART, STIFFNESS
from models.multibody.tree import LOCAL, PER_POINT
from models.tyre.tyre_table import StackedTyreTables
from models.vehicles.spatial_linear import Preloads
from validation.braking import plain_brakes as laws
from validation.braking import plain_sprung as whole
from validation.braking.compiled_brakes import wheel_force_views
from validation.faults.campaign import Campaign, CampaignFault, Check
from validation.faults.patches import Patch, attribute_patch

ENGINE, STATES_COMPARED, DURATION = "exudyn", 20, 0.05
"""Engine with the faults (Python calls its steps, so that they can be patched); number of states compared; duration of
a run (s)."""
DIFFERENCE_BOUND = 1e-10


def _law_difference_check(
    compiled_and_plain_values: Callable[[int], tuple[np.ndarray, np.ndarray]], state_count: int = 60
) -> Callable[[], float]:
    """Returns a check's function: largest difference between compiled and plain code at ``state_count`` random
    states."""
    return lambda: laws.largest_difference(*compiled_and_plain_values(state_count))


def _acceleration_difference() -> float:
    """Largest relative difference of accelerations between the engine and plain code, for a vehicle built with the
    fault."""
    accelerations = whole.accelerations(whole.car_with_stops.__wrapped__(), ENGINE, STATES_COMPARED)
    return whole.relative_difference(accelerations, whole.plain_accelerations("bent", STATES_COMPARED))


def _stop_difference() -> float:
    return whole.path_difference(
        whole.run(whole.car_with_stops.__wrapped__(), ENGINE, DURATION), whole.plain_run("bent", DURATION)
    )


def _lagging_difference() -> float:
    path = whole.run(whole.car(), ENGINE, DURATION, with_lags=True)
    return whole.path_difference(path, whole.plain_run("car", DURATION, with_lags=True))


CHECKS = {
    "accelerations": Check(
        "accelerations at random states beside plain code", "by the largest", 1e-12, _acceleration_difference
    ),
    "stop": Check("a piece of a stop beside plain code", "m, rad, per s", DIFFERENCE_BOUND, _stop_difference),
    "lagging": Check("the same on tyres that lag", "m, rad, per s", DIFFERENCE_BOUND, _lagging_difference),
    "friction": Check(
        "friction by stacked tables", "by the largest", 1e-12, _law_difference_check(laws.friction_of_random_states)
    ),
    "tyre": Check("a braked wheel over a step", "by the largest", 1e-12, _law_difference_check(laws.tyre_reports)),
    "road": Check("surfaces under the wheels", "by the largest", 1e-12, _law_difference_check(laws.random_surfaces)),
    "pressure": Check(
        "pressures and torques along commands",
        "by the largest",
        1e-12,
        _law_difference_check(laws.torques_by_commands, 20),
    ),
    "relaxation": Check("slip angles that lag", "by the largest", 1e-12, _law_difference_check(laws.slip_lags)),
}


def _table_patch(change_car: Callable[[Handling], None]) -> Patch:
    """Fault: the car's parameter table is changed after it was filled."""

    def packed(original_function: Any) -> Any:
        def make(*arguments: Any, **keyword_arguments: Any) -> Handling:
            handling: Handling = original_function(*arguments, **keyword_arguments)
            change_car(handling)
            return handling

        return make

    return attribute_patch("models.brake.sprung:Handling", packed)


def _section_rows(handling_car: Handling, start_index: int, count_index: int, column_count: int) -> np.ndarray:
    """View of the rows (number of rows, width) of a section of the car's parameter table. ``start_index`` and
    ``count_index`` are the positions in the table's head of the section's start and number of rows.
    """
    begin, rows = int(handling_car.numbers[start_index]), int(handling_car.numbers[count_index])
    return handling_car.numbers[begin : begin + column_count * rows].reshape(rows, column_count)


def _rows_of_parts(handling_car: Handling) -> np.ndarray:
    return _section_rows(handling_car, at.OF_PARTS, at.PARTS, PER_PART)


def _exchange_spring_numbers(handling_car: Handling) -> None:
    """Fault: stiffness and damping of the first spring are exchanged."""
    first = _rows_of_parts(handling_car)[0]
    first[[STIFFNESS, DAMPING]] = first[[DAMPING, STIFFNESS]]


def _without_bars(handling_car: Handling) -> None:
    _rows_of_parts(handling_car)[len(handling_car.vehicle.springs) :, STIFFNESS] = 0.0


def _shift_stiffnesses(handling_car: Handling) -> None:
    """Fault: every spring has the stiffness of the previous spring in the table."""
    parts = _rows_of_parts(handling_car)
    parts[:, STIFFNESS] = np.roll(parts[:, STIFFNESS], 1)


def _moved_point(handling_car: Handling) -> None:
    _section_rows(handling_car, at.OF_POINTS, at.POINTS, PER_POINT)[0, LOCAL] += 0.01


def _softer_tyre(handling_car: Handling) -> None:
    handling_car.tyre_numbers(1)[at.VERTICAL] *= 0.99


def _damped_tyre(handling_car: Handling) -> None:
    handling_car.tyre_numbers(1)[at.VISCOUS] *= 1.3


def _remove_dry_friction(handling_car: Handling) -> None:
    _rows_of_parts(handling_car)[:, FRICTION] = 0.0


def _remove_curves(handling_car: Handling) -> None:
    _rows_of_parts(handling_car)[:, ON_TRAVEL] = 0.0


def _double_drag(handling_car: Handling) -> None:
    handling_car.numbers[at.DRAG] *= 2.0


def _preload_patch(change_preloads: Callable[[Preloads], Preloads]) -> Patch:
    return attribute_patch(
        "models.multibody.numbers:static_preloads", lambda real: lambda vehicle: change_preloads(real(vehicle))
    )


def _first_value_larger(named_values: dict[str, float]) -> dict[str, float]:
    """Copy of the values with the first value 1 % larger."""
    name = next(iter(named_values))
    return named_values | {name: 1.01 * named_values[name]}


def _march_patch(change_march: Callable[[Any, Any, np.ndarray, np.ndarray], Any]) -> Patch:
    """Patch of an engine's step under constant tyre forces; change_march(step, engine, q, v) replaces it."""
    return attribute_patch(
        "models.brake.sprung_step:march", lambda real: lambda *arguments: change_march(real, *arguments)
    )


def _euler_step(march_function: Any, engine_model: Any, q: np.ndarray, v: np.ndarray) -> bool:
    """Fault: the engine's step uses the accelerations at its start (explicit Euler) instead of Runge-Kutta."""
    rates = engine_model.acceleration(0.0, q, v)
    q += engine_model.step * v
    v += engine_model.step * rates
    return True


def _larger_spin_moment(march_function: Any, engine_model: Any, *state: np.ndarray) -> Any:
    wheel_force_views(engine_model.numbers).spin_moments[:] *= 1.01
    return march_function(engine_model, *state)


def _forces_exchanged(march_function: Any, engine_model: Any, *state: np.ndarray) -> Any:
    """Fault: the forces of the front wheels are exchanged."""
    forces = wheel_force_views(engine_model.numbers).forces
    forces[:2] = forces[1::-1].copy()
    return march_function(engine_model, *state)


def _stacked_tables_patch(change_friction: Callable[[StackedTyreTables], tuple[np.ndarray, np.ndarray]]) -> Patch:
    """Patch that replaces longitudinal friction mu_x and lateral friction h in the stacked tyre tables for compiled
    code."""

    def stack(original_function: Any) -> Any:
        return lambda tyres: _with_friction(original_function(tyres), change_friction)

    return attribute_patch("validation.braking.plain_brakes:stacked_tables", stack)


def _with_friction(
    tyre_tables: StackedTyreTables, change_friction: Callable[[StackedTyreTables], tuple[np.ndarray, np.ndarray]]
) -> StackedTyreTables:
    mu_x, h = change_friction(tyre_tables)
    return StackedTyreTables(
        tyre_tables.angles,
        tyre_tables.slips,
        tyre_tables.loads,
        np.ascontiguousarray(mu_x),
        tyre_tables.g,
        np.ascontiguousarray(h),
    )


def _heavy_wheel(original_function: Any) -> Any:
    """Fault: a wheel's inertia is 1 % too large."""
    return lambda tables, under, motion, load, braked: original_function(
        tables, under, motion, load, replace(braked, inertia=1.01 * braked.inertia)
    )


def _exchanged_shares(original_function: Any) -> Any:
    """Fault: the shares of the first and second stretch of road are exchanged."""

    def under(*arguments: Any) -> np.ndarray:
        surface: np.ndarray = original_function(*arguments)
        mixed = surface[:, 0] != surface[:, 1]
        surface[mixed, 2] = 1.0 - surface[mixed, 2]
        return surface

    return under


def _larger_torque(original_function: Any) -> Any:
    """Fault: brake torques are 1 % too large."""

    def planted(*arguments: Any) -> None:
        original_function(*arguments)
        arguments[-1][:] *= 1.01

    return planted


def _late_torque(original_function: Any) -> Any:
    """Fault: brake torques at a step's end equal those at its start."""

    def planted(*arguments: Any) -> None:
        original_function(*arguments)
        arguments[-1][1:] = arguments[-1][:-1].copy()

    return planted


def _valves_without_delay(original_function: Any) -> Any:
    """Fault: valves have no delay within a sample."""

    def planted(valve_states: Any, sample: Any, air_system: Any, brake_chambers: Any, *further_arguments: Any) -> None:
        whole_samples = sample * int(brake_chambers.delay / sample)
        original_function(
            valve_states, sample, air_system, brake_chambers._replace(delay=whole_samples), *further_arguments
        )

    return planted


def _longer_relaxation(original_function: Any) -> Any:
    """Fault: relaxation lengths are 1 % too long."""
    return lambda state, time, steer, slope, length, lag: original_function(
        state, time, steer, slope, 1.01 * length, lag
    )


def _relaxation_patch(change_lag_inputs: Callable[..., tuple[Any, ...]]) -> Patch:
    """Patch that changes the inputs by which lagging slip angles are advanced for a vehicle on its suspension."""
    return attribute_patch(
        "models.brake.sprung_relaxation:advance_contact_lag",
        lambda real: lambda *arguments: real(*change_lag_inputs(*arguments)),
    )


def _lag_over_half_step(tyre_contacts: Any, half_step: float, *further_arguments: Any) -> tuple[Any, ...]:
    """Fault: lagging slip angles are advanced without the half of the previous step."""
    lag = further_arguments[1]
    lag.behind[0] = 0.0
    return tyre_contacts, half_step, *further_arguments


def _faster_lag(tyre_contacts: Any, *further_arguments: Any) -> tuple[Any, ...]:
    """Fault: lagging slip angles are advanced with wheel speeds that are 1 % too large."""
    return tyre_contacts._replace(along=1.01 * tyre_contacts.along), *further_arguments


PLAIN_BENCH_MODULE, COMPILED_MODULE = "validation.braking.plain_brakes", "validation.braking.compiled_brakes"
FAULTS = (
    CampaignFault(
        "preload of a spring 1 % too large",
        "vehicle",
        _preload_patch(lambda p: p._replace(parts=_first_value_larger(p.parts))),
    ),
    CampaignFault(
        "static load of a tyre 1 % too large",
        "vehicle",
        _preload_patch(lambda p: p._replace(tyres=_first_value_larger(p.tyres))),
    ),
    CampaignFault("stiffness and damping of a spring exchanged", "table", _table_patch(_exchange_spring_numbers)),
    CampaignFault("stiffness of a spring's neighbour", "table", _table_patch(_shift_stiffnesses)),
    CampaignFault("anti-roll bars without stiffness", "table", _table_patch(_without_bars)),
    CampaignFault("a spring's point 10 mm ahead", "table", _table_patch(_moved_point)),
    CampaignFault("springs without dry friction", "table", _table_patch(_remove_dry_friction)),
    CampaignFault("springs without curves of travel", "table", _table_patch(_remove_curves)),
    CampaignFault("drag twice as large", "table", _table_patch(_double_drag)),
    CampaignFault("damping of a tyre 30 % too large", "table", _table_patch(_damped_tyre)),
    CampaignFault("stiffness of a tyre 1 % too small", "table", _table_patch(_softer_tyre)),
    CampaignFault(
        "brake torque of the step's start",
        "step",
        attribute_patch("models.brake.samples:advance_by_valves", _late_torque),
    ),
    CampaignFault("Euler's step for Runge and Kutta's", "step", _march_patch(_euler_step)),
    CampaignFault("moment on turning wheels 1 % too large", "step", _march_patch(_larger_spin_moment)),
    CampaignFault("forces of the front tyres exchanged", "step", _march_patch(_forces_exchanged)),
    CampaignFault("slip angles that lag over half of each step", "lagging", _relaxation_patch(_lag_over_half_step)),
    CampaignFault("slip angles that lag by a speed 1 % too large", "lagging", _relaxation_patch(_faster_lag)),
    CampaignFault(
        "brake torque 1 % too large", "brake", attribute_patch("models.brake.samples:advance_by_valves", _larger_torque)
    ),
    CampaignFault(
        "valves that answer at once",
        "brake",
        attribute_patch(f"{PLAIN_BENCH_MODULE}:advance_by_valves", _valves_without_delay),
    ),
    CampaignFault("cornering stiffness 30 % too large", "tyre", _stacked_tables_patch(lambda t: (t.mu_x, 1.3 * t.h))),
    CampaignFault(
        "friction along the wheel 1 % too large", "tyre", _stacked_tables_patch(lambda t: (1.01 * t.mu_x, t.h))
    ),
    CampaignFault(
        "loads packed one node late", "tyre", _stacked_tables_patch(lambda t: (t.mu_x, np.roll(t.h, 1, axis=2)))
    ),
    CampaignFault(
        "inertia of a wheel 1 % too large", "wheel", attribute_patch(f"{COMPILED_MODULE}:tyre", _heavy_wheel)
    ),
    CampaignFault(
        "shares of two stretches exchanged",
        "road",
        attribute_patch(f"{COMPILED_MODULE}:under_wheels", _exchanged_shares),
    ),
    CampaignFault(
        "relaxation length 1 % too long", "tyre", attribute_patch(f"{COMPILED_MODULE}:lag_on", _longer_relaxation)
    ),
)

CAMPAIGN = Campaign("planted.braking_reference", "braking on the suspension", "anti-lock", CHECKS, FAULTS)
