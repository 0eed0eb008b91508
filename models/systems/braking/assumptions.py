"""Assumptions of a braked vehicle on its road, with the limits that decide whether a run breaks them.

Limits without a source are chosen such that a neglected effect would change a stopping distance by some per cent.
"""

import math
from collections.abc import Iterator
from functools import partial
from itertools import chain

import numpy as np

from models.brake.plane_vehicle import GRAVITY, Truck
from models.core.assumptions import Assumption, Watched
from models.core.result import Result
from models.systems.braking.march import BrakedVehicle
from models.systems.braking.of_scene import measured_pressures_of, tyre_tables_of, vehicle_of
from models.systems.braking.scene import BrakingScene
from models.systems.braking.stop_report import HITCH_SUFFIX, SLOWEST_SLIP_SPEED, StopHistory, wheel_names

CONTROLLERS_WITHOUT_VALVES = ("none", "slip_pi")
"""Controllers that never switch valves on and off."""
LEAST_WHEEL_LOAD = 1.0
"""Wheel load (N) below which a wheel has left the road."""
LARGEST_LOAD_TRANSFER = 0.3
"""Largest load transfer divided by a wheel's load at rest: with more, another axle locks first."""
LARGEST_PARALLEL_STEER = 0.25
"""Largest steer angle (rad) at which both front wheels may be steered alike. Inner and outer wheel of a truck differ by
2 deg there, a third of the slip angle of most grip.
"""
LARGEST_HINGE_ANGLE = 1.0
"""Largest hinge angle (rad) of a train: at 57 deg the corners of truck and trailer, or drawbar and frame, usually
touch.
"""
HOOK_HEIGHT, LIFTED_LOAD_SHARE = 0.9, 0.1
"""Height (m) of a usual trailer hook above the ground, and the largest share of an axle's load that its force may move.
"""
LARGEST_LEAN = 0.12
"""Largest roll and pitch (rad): at 7 deg usual springs, 1 m apart, are compressed by 60 mm, to their stops."""
FASTEST_PRESSURE_RATE = 100.0
"""Fastest pressure rise (bar/s) of air chambers: 6 bar in 0.06 s."""
FADING_WORK = 4e6
"""Brake work (J) of a wheel beyond which linings fade: it heats 40 kg of drum or disc by 200 K."""
DRAG_COEFFICIENT, AIR_DENSITY, NEGLECTED_ENERGY_SHARE = 0.6, 1.2, 0.1
"""Drag coefficient of a box, density of air (kg/m^3), and largest share of the kinetic energy that
air drag may take.
"""
LARGEST_LOAD_FACTOR = 3.0
"""Largest ratio of a wheel's load to the load of a tyre table that has a single load."""
FULL_CIRCLE = 1.5
"""Slip angle (rad) from which on a tyre table counts as complete."""
LEAST_SLIP_ANGLE = 1e-3
"""Slip angle (rad) below which side forces are too small to be wrong."""


def assumptions(scene: BrakingScene, procedure_name: str, vehicle: BrakedVehicle) -> list[Assumption]:
    """Assumptions of a braking procedure, about loads, course, tyres, brakes, steering, air drag and the end of the
    stop.
    """
    parts = (
        _load_assumptions(scene),
        _body_assumptions(scene, vehicle),
        _tyre_assumptions(scene, vehicle),
        _brake_assumptions(scene, procedure_name, vehicle),
    )
    return [*chain.from_iterable(parts), *_drive_assumptions(scene, vehicle)]


def _load_assumptions(scene: BrakingScene) -> Iterator[Assumption]:
    """Yields assumptions on the wheel loads of a plane vehicle; none for a vehicle on its suspension."""
    if scene.vehicle.file is not None:
        return
    if scene.load_transfer is None:
        yield Assumption(
            "loads at rest",
            "braking and cornering move little load between the wheels",
            "name the effect load_transfer",
            partial(_transferred_load, scene),
            "of the load at rest",
            upper_limit=LARGEST_LOAD_TRANSFER,
        )
    else:
        yield Assumption(
            "wheels on the road",
            "every wheel stays on the road, as the body in the plane does not roll",
            "use a vehicle on its suspension, vehicle.file",
            lambda run: _by_wheel_name(_wheel_loads(run)),
            "N",
            lower_limit=LEAST_WHEEL_LOAD,
        )


def _wheel_loads(run_result: Result) -> np.ndarray:
    """Wheel loads (n, W) in N; NaN in the sample in which the vehicle comes to rest, as its deceleration there is not
    caused by tyre forces.
    """
    loads = np.array(run_result["load"])
    if run_result.detail.ended_at_rest:
        loads[-1] = np.nan
    return loads


