"""The R19-free car cut at its wheels and driven by hub forces: agreement of engines, gravity error, toppling, growth of
errors, tilt filter, planted faults."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2

from models.core.errors import InputError
from models.core.signals import Interpolation
from models.engines.cut_vehicle import ENGINES, HubRun, build
from models.engines.spatial_reference import SpatialReference
from models.multibody.cut_kernel import WRENCH
from models.multibody.cut_table import HubInputs
from models.road.iso8608 import iso8608_road
from models.systems.hub_forces.comparison import FILTERED_RUN, StabiliserComparison, compare_stabilisers
from models.systems.hub_forces.measurement import (
    HubForces,
    hub_model,
    recorded_measurement,
    road_under_wheels,
    true_run,
)
from models.systems.hub_forces.run import inputs_with_angles
from models.systems.hub_forces.scene import HubScene
from models.systems.hub_forces.scene import build as scene_of
from models.systems.hub_forces.tilt_filter import StatedDeviations, estimate_tilt
from models.vehicles.cut_vehicle import GRAVITY, HEADING, PITCH, ROLL, CutVehicle, Y, Z, cut_at_hubs, rigid_vehicle
from models.vehicles.spatial import SpringDamper
from validation.common.grounds import allowing_breaches
from validation.common.rows import Observed, Row, System, Table, behaviour_row
from validation.spatial import hub_inputs
from validation.spatial.cars import hub_forces_by_jacobians, r19, random_states, random_wrenches, static_forces, twin

TITLE = "A car of 19 freedoms on noisy hub forces"
SYSTEM: System = "drift"
SEED, NOISE_PATH_COUNT, NOISE_SECONDS = 31, 48, 4.0
"""Seed, number of paths and their length (s) in the ensemble."""
TILT_ANGLE = 0.1
"""Roll angle (rad) with which the effect of gravity on a tilted vehicle is tested."""
TIME_STEP = 1e-3


@allowing_breaches("runs that nothing holds drift off, which is what is shown")
def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows of engines and closed forms; a full run also has measurements, error growth, stabilisers, the asymmetric
    twin and planted faults."""
    car = r19()
    rows = [
        *_acceleration_rows("r19_free", car),
        _hub_wrench_row(car),
        *_tilted_vehicle_rows(car),
        _toppling_rate_row(car),
        _noisy_engines_row(car, 0.2 if quick else 2.0),
        *hub_inputs.rows(car, quick),
    ]
    if quick:
        return rows, {}
    rows += [
        *_acceleration_rows("twin", cut_at_hubs(twin(), "body")),
        *_reproduced_motion_rows(car),
        *_noise_growth_rows(car),
    ]
    scenes = {frame: _hub_force_study_scene(frame) for frame in ("hub", "inertial")}
    comparisons = {frame: compare_stabilisers(scene, ("exudyn", "mujoco")) for frame, scene in scenes.items()}
    for frame, comparison in comparisons.items():
        rows += [*_stabilised_rows(frame, comparison), _prescribed_angles_row(frame, comparison)]
    return rows + _planted_fault_rows(scenes["hub"]), {frame: each.figures() for frame, each in comparisons.items()}


