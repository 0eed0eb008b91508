"""Tyres that only push: accelerations, states over time, exact bounces, energy, and the pull of the linear tyre on the
road."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from models.core.result import Result
from models.core.scene_effects import scene_without
from models.drift.score import root_mean_square
from models.engines.assembly import Settings
from models.engines.spatial_protocol import build as build_in_space
from models.engines.spatial_reference import SpatialReference
from models.ride.road_path import road_path
from models.road.iso8608 import iso8608_road
from models.systems.hub_forces.measurement import road_under_wheels, true_run
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import Scene, assembly_of_scene, settings_of
from models.systems.pitch_plane.scene import build as build_scene
from models.systems.ride.nonlinear import drive_over_road
from models.systems.ride.of_scene import excitation_of, vehicle_of
from models.systems.ride.scene import build as build_ride
from models.vehicles.cut_vehicle import cut_at_hubs
from models.vehicles.spatial_linear import wheels
from models.vehicles.vehicle_file import load_vehicle
from validation.common import checks
from validation.common.bounces import BouncingVehicle, bounce_energy
from validation.common.checks import acceleration_gap
from validation.common.grounds import allowing_breaches
from validation.common.rows import CaseAnswer, Observed, Row, System
from validation.common.scenes import STUDY_ROAD, VEHICLE_SETS, largest_difference

TITLE = "Tyres that only push"
SYSTEM: System = "pitch-plane"
ENGINE_NAMES = ("exudyn", "mujoco")
IMPLEMENTATIONS = ("reference", *ENGINE_NAMES)
STATE_UNITS = "m, rad, m/s, rad/s"
START_MOTION = {"z1": -0.3, "z2": -0.2, "z3": -0.4, "pitch": 0.05}
"""Initial displacements (m) and pitch (rad): both wheels are in the air, one higher than the other."""
TIME_STEP, SEED, SPEED = 1e-4, 7, 20.0
ROUNDING_REASON = "the same tableau and laws; sums are taken in another order"
ZERO_DAMPING_OVERRIDES = dict.fromkeys(("d1", "d2", "d3", "d4"), 0.0)


def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows: accelerations, bounces, energy and wheel loads of vehicles whose tyres lift off. A quick run has one
    vehicle, half a second of bounces, short runs on roads, and no hub forces."""
    vehicles = VEHICLE_SETS[-1:] if quick else VEHICLE_SETS
    rows = [
        row for name in vehicles for row in (*_acceleration_rows(name), *_study_road_rows(name, 1.5 if quick else 20.0))
    ]
    rows += [
        *_bounce_rows(0.5 if quick else 2.0),
        _convergence_order_row(4 if quick else 6),
        *_energy_rows(0.5 if quick else 2.0),
    ]
    return [*rows, *_tyre_pull_rows(quick), *_ride_vehicle_rows(quick), *([] if quick else _hub_force_rows())], {}


def lift_off_scene(
    parameter_set_name: str = VEHICLE_SETS[-1],
    geometry_name: str = "exact",
    duration: float = 1.0,
    time_step: float = TIME_STEP,
    on_study_road: bool = False,
    parameter_overrides: dict[str, float] | None = None,
) -> Scene:
    """Scene of the half car on tyres that can lift off: on the study road from rest, or dropped onto a flat road."""
    return build_scene(
        {
            "title": TITLE,
            "vehicle": {
                "parameters": parameter_set_name,
                "geometry": geometry_name,
                "override": parameter_overrides or {},
            },
            "run": {"duration": duration, "step": time_step},
            "start": {} if on_study_road else START_MOTION,
            "effects": {"lift_off": {}, **({"road": STUDY_ROAD} if on_study_road else {})},
        }
    )


