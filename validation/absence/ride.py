"""Absence checks of the ride scene: an effect that the scene and its vehicle do not name is not imported and adds no
state and no callback.

Positive controls stand beside: an effect in the scene changes the counts as its file declares.
"""

import json
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from models.core.tables import write_table
from models.engines.spatial_protocol import build
from models.ride.excited import vehicle_with_road
from models.ride.weighting import system_with_weightings
from models.systems.ride import of_scene
from models.systems.ride.run import run
from models.systems.ride.scene import RideScene
from models.vehicles.linear_vehicle import LinearVehicle
from models.vehicles.spatial_linear import linearise, wheels
from models.vehicles.vehicle_file import load_vehicle
from validation.absence.probes import user_functions
from validation.common.rows import Observed, Row, System, behaviour_row
from validation.ride.rides import paper_road

SYSTEM: System = "effects"
SPEEDS = (10.0, 20.0, 30.0)
FOREIGN_MODULES = (
    "exudyn",
    "mujoco",
    "numba",
    "pyopencrg",
    "slycot",
    "models.engines",
    "models.contact",
    "models.systems.pitch_plane.effects",
    "models.drift",
    "models.road.fitted",
    "models.road.isotropic",
    "models.ride.varying_speed",
    "models.ride.monte_carlo",
    "models.ride.frequency",
)
"""Modules that a linear ride of the reference at constant speeds must not import."""

WEIGHTED_OUTPUTS = (("body centre", "Wk"), ("left occupant", "Wd"))
ENGINES = ("reference",)
SPEED = 20.0
BARE_SCENE: dict[str, Any] = {
    "title": "bare",
    "system": "ride",
    "vehicle": {"file": "seven_freedoms"},
    "road": {"left_right": "equal", "front_rear": "equal"},
    "speeds": {"values": [SPEED]},
}
ONE_TRACK: dict[str, Any] = {"left_right": "equal", "front_rear": "equal"}
HAND_WRITTEN_TABLES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "curves": (
        {"vehicle": {"file": "quarter_car_nonlinear", "small_motion": True}},
        {"vehicle": {"file": "quarter_car_nonlinear"}},
    ),
    "varying_speed": ({}, {"speeds": None, "drive": {"time": [0.0, 0.5], "speed": [18.0, 22.0]}}),
    "measured_road": ({}, {"road": {**ONE_TRACK, "file": "road.csv", "track_width": 1.5}}),
}


def write(scene_folder: Path) -> None:
    """Write road files of two tracks, a kilometre long, made of waves whose amplitudes grow with their lengths."""
    s = 0.5 * np.arange(2001)
    bends = 2.0 * np.pi / np.geomspace(1.5, 100.0, 60)
    turns = np.random.default_rng(1).uniform(0.0, 2.0 * np.pi, (2, 60))
    tracks = [(np.cos(np.outer(s, bends) + turn) / bends).sum(axis=1) * 1e-3 for turn in turns]
    write_table(scene_folder / "road.csv", {"s": ("m", s), "left": ("m", tracks[0]), "right": ("m", tracks[1])})


def counts_and_path(scene: RideScene, engine: str) -> tuple[dict[str, int], bytes]:
    """Counts of the components of a ride scene's vehicle and road (states, delays, nonlinear springs, ...), and the
    standard deviations of its outputs as bytes."""
    vehicle = of_scene.vehicle_of(scene)
    with mock.patch.object(of_scene, "fitted_road", wraps=of_scene.fitted_road) as fitted:
        road = of_scene.excitation_of(scene, wheels(vehicle))
    system = system_with_weightings(
        vehicle_with_road(of_scene.linear_vehicle(vehicle, engine)(SPEED), road, SPEED), scene.weighting
    )
    in_time = of_scene.needs_run_in_time(scene)
    counts = {
        "states": len(system.A),
        "preloads": int(vehicle.gravity > 0.0),
        "fits": min(fitted.call_count, 1),
        "delays": sum(length > 0.0 for length in road.lengths),
        "drives": int(scene.drive is not None),
        "heights": len(np.unique(sum(road.heights), axis=0)),
        "bent springs": sum(spring.is_nonlinear for spring in vehicle.springs) if in_time else 0,
        "tyres that lift": sum(tyre.pushes_only for tyre in vehicle.tyres),
    }
    result = run(scene, engine, **({"sampling": _with_fewest_copies()} if in_time else {}))
    return counts, result["deviation"].tobytes()


def _with_fewest_copies() -> Any:
    """Settings with the smallest allowed number of Monte Carlo copies."""
    from models.systems.ride.nonlinear import RunSampling

    return RunSampling(copies=2, lasting=0.1)


PROBE_SCRIPT = """
import json, sys
from models.systems.ride.run import run
from models.systems.ride.scene import build
run(build({"title": "probe", "system": "ride", "vehicle": {"file": "r19_ride"},
           "speeds": {"start": 10.0, "stop": 20.0, "count": 2}}), sys.argv[1])
print(json.dumps(sorted(sys.modules)))
"""
"""Runs a linear ride by an engine in a process of its own and says what it imported."""