def _acceleration_rows(vehicle_name: str, vehicle: CutVehicle) -> list[Row]:
    """Rows: accelerations of the engines at random states compared with written-out equations; these equations, without
    forces, compared with a second set of equations."""
    worst = 0.0
    for i, (frame, guide) in enumerate((("hub", False), ("inertial", True), ("body", True))):
        q, v = random_states(vehicle, i)
        written, *engines = (
            build(engine, vehicle, random_wrenches(vehicle, frame, guide), TIME_STEP, TIME_STEP).acceleration(0.0, q, v)
            for engine in ENGINES
        )
        worst = max(worst, *(float(np.abs(a - written).max() / np.abs(written).max()) for a in engines))
    q, v = random_states(vehicle, 7)
    bare = replace(vehicle, elements=(), loads=0 * vehicle.loads)
    written = build("reference", bare, static_forces(bare, 3), TIME_STEP, TIME_STEP).acceleration(0.0, q, v)
    slack = SpringDamper("none", vehicle.chassis, vehicle.uncut.tyres[0].body, (0, 0, 0), (0, 0, 0), (0, 0, 1), 0, 0)
    expected = SpatialReference(replace(vehicle.tree, gravity=0.0, springs=(slack,))).acceleration(0.0, q, v)
    expected -= GRAVITY * np.eye(len(q))[Z]
    return [
        Observed(
            f"hub_forces.accelerations_{vehicle_name}",
            SYSTEM,
            "relative difference of the accelerations in Exudyn and MuJoCo from the written-out "
            "equations at random states",
            worst,
            "1",
        ).at_most(1e-10, "one callback, three mass matrices", "shared kernel"),
        Observed(
            f"hub_forces.free_fall_{vehicle_name}",
            SYSTEM,
            "relative difference of the accelerations of the freely falling, turning tree from a "
            "second set of equations",
            float(np.abs(written - expected).max()),
            "m/s^2, rad/s^2",
        ).at_most(1e-9, "written separately; gravity moves all alike", "native"),
    ]


def _hub_wrench_row(vehicle: CutVehicle) -> Row:
    """Row: generalised forces of the hub wrenches by the compiled kernel, compared with those by MuJoCo's own
    Jacobians."""
    (q, _), worst = random_states(vehicle, 3), 0.0
    for frame in ("hub", "inertial"):
        hub_inputs = random_wrenches(vehicle, frame, has_guide=False)
        built, bare = (
            build("mujoco", vehicle, replace(hub_inputs, hubs=force_factor * hub_inputs.hubs), TIME_STEP, TIME_STEP)
            for force_factor in (1.0, 0.0)
        )
        expected = hub_forces_by_jacobians(built, q, hub_inputs.hubs[0], frame)
        off = np.abs(built.forces_at_rest(q) - bare.forces_at_rest(q) - expected).max()
        worst = max(worst, float(off / np.abs(expected).max()))
    return Observed(
        "hub_forces.wrenches",
        SYSTEM,
        "relative difference of six force components per hub, as joint forces in two frames, from MuJoCo's Jacobians",
        worst,
        "1",
    ).at_most(1e-12, "places, axes, frames", "native")


def _tilted_run(vehicle: CutVehicle, force_frame: str, roll_angle: float, duration: float) -> HubRun:
    """Run of a vehicle that starts at a roll angle (rad) under constant static hub forces."""
    steps, start = round(duration / TIME_STEP), np.zeros(2 * vehicle.size)
    start[ROLL] = roll_angle
    return build("mujoco", vehicle, static_forces(vehicle, 2 * steps + 1, force_frame), TIME_STEP, duration).run(
        *np.split(start, 2)
    )


def _tilted_vehicle_rows(vehicle: CutVehicle) -> list[Row]:
    """Rows: a tilted vehicle under body-fixed static forces moves sideways as a rigid body, and its section forces do
    not change."""
    run = _tilted_run(vehicle, "hub", TILT_ANGLE, 1.0)
    fall = -0.5 * GRAVITY * np.array([np.sin(TILT_ANGLE), 1 - np.cos(TILT_ANGLE)]) * run.times[:, None] ** 2
    preloads = np.array([element.preload for element in vehicle.elements])
    return [
        Observed(
            "hub_forces.gravity_error",
            SYSTEM,
            "difference of the chassis' position at a roll of 0.1 rad, body-fixed forces, from -g "
            "sin(roll) t^2/2 and -g (1 - cos(roll)) t^2/2 over 1 s",
            float(np.abs(run.states[:, [Y, Z]] - fall).max()),
            "m",
        ).at_most(1e-9, "forces turn with it, gravity does not", "closed form"),
        Observed(
            "hub_forces.equivalence",
            SYSTEM,
            "largest change of a section force by a roll of 0.1 rad, over the weight",
            float(np.abs(run.elements - preloads).max() / vehicle.loads.sum()),
            "1",
        ).at_most(
            1e-10,
            "uniform gravity cannot be told from an acceleration: body-fixed forces leave the inside alone",
            "closed form",
        ),
    ]