def _acceleration_rows(parameter_set_name: str) -> list[Row]:
    """Rows: accelerations of Exudyn and MuJoCo compared with the written equations at random states, some of them with
    wheels in the air."""
    rows = []
    for geometry in ("exact", "linear"):
        lifting = lift_off_scene(parameter_set_name, geometry, 2.0, 1e-3, on_study_road=True)
        assembly = assembly_of_scene(lifting)
        for engine in ENGINE_NAMES:
            error = acceleration_gap(checks.engine(engine), assembly, settings_of(lifting, engine))
            what = "acceleration at 100 random states, wheels in the air and hit among them"
            rows.append(
                Observed(
                    f"lift_off.audit.{engine}.{parameter_set_name}.{geometry}",
                    SYSTEM,
                    f"largest difference of the {what} in {engine} from the written equations, "
                    f"{parameter_set_name}, {geometry} geometry",
                    error,
                    "of the largest",
                ).at_most(1e-12, "a dozen products of doubles; the law stands in each by itself", "native")
            )
    return rows


def _study_road_rows(parameter_set_name: str, duration: float) -> list[Row]:
    """Rows: largest difference of the engines' states from the reference's on the study road at the same step, and the
    least wheel load, which must be 0."""
    lifting = lift_off_scene(parameter_set_name, duration=duration, time_step=5e-4, on_study_road=True)
    runs = {engine: simulate(lifting, engine) for engine in IMPLEMENTATIONS}
    rows = [
        Observed(
            f"lift_off.path.{engine}.{parameter_set_name}",
            SYSTEM,
            f"largest difference of the states in {engine} from the reference over {duration:g} s of "
            f"the study road, {parameter_set_name}",
            largest_difference(runs[engine], runs["reference"]),
            STATE_UNITS,
        ).at_most(1e-11, f"{ROUNDING_REASON}; each landing makes the difference some times as large", "native")
        for engine in ENGINE_NAMES
    ]
    least = min(_tyre_forces_of_run(run).min() for run in runs.values())
    return [
        *rows,
        Observed(
            f"lift_off.least.{parameter_set_name}",
            SYSTEM,
            f"least wheel load over the study road, {parameter_set_name}",
            float(least),
            "N",
        ).within(0.0, 0.0, "wheels leave the road, and no tyre pulls", "none"),
    ]


def _tyre_forces_of_run(lift_off_run: Result) -> np.ndarray:
    """Forces (2, n) in N of the front and of the rear tyre."""
    return np.array([lift_off_run["f1"], lift_off_run["f2"]])


@allowing_breaches(
    "dropped so hard that every law is met far out; the other side has the same laws",
    "springs compressed",
    "tyres not flat",
)
def _bounce_rows(duration: float) -> list[Row]:
    """Rows: bounces on a flat road, compared with matrix exponentials between the times at which tyres lift off or
    land."""
    rows = []
    dampers: dict[str, dict[str, float]] = {"as they are": {}, "of 5 kN s/m": {"d1": 5e3, "d2": 5e3}}
    for what, override in dampers.items():
        lifting = lift_off_scene(geometry_name="linear", duration=duration, parameter_overrides=override)
        assembly = assembly_of_scene(lifting)
        exact = BouncingVehicle(assembly, TIME_STEP).path(assembly.initial, round(duration / TIME_STEP))
        for engine in IMPLEMENTATIONS:
            error = float(np.abs(simulate(lifting, engine).states - exact).max())
            name = f"lift_off.exact.{engine}.{'stiff' if override else 'own'}"
            rows.append(
                Observed(
                    name,
                    SYSTEM,
                    f"largest difference of a vehicle dropped from 0.3 m in {engine} at 0.1 ms from "
                    f"matrix exponentials between the switches, tyre dampers {what}",
                    error,
                    STATE_UNITS,
                ).at_most(2e-4, "a corner within a step costs its square, at every landing", "closed form")
            )
    return rows


