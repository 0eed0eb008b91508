"""Film of the pitch-plane vehicle on a random road: shapes, camera, and wheel and suspension forces."""

from functools import partial
from typing import Any

import numpy as np

from models.engines.assembly import Assembly
from models.engines.protocol import build
from models.systems.pitch_plane.run import Channels, output_channels
from models.systems.pitch_plane.scene import assembly_of_scene, settings_of
from models.systems.pitch_plane.scene import build as scene_of
from models.vehicles.pitch_plane import equilibrium
from studies.pictures.camera import Camera
from studies.pictures.film import (
    ArrowStyle,
    DrawnRod,
    FilmedMotion,
    FilmStage,
    ForceArrow,
    ForceCurve,
    Poses,
    exudyn_poses,
    mujoco_poses,
)
from studies.pictures.road import DRAWN_ROAD_LENGTH, PassingRoad
from studies.pictures.shapes import PAINT_COLOUR, PaintedSurface, box, tyred_wheel

SPEED, SEED = 15.0, 1
MOTION_MAGNIFICATION = 3.0
WHEEL_RADIUS, CHASSIS_HEIGHT = 0.33, 0.95
"""Drawn wheel radius (m) and height (m) of the chassis' centre above the road, which the model does not have."""
ARROW_STYLES = {
    "wheel force": ArrowStyle((0.0, 0.62, 0.45), 1.2e-4, 4e3),
    "suspension force": ArrowStyle((0.84, 0.2, 0.0), 1.2e-4, 4e3),
}
FORCE_CURVE = ForceCurve("wheel force", (0.0, 0.0, -1.0), "upwards")
EXUDYN_AXES = np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
"""Directions of Exudyn's axes as columns: backward, down, to the right."""


def stage_and_motions(
    duration: float, frame_times: np.ndarray, engines: tuple[str, ...]
) -> tuple[FilmStage, list[FilmedMotion]]:
    """Stage of the film, and the motion by each engine, with frames at the steps nearest to ``frame_times`` (s)."""
    run = {"duration": float(np.ceil(duration + DRAWN_ROAD_LENGTH / SPEED)), "step": 1e-3}
    scene = scene_of(
        {
            "title": "pitch plane",
            "run": run,
            "effects": {"road": {"source": "iso8608", "road_class": "D", "seed": SEED, "speed": SPEED}},
        }
    )
    assembly = assembly_of_scene(scene)
    runs = [_motion_of_engine(engine, assembly, frame_times) for engine in engines]
    return stage(assembly, runs[0][1]), [motion for motion, _ in runs]


def _motion_of_engine(engine: str, assembly: Assembly, frame_times: np.ndarray) -> tuple[FilmedMotion, Channels]:
    """Filmed motion of the vehicle in an engine with frames near the times (s), and the channels of its run."""
    model: Any = build(engine, assembly, settings_of(assembly.scene, engine))
    run = model.run()
    channels = output_channels(assembly, run)
    rows = np.rint(frame_times / (run.times[1] - run.times[0])).astype(int)
    positions, turns = (_exudyn_poses if engine == "exudyn" else _mujoco_poses)(model, run.states[rows, :4])
    poses = {name: position + _body_offset(assembly, name) for name, position in positions.items()}, turns
    return FilmedMotion(engine, run.times[rows], *poses, force_arrows(assembly, channels, rows, poses)), channels


def _mujoco_poses(engine_model: Any, states: np.ndarray) -> Poses:
    """Poses of the bodies by MuJoCo at states (f, n) of f frames."""
    names = [body.name for body in engine_model.assembly.vehicle.bodies]
    positions, turns = mujoco_poses(
        engine_model.model, {name: engine_model.model.body(name).id for name in names}, states
    )
    return {name: position * [0.0, 1.0, 1.0] for name, position in positions.items()}, turns


