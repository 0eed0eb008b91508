"""A quarter vehicle under a sampled brake controller, by twinrig and by an accurate reference that shares only the
controller.

The reference integrates m u' = -F, J w' = r F - T by DOP853 within every sample, mu straight from the magic formula,
T by the brake's law along the chamber's exponential, and the wheel's stop and its release as events.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from models.brake.brake import Brake, brakes_of_wheels
from models.brake.controller import SAMPLING_PERIOD, Controller, Sample
from models.brake.plane_vehicle import GRAVITY
from models.brake.pressure import APPLY, RELEASE, BrakeChambers
from models.brake.quarter import QuarterVehicle
from models.systems.braking.march import braked_vehicle_on_tyres
from models.tyre.magic_formula import NAMED_SURFACES, table_of_surface

SUPPLY, FILL, EMPTY = 10.0, 0.15, 0.1
LAST_SPEED = 0.06
"""Speed (m/s) at which the reference's integration ends; from there the locked wheel slides to rest."""
RoadStretches = Sequence[tuple[float, Callable[[float], float]]]
"""Stretches of a road: where each begins (m), and its friction as a function of slip."""


def twinrig_distance(
    quarter_car: QuarterVehicle,
    brake: Brake,
    surface_name: str,
    controller: Controller,
    speed: float,
    substep_count: int,
) -> float:
    """Stopping distance (m) of the quarter vehicle by twinrig, from a speed (m/s)."""
    chambers = BrakeChambers(np.array([FILL]), np.array([EMPTY]), SUPPLY)
    vehicle = braked_vehicle_on_tyres(
        quarter_car.plane, [table_of_surface(surface_name)], brakes_of_wheels(brake), chambers, substeps=substep_count
    )
    return float(vehicle.run(controller, speed).states[-1, 0, 0])


def reference_distance(
    quarter_car: QuarterVehicle,
    brake: Brake,
    surface_name: str,
    controller: Controller,
    speed: float,
    tolerance: float = 1e-10,
) -> float:
    """Stopping distance (m) of the quarter vehicle on a surface by the reference solver, at a relative tolerance."""
    curve = NAMED_SURFACES[surface_name][0]
    return reference_distance_on_stretches(
        quarter_car, brake, [(0.0, lambda s: float(curve(np.array(s))))], controller, speed, tolerance
    )


def reference_distance_on_stretches(
    quarter_car: QuarterVehicle,
    brake: Brake,
    road_stretches: RoadStretches,
    controller: Controller,
    speed: float,
    tolerance: float = 1e-10,
    solver_name: Any = "DOP853",
) -> float:
    """Stopping distance (m) by the reference solver on a road with several stretches; solver_name: name of scipy's
    solver."""
    y, pressure, torque, number = np.array([0.0, speed, speed / quarter_car.radius]), 0.0, 0.0, 0
    while y[1] > LAST_SPEED:
        sample = Sample(
            number, round(number * SAMPLING_PERIOD * 1e9), y[2:] * quarter_car.radius, True, SUPPLY, float(y[1])
        )
        valve = int(np.asarray(controller.sample(sample).valves)[0])
        law = _brake_law(pressure, torque, valve, brake)
        y = _state_after_sample(
            y, law, quarter_car, road_stretches, {"method": solver_name, "rtol": tolerance, "atol": 1e-2 * tolerance}
        )
        pressure, torque, number = law(SAMPLING_PERIOD)[0], law(SAMPLING_PERIOD)[1], number + 1
    slowing = GRAVITY * _friction_at(y[0], road_stretches)[0](1.0)  # so slow, all is applied and the wheel stands
    return float(y[0] + max(y[1], 0.0) ** 2 / (2.0 * slowing))


def _brake_law(
    start_pressure: float, start_torque: float, valve_command: int, brake: Brake
) -> Callable[[float], tuple[float, float]]:
    """Returns a function of the time (s) since the sample's start that gives brake pressure (bar) and torque (N m)."""

    def law_at(time_in_sample: float) -> tuple[float, float]:
        p = start_pressure
        if valve_command == APPLY:
            p = SUPPLY + (start_pressure - SUPPLY) * np.exp(-time_in_sample / FILL)
        elif valve_command == RELEASE:
            p = start_pressure * np.exp(-time_in_sample / EMPTY)
        rising_torque, falling_torque = (
            brake.rising * max(p - brake.push_out, 0.0),
            brake.falling * max(p - brake.release, 0.0),
        )
        return p, max(rising_torque, min(falling_torque, start_torque))

    return law_at


def _friction_at(position: float, road_stretches: RoadStretches) -> tuple[Callable[[float], float], float]:
    """Friction law mu(slip) at a position x (m), and the position (m) at which this stretch ends."""
    number = sum(begin <= position + 1e-10 for begin, _ in road_stretches[1:])
    return road_stretches[number][1], road_stretches[number + 1][0] if number + 1 < len(road_stretches) else np.inf


def _state_after_sample(
    start_state: np.ndarray,
    brake_law: Any,
    quarter_car: QuarterVehicle,
    road_stretches: RoadStretches,
    solver_options: dict[str, Any],
) -> np.ndarray:
    """Position (m), speed (m/s) and angular velocity of the wheel (rad/s) after a sample. A wheel that stops turning
    stays locked as long as its brake can hold it."""
    radius, inertia, load, time = quarter_car.radius, quarter_car.spin_inertia, quarter_car.mass * GRAVITY, 0.0
    mu, end = _friction_at(start_state[0], road_stretches)

    def force(slip: float) -> float:
        return load * mu(slip)

    def turning(t: float, q: np.ndarray) -> list[float]:
        f = force(min(max(1.0 - radius * q[2] / max(q[1], 1e-6), 0.0), 1.0))
        return [q[1], -f / quarter_car.mass, (radius * f - brake_law(t)[1]) / inertia]

    def stops(t: float, q: np.ndarray) -> float:
        return float(q[2])

    def lets_go(t: float, q: np.ndarray) -> float:
        return float(brake_law(t)[1] - radius * force(1.0))

    def sliding(t: float, q: np.ndarray) -> list[float]:
        return [q[1], -force(1.0) / quarter_car.mass, 0.0]

    def passes(t: float, q: np.ndarray) -> float:
        return float(min(end - q[0], 1.0))

    for event in (stops, lets_go, passes):
        event.terminal, event.direction = True, -1  # type: ignore[attr-defined]
    while time < SAMPLING_PERIOD:
        is_held = start_state[2] <= 1e-12 and brake_law(time)[1] > radius * force(1.0)
        solution = solve_ivp(
            sliding if is_held else turning,
            (time, SAMPLING_PERIOD),
            start_state,
            **solver_options,
            events=(lets_go if is_held else stops, passes),
        )
        time, start_state = float(solution.t[-1]), solution.y[:, -1].copy()
        if solution.t_events[1].size:
            mu, end = _friction_at(start_state[0], road_stretches)
        elif solution.status == 1:
            start_state[2] = 0.0
            if is_held:
                start_state[2] = 1e-9  # free again: the road turns it on
    return start_state