def _toppling_rate_row(vehicle: CutVehicle) -> Row:
    """Row: under forces that keep their directions in space, the vehicle topples like an inverted pendulum."""
    run, expected = _tilted_run(vehicle, "inertial", 1e-6, 2.0), float(rigid_vehicle(vehicle).toppling_rates()[0])
    late = np.abs(run.states[[1000, 2000], ROLL])
    return Observed(
        "hub_forces.toppling",
        SYSTEM,
        "relative difference of the growth rate of a roll error, forces in the inertial frame, from "
        "sqrt(m g h / I) of the rigid car",
        float(np.log(late[1] / late[0])),
        "1/s",
    ).within(expected, 0.02 * expected, "springs that give change it by less than one per cent", "closed form")


def _noisy_engines_row(vehicle: CutVehicle, duration: float) -> Row:
    """Row: difference between the runs of all engines under the same noisy forces, without a stabiliser."""
    steps = round(duration / TIME_STEP)
    hub_inputs = static_forces(vehicle, steps + 1)
    noisy = HubForces(hub_inputs.hubs, TIME_STEP, "hub").with_noise(
        np.tile([50.0] * 3 + [5.0] * 3, len(vehicle.hubs)), SEED
    )
    paths = [hub_model(engine, vehicle, noisy, TIME_STEP, duration).run().states for engine in ENGINES]
    return Observed(
        "hub_forces.engines_on_noise",
        SYSTEM,
        "largest difference between the coordinates and rates of three implementations, noise of 50 "
        f"N and 5 N m, {duration:g} s",
        max(float(np.abs(p - paths[0]).max()) for p in paths[1:]),
        "m, rad, 1/s",
    ).at_most(1e-9, "same tableau, same step", "shared kernel")


def _hub_inputs_on_road(vehicle: CutVehicle, duration: float) -> HubInputs:
    """Input of the vehicle on a class C road at 20 m/s."""
    left, right = (iso8608_road("C", seed) for seed in (1, 2))
    return road_under_wheels(vehicle, left, right, 20.0, TIME_STEP, round(duration / TIME_STEP))


def _reproduced_motion_rows(vehicle: CutVehicle) -> list[Row]:
    """Rows: hub forces recorded on a road without noise reproduce the motion, up to interpolation errors between the
    samples."""
    duration = 2.0
    true = true_run("mujoco", vehicle, _hub_inputs_on_road(vehicle, duration), "hub", TIME_STEP, duration)
    off = {}
    readings: tuple[Interpolation, ...] = ("linear", "smooth")
    for interpolation in readings:
        for every in (4, 2):
            measured, _ = recorded_measurement(true, "hub", every)
            run = hub_model("mujoco", vehicle, measured, TIME_STEP, duration, interpolation).run()
            off[interpolation, every] = float(np.abs((run.states - true.states)[:, [ROLL, PITCH]]).max())
    order = np.log2(off["linear", 4] / off["linear", 2])
    return [
        Observed(
            "hub_forces.hold",
            SYSTEM,
            "observed order of roll and pitch in the sampling period of linear samples of hub forces, 250 and 500 Hz",
            float(order),
            "1",
        ).within(2.0, 0.5, "linear interpolation errs by the square", "closed form"),
        Observed(
            "hub_forces.reproduced",
            SYSTEM,
            "error of roll and pitch with a cubic spline through samples at 500 Hz, 2 s of a class C road",
            off["smooth", 2],
            "rad",
        ).at_most(1e-5, "the cut vehicle is the one on the road", "shared kernel"),
    ]


