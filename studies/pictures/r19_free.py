"""Film of the car of 19 freedoms on a random road: shapes, camera, and the road's forces on the tyres."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from models.core.trajectory import Trajectory
from models.engines.assembly import Settings
from models.engines.spatial_protocol import INTEGRATORS, build
from models.ride.road_path import RoadPath, road_path
from models.systems.ride.of_scene import GRAVITY, excitation_of, vehicle_of
from models.systems.ride.scene import build as ride_scene
from models.vehicles.spatial import PointOutput, SpatialVehicle, TyreOutput
from models.vehicles.spatial_linear import linearise, static_preloads, wheels
from studies.pictures.camera import Camera
from studies.pictures.film import (
    ArrowStyle,
    FilmedMotion,
    FilmStage,
    ForceArrow,
    ForceCurve,
    Poses,
    exudyn_poses,
    mujoco_poses,
)
from studies.pictures.road import DRAWN_ROAD_LENGTH, PassingRoad
from studies.pictures.shapes import PAINT_COLOUR, Colour, PaintedSurface, ball, box, extruded_outline, tyred_wheel

SPEED, STEP, SEED, LATERAL_START_SPEED = 20.0, 1e-3, 3, 0.5
"""Speed (m/s), largest step (s), seed of the road, and initial lateral speed of the body (m/s)."""
MOTION_MAGNIFICATION = 4.0
SCENE_TABLE = {
    "title": "",
    "system": "ride",
    "vehicle": {"file": "r19_free"},
    "road": {"iso8608": "C"},
    "speeds": {"values": [SPEED]},
}
ARROW_STYLES = {
    "wheel load": ArrowStyle((0.0, 0.62, 0.45), 1.6e-4, 4e3),
    "side force": ArrowStyle((0.84, 0.2, 0.0), 6e-4, 1e3),
}
FORCE_CURVE = ForceCurve("wheel load", (0.0, 0.0, 1.0), "of the road on the tyres, static part included")
ENGINE_COLOUR: Colour = (0.75, 0.45, 0.15)
PERSON_COLOUR: Colour = (0.93, 0.76, 0.55)


def stage_and_motions(
    duration: float, frame_times: np.ndarray, engines: tuple[str, ...]
) -> tuple[FilmStage, list[FilmedMotion]]:
    """Stage of the film, and the motion by each engine, with frames at the steps nearest to ``frame_times`` (s)."""
    scene = ride_scene(SCENE_TABLE)
    vehicle = vehicle_with_road_forces(vehicle_of(scene))
    road = road_path(excitation_of(scene, wheels(vehicle)), SPEED, STEP)
    steps = int(np.ceil(duration / road.step))
    table = road.wheel_heights_and_rates(steps + int(DRAWN_ROAD_LENGTH / SPEED / road.step), SEED)
    rows = np.rint(frame_times / road.step).astype(int)
    motions = [_motion_of_engine(engine, vehicle, road, table[: 2 * steps + 1], rows) for engine in engines]
    return stage(vehicle, road, table), motions


def vehicle_with_road_forces(vehicle: SpatialVehicle) -> SpatialVehicle:
    """The vehicle with other outputs: tyre forces, then lateral velocities at the points of side forces."""
    tyres = tuple(TyreOutput(tyre.name, "tyre force", tyre.name) for tyre in vehicle.tyres)
    across = tuple(PointOutput(f.name, "velocity", f.body, f.point, (0.0, 1.0, 0.0)) for f in vehicle.side_forces)
    return replace(vehicle, outputs=(*tyres, *across))


def _motion_of_engine(
    engine: str, vehicle: SpatialVehicle, road: RoadPath, road_table: np.ndarray, frame_rows: np.ndarray
) -> FilmedMotion:
    """Filmed motion of the car in an engine on a road table, with frames at some of its rows."""
    settings = Settings(INTEGRATORS[engine], road.step, (len(road_table) - 1) // 2 * road.step)
    model: Any = build(engine, vehicle, settings, SPEED, road_table)
    zero = np.zeros(len(vehicle.coordinates()))
    gust = np.array([LATERAL_START_SPEED if position == ("body", "y") else 0.0 for position in vehicle.coordinates()])
    run = model.run(zero, gust)
    kept_run = Trajectory(run.times[frame_rows], run.states[frame_rows])
    if engine == "exudyn":
        poses = _exudyn_poses(model, kept_run.positions)
    else:
        joints = np.empty_like(kept_run.positions)
        joints[:, model.numbers.columns] = kept_run.positions
        poses = mujoco_poses(model.model, model.numbers.bodies, joints)
    return FilmedMotion(
        engine, kept_run.times, *poses, force_arrows(vehicle, kept_run, road_table[2 * frame_rows], poses)
    )


def _exudyn_poses(engine_model: Any, positions: np.ndarray) -> Poses:
    """Poses of the bodies by Exudyn at positions (f, n) of f frames."""
    markers = {
        body.name: engine_model.built.marker(body.name, body.position, True) for body in engine_model.vehicle.bodies
    }
    engine_model.mbs.Assemble()
    marker_output = {name: partial(engine_model.mbs.GetMarkerOutput, marker) for name, marker in markers.items()}
    body_positions, turns = exudyn_poses(
        engine_model.mbs, marker_output, np.array([engine_model._values_in_exudyn_order(row) for row in positions])
    )
    axes = {name: np.transpose([engine_model.built.in_body_axes(name, axis) for axis in np.eye(3)]) for name in markers}
    return body_positions, {
        name: turn @ axes[name] for name, turn in turns.items()
    }  # a mass that slides has other axes


def force_arrows(
    vehicle: SpatialVehicle, vehicle_run: Trajectory, road_heights: np.ndarray, body_poses: Poses
) -> tuple[ForceArrow, ...]:
    """Force arrows of the wheel loads, with their static part, and of the side forces, both at the road, from a run's
    states."""
    forces = [
        vehicle_run.rates @ output.rate_factors
        + vehicle_run.positions @ output.displacement_factors
        + road_heights @ np.concatenate([output.road_factors, output.road_rate_factors])
        for output in linearise(vehicle, SPEED).outputs
    ]
    static_forces, names = static_preloads(replace(vehicle, gravity=GRAVITY)).tyres, vehicle.coordinates()
    arrows = [
        _road_force_arrow("wheel load", vehicle, tyre, static_forces[tyre.name] + force, 2, body_poses)
        for tyre, force in zip(vehicle.tyres, forces, strict=False)
    ]
    for side, speed in zip(vehicle.side_forces, forces[len(vehicle.tyres) :], strict=True):
        roll, yaw = (vehicle_run.positions[:, names.index((side.chassis, freedom))] for freedom in ("rx", "rz"))
        force = side.stiffness * (side.roll_steer * roll + yaw - speed / SPEED)
        arrows.append(_road_force_arrow("side force", vehicle, side, force, 1, body_poses))
    return tuple(arrows)


def _road_force_arrow(
    arrow_kind: str,
    vehicle: SpatialVehicle,
    tyre_or_force: Any,
    force_values: np.ndarray,
    axis_number: int,
    body_poses: Poses,
) -> ForceArrow:
    """Arrow of a tyre force or side force (f,) in N along an axis of space (0 to 2), from the road below the force's
    point on its body."""
    (x, y, _), body = tyre_or_force.point, tyre_or_force.body
    points = body_poses[0][body] + body_poses[1][body] @ np.subtract((x, y, 0.0), vehicle.body(body).position)
    return ForceArrow(
        f"{arrow_kind}, {tyre_or_force.name}", arrow_kind, body, points, force_values[:, None] * np.eye(3)[axis_number]
    )


def stage(vehicle: SpatialVehicle, road: RoadPath, road_table: np.ndarray) -> FilmStage:
    """Stage of the film: the car, seen from ahead and to its left, on a passing road."""
    front = [tyre for tyre in vehicle.tyres if tyre.axle == 0]
    columns = [vehicle.tyres.index(tyre) for tyre in front]
    distances = front[0].point[0] + SPEED * road.half_step * np.arange(len(road_table))
    tracks = front[0].point[1], front[1].point[1]
    passing = PassingRoad(distances, road_table[:, columns], tracks, SPEED, magnification=MOTION_MAGNIFICATION)
    rest_positions = {body.name: body.position for body in vehicle.bodies}
    camera = Camera((5.6, 4.6, 2.3), (-0.1, 0.1, 0.5), angle_of_view=0.5)
    caption = f"displacements and road drawn {MOTION_MAGNIFICATION:g} times as large; forces of the road on the tyres"
    title = f"Car of {len(vehicle.coordinates())} freedoms at {SPEED:g} m/s on a road of class C, after a gust"
    return FilmStage(
        title,
        caption,
        body_shapes(vehicle),
        rest_positions,
        camera,
        ARROW_STYLES,
        FORCE_CURVE,
        passing.surfaces_at,
        MOTION_MAGNIFICATION,
    )


def body_shapes(vehicle: SpatialVehicle) -> dict[str, list[PaintedSurface]]:
    """Drawn shapes by body: wheels, a car around the chassis, engine and occupants."""
    person = [ball(0.13, PERSON_COLOUR).at(0.0, 0.0, 0.42), box(0.26, 0.4, 0.55, PERSON_COLOUR).at(0.0, 0.0, 0.02)]
    return {
        **{tyre.body: tyred_wheel(vehicle.body(tyre.body).position[2]) for tyre in vehicle.tyres},
        "engine": [box(0.5, 0.7, 0.45, ENGINE_COLOUR)],
        "left seat": person,
        "right seat": person,
        "body": _car_body(vehicle),
    }


def _car_body(vehicle: SpatialVehicle) -> list[PaintedSurface]:
    """Transparent car body of two convex outlines, in axes at the chassis' centre of mass."""
    x, _, z = vehicle.body("body").position
    front, rear = max(t.point[0] for t in vehicle.tyres), min(t.point[0] for t in vehicle.tyres)
    lower = [
        (rear - 0.7, 0.4),
        (rear - 0.55, 0.27),
        (front + 0.6, 0.27),
        (front + 0.72, 0.45),
        (front + 0.6, 0.68),
        (front - 0.35, 0.88),
        (rear - 0.6, 0.92),
    ]
    upper = [(rear - 0.45, 0.92), (front - 0.38, 0.88), (front - 1.05, 1.38), (rear + 0.15, 1.4)]
    outlines = ((lower, 1.66, 0.42), (upper, 1.4, 0.3))
    return [
        replace(extruded_outline(np.array(line) - [x, z], wide, PAINT_COLOUR), alpha=alpha)
        for line, wide, alpha in outlines
    ]