def imported_modules(engine: str) -> list[str]:
    """Modules of the list FOREIGN_MODULES that have been imported after a linear ride in a fresh process."""
    command = [sys.executable, "-c", PROBE_SCRIPT, engine]
    completed_process = subprocess.run(command, capture_output=True, text=True, check=True)
    modules = json.loads(completed_process.stdout.splitlines()[-1])
    return [
        name
        for name in FOREIGN_MODULES
        if any(package == name or package.startswith(f"{name}.") for package in modules)
    ]


def state_count(weighting_of_output: dict[str, str]) -> int:
    """Number of states of the linear system of the vehicle R19-ride with its road filters and the weighting filters
    (output -> weighting)."""
    vehicle = _linear_vehicle("r19_ride")
    return len(
        system_with_weightings(vehicle_with_road(vehicle, paper_road(vehicle.wheels), SPEEDS[0]), weighting_of_output).A
    )


def count_of_linearisations(vehicle_name: str) -> int:
    """How often a sweep over SPEEDS linearises a vehicle."""
    with mock.patch.object(of_scene, "linearise", wraps=linearise) as watched_linearise:
        linear = of_scene.linear_vehicle(load_vehicle(vehicle_name))
        for speed in SPEEDS:
            linear(speed)
    return watched_linearise.call_count


def count_of_noisy_outputs(tyre_damping: float) -> int:
    """Number of the half car's outputs that white noise enters directly, with this tyre damping (N s/m)."""
    half_car = load_vehicle("half_car")
    damped = replace(half_car, tyres=tuple(replace(tyre, damping=tyre_damping) for tyre in half_car.tyres))
    vehicle = of_scene.linear_vehicle(damped)(SPEEDS[0])
    system = vehicle_with_road(vehicle, paper_road(vehicle.wheels), SPEEDS[0])
    return sum(any(d[i].any() for d in system.D) for i in range(len(system.C)))


def curve_and_callback_counts(vehicle_name: str) -> dict[str, tuple[int, int]]:
    """Engine -> numbers of spring curves and of callbacks in its model of a vehicle. Callbacks of Exudyn are counted
    over the items of its system."""
    counts = {}
    for engine in ("exudyn", "mujoco"):
        model = build(engine, load_vehicle(vehicle_name))
        plan = model.plan()
        counted = user_functions(model) if engine == "exudyn" else plan["callbacks"]
        counts[engine] = (plan["curves"], counted)
    return counts


@cache
def _linear_vehicle(vehicle_name: str) -> LinearVehicle:
    return of_scene.linear_vehicle(load_vehicle(vehicle_name))(SPEEDS[0])


def rows(is_quick: bool = False) -> list[Row]:
    """Report rows: modules, states, linearisations, callbacks and noise inputs of rides without effects, each next to a
    positive control. If ``is_quick``, without the modules, which need a fresh process."""
    names = ("quarter_car", "quarter_car_nonlinear")
    bare, curved = (curve_and_callback_counts(name) for name in names)
    why = "counted from outside, in the modules of a fresh process, in the engine's items, in the system's size"
    quantity = "modules of engines, of the compiler and of other routes that a linear ride of the reference imports"
    counted = () if is_quick else (len(imported_modules("reference")),)
    return [
        *(Observed("absent.ride.imports", SYSTEM, quantity, count, "").at_most(0, why, "none") for count in counted),
        behaviour_row(
            "absent.ride.states",
            SYSTEM,
            "number of states of R19-ride alone, with the filter Wk, and with Wk and Wd",
            ", ".join(str(state_count(dict(WEIGHTED_OUTPUTS[:count]))) for count in range(3)),
            "42, 50, 56",
            "twice 19 freedoms, two filters at each of two axles; Wk has 8 states, Wd 6",
        ),
        behaviour_row(
            "absent.ride.speed",
            SYSTEM,
            "number of linear vehicles that three speeds need, for R19-ride and for R19-free",
            f"{count_of_linearisations('r19_ride')}, {count_of_linearisations('r19_free')}",
            "1, 3",
            "without side forces and drag nothing depends on the speed",
        ),
        behaviour_row(
            "absent.ride.curves",
            SYSTEM,
            "number of curves and callbacks of a quarter car, and of a quarter car with three curves",
            f"{_counts_text(bare)}; {_counts_text(curved)}",
            "exudyn 0, 1, mujoco 0, 1; exudyn 3, 2, mujoco 3, 1",
            "one callback reads the road, in MuJoCo all forces stand in it; a bent spring of Exudyn has its own",
        ),
        behaviour_row(
            "absent.ride.noise",
            SYSTEM,
            "number of outputs of a half car that white noise reaches, with tyres without damping and with damping",
            f"{count_of_noisy_outputs(0.0)}, {count_of_noisy_outputs(100.0)}",
            "0, 2",
            "the road's rate goes through tyre damping alone",
        ),
    ]


def _counts_text(counts_by_engine: dict[str, tuple[int, int]]) -> str:
    return ", ".join(f"{engine} {curves}, {called}" for engine, (curves, called) in counts_by_engine.items())