def _transferred_load(scene: BrakingScene, run_result: Result) -> Watched:
    """Load transfer divided by wheel load at rest, of truck and trailer over time, that the truck's accelerations would
    cause by the height of the centre of mass.
    """
    states, path_times = run_result.detail.states, run_result.detail.times
    rates = np.diff(states[:, 1, :2], axis=0) / np.maximum(np.diff(path_times), 1e-9)[:, None]
    heading = states[1:, 0, 2]
    acceleration_along = np.abs(rates[:, 0] * np.cos(heading) + rates[:, 1] * np.sin(heading))
    acceleration_across = np.abs(rates[:, 1] * np.cos(heading) - rates[:, 0] * np.sin(heading))
    bodies = {"truck": vehicle_of(scene), "trailer": scene.trailer}
    return {
        name: _with_start_row(_load_transfer_of_body(body, acceleration_along, acceleration_across))
        for name, body in bodies.items()
        if body is not None
    }


def _load_transfer_of_body(body: Truck, acceleration_along: np.ndarray, acceleration_across: np.ndarray) -> np.ndarray:
    """Load transfer divided by load at rest, (n,), of a body's lighter axle and narrower track, by accelerations in
    m/s^2.
    """
    lever = max(1.0 / body.front.x, -1.0 / body.rear.x)  # of the axle that bears less
    track = min(body.front.track, body.rear.track)
    return body.height / GRAVITY * (acceleration_along * lever + 2.0 * acceleration_across / track)


def _body_assumptions(scene: BrakingScene, vehicle: BrakedVehicle) -> Iterator[Assumption]:
    """Yields assumptions on the vehicle's direction, the angles of its train and the travel of its springs."""
    yield Assumption(
        "forwards",
        "the vehicle moves forwards",
        "name the effect anti_lock, or brake the rear axle less: the vehicle spins",
        lambda run: {"vehicle": StopHistory(run.detail).side_slip},
        "rad",
        -math.pi / 2,
        math.pi / 2,
    )
    if scene.trailer is not None:
        if "fold" not in scene.trailer.model_fields_set:
            yield Assumption(
                "hitch",
                "truck, drawbar and trailer do not touch",
                "give trailer.fold, the angle at which they do: the run then ends there",
                _hinge_angles,
                "rad",
                -LARGEST_HINGE_ANGLE,
                LARGEST_HINGE_ANGLE,
            )
        yield Assumption(
            "low hook",
            "the hook's force moves little load, though it acts at the ground",
            "balance brakes.trailer with those of the truck",
            partial(_share_lifted_by_hook, scene),
            "of an axle's load",
            upper_limit=LIFTED_LOAD_SHARE,
        )
    if vehicle.sprung is not None and vehicle.sprung.turns.size:
        yield Assumption(
            "hitch",
            "the vehicle and what it tows do not touch",
            "brake the towing vehicle less than the trailer, or steer less",
            _hitch_angles,
            "rad",
            -LARGEST_HINGE_ANGLE,
            LARGEST_HINGE_ANGLE,
        )
    if vehicle.sprung is not None and _has_spring_without_stops(vehicle):
        yield Assumption(
            "travel",
            "springs do not reach their stops",
            "give all springs of vehicle.file a travel_force with their stops",
            _lean_angles,
            "rad",
            -LARGEST_LEAN,
            LARGEST_LEAN,
        )


def _has_spring_without_stops(vehicle: BrakedVehicle) -> bool:
    """Whether a suspended vehicle has any spring without stops: a joint element, or a spring without travel_force."""
    spatial_vehicle = vehicle.sprung.handling.vehicle
    return bool(spatial_vehicle.joint_elements) or any(
        spring.travel_force is None for spring in spatial_vehicle.springs
    )


def _hinge_angles(run_result: Result) -> Watched:
    """Angles (n,) in rad of the drawbar against the truck and of the trailer against the drawbar, by name."""
    bends = np.diff(run_result.detail.states[:, 0, 2:], axis=1)
    return dict(zip(("drawbar against the truck", "trailer against the drawbar"), bends.T, strict=True))


def _hitch_angles(run_result: Result) -> Watched:
    """Angles (n,) in rad at every hitch of a suspended vehicle with what it tows, by the name of the towed body."""
    columns = {name: i for i, name in enumerate(run_result.detail.coordinates) if name.endswith(HITCH_SUFFIX)}
    return {name.removesuffix(HITCH_SUFFIX): run_result.detail.states[:, 0, i] for name, i in columns.items()}


