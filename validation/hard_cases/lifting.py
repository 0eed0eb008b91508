"""Hard cases of wheels that leave the road and land: from a height, on stiff tyres, at zero load, on kerbs and coarsely
sampled roads, with a car in space and above cut hubs.

The half car on a flat road has an exact path, piece by piece between the switches (``bounces``). Its error
is a velocity, the coarsest of its states: a landing within a step costs the square of the step.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from models.core.signals import Signal
from models.core.tables import write_table
from models.engines import protocol
from models.engines.assembly import Assembly
from models.engines.spatial_protocol import INTEGRATORS
from models.engines.spatial_protocol import build as build_in_space
from models.engines.spatial_reference import SpatialReference
from models.road.iso8608 import iso8608_road
from models.road.polyline import PolylineProfile
from models.road.signal import RoadUnderWheels
from models.systems.hub_forces.measurement import road_under_wheels, true_run
from models.systems.pitch_plane.scene import assembly_of_scene
from models.systems.pitch_plane.scene import build as build_scene
from models.vehicles.cut_vehicle import cut_at_hubs
from models.vehicles.kinematics import Kinematics
from models.vehicles.vehicle_file import load_vehicle
from validation.common.bounces import BouncingVehicle, bounce_energy
from validation.hard_cases import setups
from validation.hard_cases.case import IMPLEMENTATIONS, HardCase, OutcomeWord

ASYMMETRIC_TWIN = "asymmetric_twin"
STEP, LONGEST_DURATION = 1e-4, 0.6
"""Step (s) of most runs, and their duration (s), which includes several landings of both wheels."""
FALLING_STATE = np.array([-0.3, -0.2, -0.4, 0.05, 0.0, 0.0, 0.0, 0.0])
"""Initial state with both wheels in the air, the front higher."""
ErrorFunction = Callable[[str, Path], float]


def lifting_half_car(start_state: np.ndarray, geometry: str, parameter_changes: dict[str, float]) -> Assembly:
    """The asymmetric half car on tyres that can lift off, above a flat road."""
    return setups.vehicle(ASYMMETRIC_TWIN, geometry, start_state, {"lift_off": {}}, **parameter_changes)


def exact_path_case(
    time_step: float = STEP, start_state: np.ndarray = FALLING_STATE, **parameter_changes: float
) -> ErrorFunction:
    """Case: a bouncing vehicle. Error: largest difference of the states (m, rad, m/s, rad/s) from the exact path."""

    def error(engine_name: str, work_folder: Path) -> float:
        assembly = lifting_half_car(start_state, "linear", parameter_changes)
        states = setups.run(engine_name, assembly, time_step, LONGEST_DURATION).states
        stride = max(1, round(time_step / STEP))
        exact = BouncingVehicle(assembly, STEP if stride > 1 else time_step).path(
            assembly.initial, stride * (len(states) - 1)
        )
        return setups.largest_magnitude(states - exact[::stride])

    return error


def energy_gain_case(**parameter_changes: float) -> ErrorFunction:
    """Case: a vehicle that falls and bounces. Error: largest gain of energy divided by the range of its vertical
    kinetic energy."""

    def error(engine_name: str, work_folder: Path) -> float:
        assembly = lifting_half_car(FALLING_STATE, "exact", parameter_changes)
        states = setups.run(engine_name, assembly, STEP, LONGEST_DURATION).states
        energies = bounce_energy(assembly, states)
        return float(
            (energies - np.minimum.accumulate(energies)).max() / np.ptp(states[:, 6] ** 2 * assembly.parameters.m3 / 2)
        )

    return error


def motion_at_zero_load(engine_name: str, work_folder: Path) -> float:
    """Case: without gravity, wheels just touch the road at zero load. Error: largest motion, which must be 0, without
    growth of rounding errors."""
    assembly = lifting_half_car(np.zeros(8), "linear", {"g": 0.0})
    return setups.largest_magnitude(setups.run(engine_name, assembly, 1e-3, 1.0).states)


def thrown_up_error(engine_name: str, work_folder: Path) -> float:
    """Case: wheels thrown up from rest at 5 m/s. Error: largest difference of the states from the exact path."""
    start = setups.vehicle(ASYMMETRIC_TWIN, "linear").initial + np.array([0, 0, 0, 0, -5.0, -5.0, 0, 0])
    return exact_path_case(start_state=start)(engine_name, work_folder)


def half_car_on_road(scene_table: dict[str, Any], work_folder: Path, time_step: float, duration: float) -> Assembly:
    """The asymmetric half car with lift-off on a road given as a scene's table."""
    return assembly_of_scene(
        build_scene(
            {
                "title": "hard case",
                "vehicle": {"parameters": ASYMMETRIC_TWIN},
                "run": {"duration": duration, "step": time_step},
                "effects": {"road": scene_table, "lift_off": {}},
            },
            "",
            work_folder,
        )
    )