def _noise_growth_rows(vehicle: CutVehicle) -> list[Row]:
    """Rows: mean squares of an ensemble under white noise divided by their laws. They follow a chi-square distribution
    with as many degrees of freedom as paths."""
    steps, step = round(NOISE_SECONDS / 2e-3), 2e-3
    rest, deviation = static_forces(vehicle, steps + 1), np.tile([20.0] * 3 + [4.0] * 3, len(vehicle.hubs))
    still = HubForces(rest.hubs, step, "hub")
    ends = np.array(
        [
            hub_model("mujoco", vehicle, still.with_noise(deviation, SEED, path), step, NOISE_SECONDS).run().states[-1]
            for path in range(NOISE_PATH_COUNT)
        ]
    )
    body, at = rigid_vehicle(vehicle), np.array([NOISE_SECONDS])
    law = body.angle_variance(deviation, step, at)[0]
    sliding = body.position_variance(deviation, step, at, "hub")[0, 1]
    low, high = chi2.ppf([5e-4, 1 - 5e-4], NOISE_PATH_COUNT) / NOISE_PATH_COUNT
    named = [("roll", ROLL, law[0]), ("pitch", PITCH, law[1]), ("heading", HEADING, law[2]), ("y", Y, sliding)]
    return [
        Observed(
            f"hub_forces.growth_{name}",
            SYSTEM,
            f"ratio of the mean square of {name} after {NOISE_SECONDS:g} s of white noise to its law, "
            f"{NOISE_PATH_COUNT} paths",
            float(np.mean(ends[:, i] ** 2) / variance),
            "1",
        ).within(
            (low + high) / 2,
            (high - low) / 2,
            "99.9 % of chi-square; q t^3/3, and g^2 q t^7/252 beside it for y",
            "closed form",
        )
        for name, i, variance in named
    ]


def _hub_force_study_scene(force_frame: str) -> HubScene:
    """Scene of the hub force study, 8 s long."""
    tables = {"vehicle": {"file": "r19_free"}, "run": {"duration": 8.0}, "road": {}, "forces": {"frame": force_frame}}
    return scene_of({"title": TITLE, "system": "hub-forces", "study": "hub_forces"} | tables)


def _stabilised_rows(force_frame: str, run_comparison: StabiliserComparison) -> list[Row]:
    """Rows: difference between the engines before drift-off, errors of roll and pitch with the tilt filter, and damage
    that each run predicts."""
    off = np.abs(run_comparison.errors(run_comparison.runs[FILTERED_RUN])).max(axis=0)
    rows = [
        Observed(
            f"hub_forces.engines_{force_frame}",
            SYSTEM,
            f"largest difference between the engines before drift-off, noisy road run of 8 s, frame {force_frame!r}",
            run_comparison.largest_engine_difference(),
            "m, rad, 1/s",
        ).at_most(1e-9, "same tableau, same step", "shared kernel"),
        *(
            Observed(
                f"hub_forces.filter_{name}_{force_frame}",
                SYSTEM,
                f"largest error of {name} with the filter, frame {force_frame!r}",
                float(off[i]),
                "rad",
            ).at_most(0.01, "demanded", "none")
            for i, name in enumerate(("roll", "pitch"))
        ),
        Observed(
            f"hub_forces.drift_off_{force_frame}",
            SYSTEM,
            f"time at which the free run leaves the true roll or pitch by 0.05 rad (8 s: never), frame {force_frame!r}",
            min(run_comparison.drift_off_time(run_comparison.runs["free, mujoco"]), 8.0),
            "s",
        ).beside("", "stated"),
    ]
    for name in (name for name in run_comparison.runs if "exudyn" not in name):
        ratios = run_comparison.relative_damages(run_comparison.runs[name]["section_force"]).values()
        for end, value in (("least", min(ratios)), ("most", max(ratios))):
            what = (
                f"{end} ratio of the damage of {len(ratios)} springs, mounts and bars to the "
                f"true damage; {name}, frame {force_frame!r}"
            )
            rows.append(
                Observed(
                    f"hub_forces.damage_{end}_{name.split(',')[0]}_{force_frame}", SYSTEM, what, value, "1"
                ).beside(1.0, "body-frame section forces, slope 5")
            )
    return rows