def _exudyn_poses(engine_model: Any, states: np.ndarray) -> Poses:
    """Poses of the bodies by Exudyn, from the coordinates (f, 4) of the states in f frames; wheels are point masses
    without rotation."""
    import exudyn as exu

    mbs, nodes = engine_model.built.mbs, engine_model.built.nodes

    def ask(exudyn_node: Any, output_kind: Any) -> Any:
        point = mbs.GetNode(exudyn_node)["nodeType"] == "Point2D"
        asks_rotation = output_kind == exu.OutputVariableType.RotationMatrix
        return np.eye(3) if point and asks_rotation else mbs.GetNodeOutput(exudyn_node, output_kind)

    coordinates = np.zeros((len(states), 7))
    coordinates[:, [1, 3, 5, 6]] = states
    positions, turns = exudyn_poses(mbs, {name: partial(ask, node) for name, node in nodes.items()}, coordinates)
    return (
        {name: position @ EXUDYN_AXES.T for name, position in positions.items()},
        {name: EXUDYN_AXES @ turn @ EXUDYN_AXES.T for name, turn in turns.items()},
    )


def _body_offset(assembly: Assembly, body_name: str) -> np.ndarray:
    """Position (3,) in m at which a body is drawn if its coordinates are zero; the model has neither longitudinal
    positions nor heights."""
    x = {axle.wheel: axle.x for axle in assembly.vehicle.axles}.get(body_name)
    return np.array([0.0, 0.0, -CHASSIS_HEIGHT]) if x is None else np.array([x, 0.0, -WHEEL_RADIUS])


def force_arrows(
    assembly: Assembly, run_channels: Channels, frame_rows: np.ndarray, body_poses: Poses
) -> tuple[ForceArrow, ...]:
    """Force arrows of the road on the wheels and of the suspension on the chassis, in the frames ``frame_rows`` of a
    run."""
    upward, (positions, turns), arrows_drawn = np.array([0.0, 0.0, -1.0]), body_poses, []
    for axle, wheel, strut in zip(assembly.vehicle.axles, ("f1", "f2"), ("f3", "f4"), strict=True):
        road, mount = np.array([0.0, 0.0, WHEEL_RADIUS]), np.array([axle.x, 0.0, 0.0])
        on_wheel, on_chassis = (run_channels[name][2][frame_rows, None] * upward for name in (wheel, strut))
        mounts = positions["chassis"] + turns["chassis"] @ mount
        arrows_drawn.append(
            ForceArrow(f"wheel force, {axle.name}", "wheel force", axle.wheel, positions[axle.wheel] + road, on_wheel)
        )
        arrows_drawn.append(
            ForceArrow(f"suspension force, {axle.name}", "suspension force", "chassis", mounts, on_chassis)
        )
    return tuple(arrows_drawn)


def stage(assembly: Assembly, run_channels: Channels) -> FilmStage:
    """Stage of the film: the vehicle, seen from its right, on a passing road; z down."""
    height = run_channels["zeta1"][2]
    distances = assembly.vehicle.axles[0].x + SPEED * np.linspace(0.0, assembly.scene.run.duration, len(height))
    road = PassingRoad(
        distances, np.column_stack([height, height]), (-1.0, 1.0), SPEED, -1.0, MOTION_MAGNIFICATION, 1.0
    )
    level = equilibrium(assembly.parameters, assembly.vehicle.geometry)
    names = [body.name for body in assembly.vehicle.bodies]
    rest_positions = {
        name: _body_offset(assembly, name) + np.array([0.0, 0.0, level[i]]) for i, name in enumerate(names)
    }
    struts = tuple(
        DrawnRod("chassis", (axle.x, 0.0, 0.0), axle.wheel, (0.0, 0.0, 0.0)) for axle in assembly.vehicle.axles
    )
    caption = f"displacements and road drawn {MOTION_MAGNIFICATION:g} times as large; forces on wheels and chassis"
    camera = Camera((1.5, 4.6, -1.5), (0.0, 0.0, -0.66), (0.0, 0.0, -1.0), 0.46)
    return FilmStage(
        f"Pitch-plane vehicle at {SPEED:g} m/s on a road of class D",
        caption,
        body_shapes(assembly),
        rest_positions,
        camera,
        ARROW_STYLES,
        FORCE_CURVE,
        road.surfaces_at,
        MOTION_MAGNIFICATION,
        drawn_rods=struts,
    )


def body_shapes(assembly: Assembly) -> dict[str, list[PaintedSurface]]:
    """Drawn shapes by body: a beam for the chassis, and two wheels."""
    p = assembly.parameters
    beam = box(p.a + p.b + 0.5, 0.5, 0.14, PAINT_COLOUR).at((p.b - p.a) / 2.0, 0.0, -0.07)
    return {axle.wheel: tyred_wheel(WHEEL_RADIUS) for axle in assembly.vehicle.axles} | {"chassis": [beam]}