def _share_lifted_by_hook(scene: BrakingScene, run_result: Result) -> Watched:
    """Share of the load on the trailer's lighter axle that the hook force moves, over time. The hook force follows from
    the balance of longitudinal forces on the truck.
    """
    trailer, path = scene.trailer, run_result.detail
    assert trailer is not None
    heading, slowed = path.states[1:, 0, 2], np.diff(path.states[:, 1, :2], axis=0)
    deceleration = slowed[:, 0] * np.cos(heading) + slowed[:, 1] * np.sin(heading)
    pull = run_result["force_x"][1:, :4].sum(axis=1) - vehicle_of(scene).mass * deceleration / np.maximum(
        np.diff(path.times), 1e-9
    )
    span = trailer.wheelbase
    lighter = trailer.mass * GRAVITY * min(trailer.front.x, -trailer.rear.x) / span
    share = np.abs(pull) * HOOK_HEIGHT / span / lighter
    return {"hook": _with_start_row(np.where(StopHistory(path).speed[1:] > SLOWEST_SLIP_SPEED, share, np.nan))}


def _lean_angles(run_result: Result) -> Watched:
    """Roll and pitch (n,) in rad of a vehicle on its suspension, by name."""
    lean = StopHistory(run_result.detail).lean
    assert lean is not None
    return dict(zip(("roll", "pitch"), lean.T, strict=True))


def _tyre_assumptions(scene: BrakingScene, vehicle: BrakedVehicle) -> Iterator[Assumption]:
    """Yields assumptions that loads and slip angles stay within the tyre tables, and that steps resolve slip angles."""
    tables = tyre_tables_of(scene).values()
    largest = min(table.loads[-1] * (LARGEST_LOAD_FACTOR if table.loads.size == 1 else 1.0) for table in tables)
    yield Assumption(
        "loads of the friction",
        "friction is known at the loads that wheels bear",
        "give tyres.files with tables up to larger loads",
        lambda run: _by_wheel_name(_wheel_loads(run)),
        "N",
        upper_limit=float(largest),
    )
    widest = min(float(table.angles[-1]) for table in tables)
    if widest < FULL_CIRCLE:
        yield Assumption(
            "slip angles of the friction",
            "friction is known at the slip angles of the tyres",
            "give tyres.files with tables up to larger slip angles",
            lambda run: _by_wheel_name(_while_moving(run, np.abs(run["slip_angle"]))),
            "rad",
            upper_limit=widest,
        )
    if scene.relaxation is not None or vehicle.sprung is not None:
        yield Assumption(
            "slip at low speed",
            f"steps resolve slip angles above {SLOWEST_SLIP_SPEED:g} m/s",
            "raise run.substeps",
            partial(_resolved_speed, vehicle),
            "m/s of least speed",
            upper_limit=SLOWEST_SLIP_SPEED,
        )


def _resolved_speed(vehicle: BrakedVehicle, run_result: Result) -> Watched:
    """Least speed (m/s) at which the time steps resolve slip angles, for samples where tyres corner below this speed;
    NaN elsewhere.
    """
    lively = GRAVITY if vehicle.sprung is None else vehicle.engine.liveliness
    least_resolved = vehicle.slope * lively * vehicle.sample / vehicle.substeps
    angles = np.nanmax(np.nan_to_num(np.abs(run_result["slip_angle"])), axis=1)
    return {
        "vehicle": np.where(
            (angles > LEAST_SLIP_ANGLE) & (StopHistory(run_result.detail).speed < least_resolved),
            least_resolved,
            np.nan,
        )
    }