def tight_solution_error(engine_name: str, assembly: Assembly, time_step: float, duration: float) -> float:
    """Largest difference of a run's states from the solution at tight tolerance; infinite if no wheel left the road."""
    states, exact = (
        setups.run(engine_name, assembly, time_step, duration).states,
        setups.tight_solution(assembly, time_step, duration).states,
    )
    air = exact[:, 0] < _road_heights(assembly.input, time_step, len(exact))
    return setups.largest_magnitude(states - exact) if air.any() else np.inf


def _road_heights(road: Signal | None, time_step: float, sample_count: int) -> np.ndarray:
    """Road heights (sample_count,) in m, positive down, under the front wheel."""
    return np.zeros(sample_count) if road is None else road.sample(0.0, time_step, sample_count)[:, 0]


def coarse_road_error(engine_name: str, work_folder: Path) -> float:
    """Case: bumps of 80 mm at 25 m/s, from a file with a sample every 0.5 m. Error: difference of the states from the
    solution at tight tolerance."""
    s = 0.5 * np.arange(121)
    height = 0.08 * np.maximum(np.sin(2 * np.pi * s / 7.3), 0.0) * (s > 3.0)
    write_table(work_folder / "bumps.csv", {"s": ("m", s), "left": ("m", height), "right": ("m", height)})
    road = {"source": "csv", "file": "bumps.csv", "track": "left", "speed": 25.0, "beyond_end": "refused"}
    return tight_solution_error(engine_name, half_car_on_road(road, work_folder, STEP, 1.0), STEP, 1.0)


def kerb_error(engine_name: str, work_folder: Path) -> float:
    """Case: a ramp of 0.1 m height over 0.1 m length with sharp corners, at 15 m/s, which throws the front wheel off
    the road. Error: difference of the states from the solution at tight tolerance."""
    profile = PolylineProfile.through([-5.0, 3.0, 3.1, 20.0], [0.0, 0.0, -0.1, -0.1])
    base = lifting_half_car(setups.vehicle(ASYMMETRIC_TWIN).initial, "exact", {})
    road = RoadUnderWheels(profile, 15.0, base.parameters.a + base.parameters.b, (3.0, 3.1))
    return tight_solution_error(engine_name, base.with_input("road", road), STEP, 0.5)


def dropped_car_error(engine_name: str, work_folder: Path) -> float:
    """Case: a car with 19 degrees of freedom dropped from 0.5 m. Error: relative difference of an engine's
    accelerations along its path from the hand-written equations; for these, of the centre of mass' acceleration from
    gravity."""
    car = replace(load_vehicle("r19_ride"), gravity=9.81).with_tyres(pushes_only=True)
    n = len(car.coordinates())
    start = np.array(
        [0.5 if freedom == "z" and car.body(name).parent is None else 0.0 for name, freedom in car.coordinates()]
    )
    written = SpatialReference(car)
    if engine_name == "reference":
        fall, motion = written.acceleration(0.0, start, np.zeros(n)), Kinematics(car)
        pull = sum(body.mass * (motion.shift(body.name, body.position)[2] @ fall + 9.81) for body in car.bodies)
        return float(abs(pull) / (9.81 * sum(body.mass for body in car.bodies)))
    settings = setups.Settings(INTEGRATORS[engine_name], 5e-4, 0.5)
    model = build_in_space(engine_name, car, settings)
    run, worst = model.run(start, np.zeros(n)), 0.0
    for q, v in list(zip(run.positions, run.rates, strict=True))[::50]:
        wanted = written.acceleration(0.0, q, v)
        worst = max(worst, float(np.abs(model.acceleration(0.0, q, v) - wanted).max() / np.abs(wanted).max()))
    return worst


def largest_hub_force_in_air(engine_name: str, work_folder: Path) -> float:
    """Case: hub forces on a class F road. Error: largest force (N) or moment on a hub whose wheel is in the air;
    infinite if no wheel is."""
    car = cut_at_hubs(load_vehicle("r19_free").with_tyres(pushes_only=True), "body")
    left, right = (iso8608_road("F", seed) for seed in (1, 2))
    drive = road_under_wheels(car, left, right, 20.0, 1e-3, 1500)
    wrenches = true_run(engine_name, car, drive, "inertial", 1e-3, 1.5).wrenches
    air = wrenches[:, :, 2] <= 0.0
    return float(np.abs(wrenches[air]).max()) if air.any() else np.inf