@allowing_breaches(
    "dropped so hard that every law is met far out; the other side has the same laws",
    "springs compressed",
    "tyres not flat",
)
def _convergence_order_row(halving_count: int) -> Row:
    """Row: observed order of the error in the step, for a run with landings."""
    lifting = lift_off_scene(geometry_name="linear")
    steps, coarse = 1e-3 / 2.0 ** np.arange(halving_count), 1e-3
    exact = BouncingVehicle(assembly_of_scene(lifting), coarse).path(
        assembly_of_scene(lifting).initial, round(1.0 / coarse)
    )
    errors = []
    for step in steps:
        states = simulate(lifting, "reference", Settings("RK4", step, 1.0)).states[:: round(coarse / step)]
        errors.append(float(np.abs(states - exact).max()))
    slope = float(np.polyfit(np.log(steps), np.log(errors), 1)[0])
    what = f"observed order of RK4 through landings, {halving_count - 1} halvings of 1 ms"
    why = "the force has corners: 2 on the average, 4 between them"
    return Observed("lift_off.order", SYSTEM, what, slope, "").beside(2.0, why, "closed form")


@allowing_breaches(
    "dropped so hard that every law is met far out; the other side has the same laws",
    "springs compressed",
    "tyres not flat",
)
def _energy_rows(duration: float) -> list[Row]:
    """Rows: change of energy of a bouncing vehicle without dampers, and gain of energy of a vehicle with dampers in the
    tyres alone."""
    rows = []
    for engine in IMPLEMENTATIONS:
        undamped = lift_off_scene(duration=duration, parameter_overrides=ZERO_DAMPING_OVERRIDES)
        states = simulate(undamped, engine).states
        energies = bounce_energy(assembly_of_scene(undamped), states)
        size = energies[0] - bounce_energy(assembly_of_scene(undamped), np.zeros((1, 8)))[0]  # by its fall to the road
        rows.append(
            Observed(
                f"lift_off.energy.{engine}",
                SYSTEM,
                f"change of energy of a bouncing vehicle without dampers, {duration:g} s, {engine}",
                float(np.abs(energies - energies[0]).max() / size),
                "of the fall's",
            ).at_most(1e-4, "the error of the step", "closed form")
        )
        damped = lift_off_scene(
            duration=duration, parameter_overrides=ZERO_DAMPING_OVERRIDES | {"d1": 2e3, "d2": 500.0}
        )
        energies = bounce_energy(assembly_of_scene(damped), simulate(damped, engine).states)
        gain = float((energies - np.minimum.accumulate(energies)).max() / size)
        rows.append(
            Observed(
                f"lift_off.gain.{engine}",
                SYSTEM,
                f"gain of energy of a bouncing vehicle with dampers in the tyres alone, {engine}",
                gain,
                "of the fall's",
            ).at_most(1e-4, "the damper takes energy and never gives any", "closed form")
        )
    return rows


@allowing_breaches("what the linear tyre does is what is shown")
def _tyre_pull_rows(quick: bool) -> list[Row]:
    """Rows: how strongly and how often the paper's linear tyre pulls on the study road, and the ratio of the dynamic
    wheel loads with tyres that lift off to those of linear tyres."""
    lifting_scene = lift_off_scene(VEHICLE_SETS[0], duration=4.0 if quick else 20.0, time_step=5e-4, on_study_road=True)
    lifting, linear = (
        simulate(lifting_scene, "reference"),
        simulate(scene_without(lifting_scene, "lift_off"), "reference"),
    )
    loads = _tyre_forces_of_run(linear)
    deviations = [root_mean_square(_tyre_forces_of_run(run) - loads.mean(axis=1)[:, None]) for run in (linear, lifting)]
    what = f"the paper's vehicle and tyre on the study road, {lifting_scene.run.duration:g} s"
    share = 100.0 * float((loads < 0.0).any(axis=0).mean())
    words = "ratio of the rms of the dynamic wheel loads with tyres that lift to that of linear tyres"
    pulls = "share of time in which a wheel pulls on the road, the paper's vehicle and tyre on the study road, 4 s"
    shown = (
        (
            "pull",
            f"{what}: largest pull on the road",
            float(-loads.min()),
            "N",
            0.0,
            "a tyre pushes; the paper's is linear",
        ),
        ("share", pulls, share, "%", 0.0, "a tyre pushes"),
        ("rms", words, deviations[1] / deviations[0], "", 1.0, "what the linear tyre costs"),
    )
    return [
        Observed(f"lift_off.{id}", SYSTEM, words, value, unit).beside(expected, why, "none")
        for id, words, value, unit, expected, why in shown
    ]