def _prescribed_angles_row(force_frame: str, run_comparison: StabiliserComparison) -> Row:
    """Row: damage ratios if the true roll and pitch are prescribed, so that only the noise of the forces remains."""
    measurement = run_comparison.measurement
    assert measurement.truth is not None
    steps = measurement.scene.step_count
    hub_inputs = inputs_with_angles(
        measurement.forces.hub_inputs(TIME_STEP, steps),
        measurement.truth.states[:, [ROLL, PITCH]],
        TIME_STEP,
        TIME_STEP,
    )
    run = build("mujoco", measurement.vehicle, hub_inputs, TIME_STEP, steps * TIME_STEP).run()
    ratios = np.array([*run_comparison.relative_damages(run.elements).values()])
    return Observed(
        f"hub_forces.prescribed_{force_frame}",
        SYSTEM,
        f"largest deviation of a damage ratio from 1 with the true roll and pitch prescribed, frame {force_frame!r}",
        float(np.abs(ratios - 1).max()),
        "1",
    ).at_most(0.1, "force noise of 0.2 % alone changes lightly loaded bushes by some per cent", "none")


def _planted_fault_rows(study_scene: HubScene) -> list[Row]:
    """Rows: hub forces in a wrong frame, or of exchanged hubs, are refused because they contradict the measured angles.

    The runs take 5 s: in 2 s, another frame cannot be distinguished from an offset of 30 N at a wheel, which is no
    contradiction.
    """
    vehicle, duration = r19(), 5.0
    hub_inputs = _hub_inputs_on_road(vehicle, duration)
    clean, angles = recorded_measurement(true_run("mujoco", vehicle, hub_inputs, "hub", TIME_STEP, duration), "hub", 2)
    in_space, _ = recorded_measurement(
        true_run("mujoco", vehicle, hub_inputs, "inertial", TIME_STEP, duration), "inertial", 2
    )
    parts, of_space = (measured.samples.reshape(len(measured.samples), -1, WRENCH) for measured in (clean, in_space))
    turned = parts * np.array([1.0, -1.0, 1.0, 1.0, -1.0, 1.0])
    planted = {
        "left and right exchanged": parts[:, [1, 0, 3, 2]],
        "front and rear exchanged": parts[:, [2, 3, 0, 1]],
        "y of the frame turned round": turned,
        "another frame": of_space,
        "nothing": parts,
    }
    rows, why = [], "the innovations of the filter tell"
    for i, (name, samples) in enumerate(planted.items()):
        faulty, outcome = replace(clean, samples=samples.reshape(len(samples), -1)), "accepted"
        try:
            estimate_tilt(
                vehicle, faulty, angles, StatedDeviations(study_scene.deviations(vehicle), (1.75e-3, 5e-3), 1.0)
            )
        except InputError:
            outcome = "refused"
        expected, quantity = "accepted" if name == "nothing" else "refused", f"measurement with {name} planted"
        rows.append(behaviour_row(f"hub_forces.fault_{i}", SYSTEM, quantity, outcome, expected, why))
    return rows


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Tables of the damage by every section force in each run."""
    shown = []
    for frame, of_runs in case_data.items():
        runs = {name: run["damage"] for name, run in of_runs.items() if "exudyn" not in name and "damage" in run}
        elements = next(iter(runs.values()))
        rows = tuple((element, *(f"{damages[element]:.3g}" for damages in runs.values())) for element in elements)
        shown.append(
            Table(
                f"Ratio of the damage to the true damage, hub forces in the frame '{frame}'",
                "Section forces in the chassis' axes, slope 5; roll and pitch are prescribed as measured.",
                ("element", *runs),
                rows,
            )
        )
    return shown