def linear_tyre_naive_result(work_folder: Path) -> str:
    """Result without the remedy, as text: the paper's linear tyre in the same fall."""
    assembly = setups.vehicle(ASYMMETRIC_TWIN, "linear", FALLING_STATE)
    states, p = setups.run("reference", assembly, STEP, LONGEST_DURATION).states, assembly.parameters
    return f"the linear tyre pulls with up to {-(p.k1 * states[:, 0] + p.d1 * states[:, 4]).min():.0f} N"


def hard_tyre_naive_result(work_folder: Path) -> str:
    """Result without the guard, as text: a stable step that jumps over landings, without the check after the run."""
    with mock.patch.object(protocol, "check_resolved", lambda *_: None):
        velocity_error = exact_path_case(2e-3, k1=2e7, k2=2e7)("reference", work_folder)
    return f"stable, finite, a wheel's velocity off by {velocity_error:.2g} m/s"


THROWN_REASON = "a corner of the force within a step costs its square"
RAISED: dict[str, OutcomeWord] = dict.fromkeys(IMPLEMENTATIONS, "raised")
PATH, STATES = "exact path, piece by piece", "m, rad, m/s, rad/s"
UNDAMPED_PARAMETERS = dict.fromkeys(("d1", "d2", "d3", "d4"), 0.0)
HIGH_START_STATE = np.array([-5.0, -5.0, -5.0, 0.0, 12.0, 12.0, 12.0, 0.0])
EXACT: tuple[tuple[str, str, float, ErrorFunction], ...] = (
    ("both wheels in the air", "no tyre holds anything", 1e-4, exact_path_case()),
    (
        "fall from five metres",
        "lands at 15 m/s, many times the tyres' depth at rest",
        1e-3,
        exact_path_case(start_state=HIGH_START_STATE),
    ),
    ("tyres without damping", "every landing is thrown back", 1e-4, exact_path_case(d1=0.0, d2=0.0)),
    (
        "tyre dampers of 5 kN s/m",
        "would pull before the spring lets go, and jump where it lands",
        1e-4,
        exact_path_case(d1=5e3, d2=5e3),
    ),
    ("tyres of 20 kN/mm", "a landing lasts 3 ms", 2e-3, exact_path_case(5e-5, k1=2e7, k2=2e7)),
    ("thrown up in the first step", "the tyres let go at once", 1e-5, thrown_up_error),
)
CASES = (
    *(
        HardCase(
            name,
            hard,
            PATH,
            STATES,
            tolerance,
            THROWN_REASON,
            error,
            naive_result=linear_tyre_naive_result if error is EXACT[0][3] else None,
        )
        for name, hard, tolerance, error in EXACT
    ),
    HardCase(
        "bounce without any damper",
        "every error of a landing stays",
        "gains no energy",
        "of the motion",
        1e-4,
        THROWN_REASON,
        energy_gain_case(**UNDAMPED_PARAMETERS),
    ),
    HardCase(
        "tyres of 20 kN/mm, step of 2 ms",
        "stable on the road, but a landing has two steps",
        "fails, and says when",
        "",
        0.0,
        "exact",
        exact_path_case(2e-3, k1=2e7, k2=2e7),
        RAISED,
        hard_tyre_naive_result,
    ),
    HardCase(
        "at rest at the switch",
        "no gravity: the load is zero, and every rounding switches",
        "stays at rest",
        STATES,
        1e-15,
        "exact",
        motion_at_zero_load,
    ),
    HardCase(
        "kerb with corners",
        "the road's rate jumps, and the wheels leave it",
        "tight tolerance",
        STATES,
        2e-2,
        "a jump of the rate within a step costs the step itself",
        kerb_error,
        answer_independence="native",
    ),
    HardCase(
        "bumps in a file of few samples",
        "the spline between samples throws the wheels",
        "tight tolerance",
        STATES,
        1e-4,
        THROWN_REASON,
        coarse_road_error,
        answer_independence="native",
    ),
    HardCase(
        "car dropped in space",
        "four wheels in the air, pushed down by their springs",
        "written accelerations along the path",
        "of the largest",
        1e-11,
        "the order of additions, large forces on light wheels",
        dropped_car_error,
    ),
    HardCase(
        "wheels in the air above a cut",
        "a transducer feels nothing of the road",
        "no force, no moment",
        "N",
        1e-9,
        "the law has a zero there",
        largest_hub_force_in_air,
    ),
)