def _ride_vehicle_rows(quick: bool) -> list[Row]:
    """Rows on the R19-ride vehicle with tyres that lift off: accelerations compared with hand-written equations, and
    Exudyn and MuJoCo compared on a random road."""
    ride = build_ride(
        {
            "title": TITLE,
            "system": "ride",
            "vehicle": {"file": "r19_ride", "operating_point": "loaded"},
            "road": {"level": 3e-4},
            "speeds": {"values": [SPEED]},
            "effects": {"lift_off": {}},
        }
    )
    car, random, worst = vehicle_of(ride), np.random.default_rng(SEED), dict.fromkeys(ENGINE_NAMES, 0.0)
    damped = replace(car, tyres=tuple(replace(tyre, damping=300.0 + i) for i, tyre in enumerate(car.tyres)))
    written, n, w = SpatialReference(damped), len(car.coordinates()), len(car.tyres)
    models = {engine: build_in_space(engine, damped) for engine in ENGINE_NAMES}
    for _ in range(30 if quick else 100):
        q, v = random.uniform(-0.08, 0.08, n), random.uniform(-3.0, 3.0, n)
        road = np.concatenate([random.uniform(-0.1, 0.1, w), random.uniform(-3.0, 3.0, w)])
        wanted = written.acceleration(0.0, q, v, road)
        for engine, model in models.items():
            error = float(np.abs(model.acceleration(0.0, q, v, road) - wanted).max() / np.abs(wanted).max())
            worst[engine] = max(worst[engine], error)
    path = road_path(excitation_of(ride, wheels(car)), SPEED, 1e-3)
    first, two = (
        drive_over_road(engine, car, path, 1.0 if quick else 10.0, road_seed=SEED, steps_per_output=20).run
        for engine in ENGINE_NAMES
    )
    apart = max(np.abs(first.positions - two.positions).max(), np.abs(first.rates - two.rates).max())
    return [
        *(
            Observed(
                f"lift_off.space.{engine}",
                "ride",
                f"largest difference of R19-ride's accelerations in {engine} from the written "
                "equations, tyres in the air, pressed and hit",
                worst[engine],
                "of the largest",
            ).at_most(1e-12, "each has the law in its code", "native")
            for engine in ENGINE_NAMES
        ),
        Observed(
            "lift_off.ride",
            "ride",
            "largest difference of R19-ride's states between Exudyn and MuJoCo on 20 times the paper's road",
            float(apart),
            STATE_UNITS,
        ).at_most(1e-10, ROUNDING_REASON, "native"),
    ]


def _hub_force_rows() -> list[Row]:
    """Rows: hub forces of a car whose wheels leave a class E road: difference of the engines from the reference
    equations, and least force."""
    car, duration = cut_at_hubs(load_vehicle("r19_free").with_tyres(pushes_only=True), "body"), 4.0
    left, right = (iso8608_road("E", seed) for seed in (1, 2))
    drive = road_under_wheels(car, left, right, SPEED, 1e-3, round(duration / 1e-3))
    runs = {engine: true_run(engine, car, drive, "inertial", 1e-3, duration) for engine in IMPLEMENTATIONS}
    apart = max(float(np.abs(runs[engine].states - runs["reference"].states).max()) for engine in ENGINE_NAMES)
    loads = runs["reference"].wrenches[:, :, 2]
    return [
        Observed(
            "lift_off.hubs",
            "drift",
            "largest difference of R19-free's states in Exudyn and MuJoCo from the reference, class "
            f"E road, {duration:g} s",
            apart,
            STATE_UNITS,
        ).at_most(1e-10, "one law, three mass matrices", "shared kernel"),
        Observed(
            "lift_off.hubs.least",
            "drift",
            "least force of the road on a hub of R19-free, class E road",
            float(loads.min()),
            "N",
        ).within(0.0, 0.0, "wheels leave the road, and no tyre pulls", "none"),
    ]