def _brake_assumptions(scene: BrakingScene, procedure_name: str, vehicle: BrakedVehicle) -> Iterator[Assumption]:
    """Yields assumptions on brake pressures, brake work and the valves that set the pressures."""
    port, sets_valves = scene.port, scene.measured is None and scene.controller.kind not in CONTROLLERS_WITHOUT_VALVES
    if sets_valves and scene.pressure is None:
        yield Assumption(
            "chambers",
            "chambers fill as fast as air flows",
            "name the effect pressure_dynamics, [pressure]",
            lambda run: _by_wheel_name(_with_start_row(np.diff(run["pressure"], axis=0) / scene.run.sample)),
            "bar/s",
            upper_limit=FASTEST_PRESSURE_RATE,
        )
    if port is not None:
        yield Assumption(
            "supply",
            "no brake has more pressure than the supply",
            "raise brakes.supply, or lower gain, offset and noise of port.pressures",
            lambda run: _by_wheel_name(run["pressure"]),
            "bar",
            upper_limit=scene.brakes.supply * (1.0 + 1e-9),
        )
    if port is not None and port.signals.range is not None:
        yield Assumption(
            "range of the signals",
            "wheel speeds are within the range of their converter",
            "raise port.signals.range",
            lambda run: _by_wheel_name(np.abs(run["turning"]) * vehicle.plane.radius),
            "m/s",
            upper_limit=port.signals.range,
        )
    measured = measured_pressures_of(scene, procedure_name, vehicle.plane.wheels)
    if measured is not None:
        yield Assumption(
            "measured pressures",
            "pressures were measured until the end",
            "measure longer, or end before by run.duration",
            lambda run: {"time": run.times},
            "s",
            upper_limit=float(measured.times[-1]) + scene.run.sample,
        )
    yield Assumption(
        "cool brakes",
        "brakes stay so cool that their torque does not fade",
        "brake from less speed, or spread the torque: no effect knows fading",
        _brake_work,
        "J",
        upper_limit=FADING_WORK,
    )


def _brake_work(run_result: Result) -> Watched:
    """Work (n, W) in J that each wheel's brake has done up to each sample."""
    power = run_result["torque"] * np.abs(run_result["turning"])
    steps = np.diff(run_result.times)[:, None] * 0.5 * (power[1:] + power[:-1])
    return _by_wheel_name(np.concatenate((np.zeros((1, power.shape[1])), np.cumsum(steps, axis=0))))


def _drive_assumptions(scene: BrakingScene, vehicle: BrakedVehicle) -> Iterator[Assumption]:
    """Yields assumptions on the driver's steering, the drag of the air and the end of the stop."""
    yield Assumption(
        "parallel steering",
        "both front wheels are steered alike",
        "steer less: no effect has wheels that are steered apart",
        partial(_steer_angles, vehicle),
        "rad",
        -LARGEST_PARALLEL_STEER,
        LARGEST_PARALLEL_STEER,
    )
    yield Assumption(
        "still air",
        "the air takes little of the vehicle's energy",
        "brake from less speed: no effect adds the air's drag",
        partial(_drag_work_share, scene, float(vehicle.plane.masses.sum())),
        "of the kinetic energy",
        upper_limit=NEGLECTED_ENERGY_SHARE,
    )
    yield Assumption(
        "stop",
        "the vehicle stands at the end",
        "raise run.duration",
        lambda run: {"vehicle": np.zeros(1) if run.detail.ended_at_rest else StopHistory(run.detail).speed[-1:]},
        "m/s",
        upper_limit=0.0,
    )


def _steer_angles(vehicle: BrakedVehicle, run_result: Result) -> Watched:
    """Steer angles in rad of the front wheels: a fixed angle (1,), or over time (n,)."""
    if vehicle.steering is None:
        return {"front wheels": np.full(1, vehicle.steer[0])}
    return {"front wheels": np.array([vehicle.steering(float(time))[0] for time in run_result.times])}


def _drag_work_share(scene: BrakingScene, vehicle_mass: float, run_result: Result) -> Watched:
    """Work of air drag over a stop, divided by the initial kinetic energy of ``vehicle_mass`` (kg). The drag is that of
    a box as wide as the track and twice as high as the centre of mass.
    """
    truck, stop = vehicle_of(scene), StopHistory(run_result.detail)
    drag = 0.5 * AIR_DENSITY * DRAG_COEFFICIENT * truck.front.track * 2.0 * truck.height
    work = float(np.sum(drag * stop.speed[:-1] ** 2 * np.diff(stop.distance_travelled)))
    return {"vehicle": np.full(1, work / (0.5 * vehicle_mass * stop.speed[0] ** 2))}


def _by_wheel_name(wheel_values: np.ndarray) -> Watched:
    """Returns the columns of values (n, W) by wheel name."""
    return dict(zip(wheel_names(wheel_values.shape[1]), wheel_values.T, strict=True))


def _while_moving(run_result: Result, wheel_values: np.ndarray) -> np.ndarray:
    """Returns values (n, W) with NaN at samples in which the vehicle is not faster than SLOWEST_SLIP_SPEED."""
    return np.where(StopHistory(run_result.detail).speed[:, None] > SLOWEST_SLIP_SPEED, wheel_values, np.nan)


def _with_start_row(sampled_values: np.ndarray) -> np.ndarray:
    """Returns values (n, ...) with a row of NaN before them, for the start of a run, which has no value."""
    return np.concatenate((np.full((1, *sampled_values.shape[1:]), np.nan), sampled_values))
