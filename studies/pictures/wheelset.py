"""Film of a wheelset that hunts on its rails: shapes, camera, and contact forces."""

from functools import partial
from typing import Any

import numpy as np

from models.core.discretisation import not_estimated
from models.rail.contact_point import LEFT, RIGHT, ConicalWheel, cone_on_rail
from models.rail.equations import ROLL, YAW, WheelsetPath, Y, Z
from models.rail.joint_forces import JOINTS, joints_from_states
from models.rail.profile_contact import WheelPose
from models.rail.wheelset import CHOSEN_WHEELSET, Wheelset
from models.systems.wheelset.of_scene import equations_and_start
from models.systems.wheelset.run import run as simulate
from models.systems.wheelset.scene import build
from studies.pictures.camera import Camera
from studies.pictures.film import (
    ArrowStyle,
    FilmedMotion,
    FilmStage,
    ForceArrow,
    ForceCurve,
    exudyn_poses,
    mujoco_poses,
)
from studies.pictures.shapes import Colour, PaintedSurface, box, extruded_outline, floor, surface_of_revolution

SPEED, START_SHIFT, CELLS, STEP = 75.0, 6e-3, 11, 5e-4
"""Speed of travel (m/s), initial lateral displacement (m), number of cells of FASTSIM, and step (s)."""
MOTION_MAGNIFICATION = 5.0
SLEEPER_SPACING = 0.6
"""Distance (m) from one sleeper to the next."""
STEEL_COLOUR: Colour = (0.62, 0.66, 0.71)
DARK_COLOUR: Colour = (0.42, 0.45, 0.5)
RUST_COLOUR: Colour = (0.45, 0.27, 0.16)
RAIL_COLOUR: Colour = (0.66, 0.56, 0.5)
CONCRETE_COLOUR: Colour = (0.72, 0.71, 0.68)
BALLAST_COLOUR: Colour = (0.56, 0.54, 0.51)
ARROW_STYLES = {
    "normal force": ArrowStyle((0.0, 0.62, 0.45), 8e-6, 5e4),
    "creep force": ArrowStyle((0.84, 0.2, 0.0), 1e-4, 2e3),
}
FORCE_CURVE = ForceCurve("creep force", (0.0, 1.0, 0.0), "across the track, to the right")
SIDE_SIGNS = {"right": RIGHT, "left": LEFT}


def stage_and_motions(
    duration: float, frame_times: np.ndarray, engines: tuple[str, ...]
) -> tuple[FilmStage, list[FilmedMotion]]:
    """Stage of the film, and the motion by each engine, with frames at the steps nearest to ``frame_times`` (s)."""
    return stage(CHOSEN_WHEELSET), [_motion_of_engine(engine, duration, frame_times) for engine in engines]


def _motion_of_engine(engine: str, duration: float, frame_times: np.ndarray) -> FilmedMotion:
    """Filmed motion of the wheelset in an engine over a duration (s), with frames near the times (s)."""
    scene = build(
        {
            "title": "wheelset",
            "system": "wheelset",
            "contact": {"cells": CELLS},
            "speeds": {"values": [SPEED]},
            "run": {"duration": duration, "step": STEP, "displacement": START_SHIFT, "speeds": [SPEED]},
        }
    )
    equations: Any = equations_and_start(scene, engine, SPEED)[0]
    run = not_estimated(simulate(scene, engine, SPEED), "a film shows the path, and the study wheelset its error")
    path: WheelsetPath = run.detail
    rows = np.rint(frame_times / STEP).astype(int)
    path_of_frames = WheelsetPath(path.times[rows], path.states[rows], contacts=path.contacts[rows])
    joints = joints_from_states(path_of_frames.states)[:, :JOINTS]
    if engine == "mujoco":
        poses = mujoco_poses(equations.model.model, {"wheelset": 1}, joints)
    else:  # by a marker in the middle of the axle: the last link of its tree
        from models.engines.exudyn_system import items

        mbs, origin = equations.model.mbs, [0.0, 0.0, 0.0]
        link = items.MarkerKinematicTreeRigid(
            objectNumber=equations.model.tree, linkNumber=JOINTS - 1, localPosition=origin
        )
        middle = mbs.AddMarker(link)
        mbs.Assemble()
        poses = exudyn_poses(mbs, {"wheelset": partial(mbs.GetMarkerOutput, middle)}, joints)
    return FilmedMotion(engine, path_of_frames.times, *poses, force_arrows(CHOSEN_WHEELSET, path_of_frames), run)


def force_arrows(wheelset: Wheelset, wheelset_run: WheelsetPath) -> tuple[ForceArrow, ...]:
    """Force arrows of the normal force and the creep force on both wheels, at the contact points along a run."""
    drawn_arrows = []
    for k, (name, side) in enumerate(SIDE_SIGNS.items()):
        cone = ConicalWheel(wheelset.radius, wheelset.half_gauge, wheelset.conicity, wheelset.head_radius)
        touched = [
            cone_on_rail(side, WheelPose(*state[[Y, Z, ROLL, YAW]].tolist()), cone) for state in wheelset_run.states
        ]
        points = np.array(touched)[:, -3:] + wheelset_run.states[:, [Y, Z]] @ np.eye(3)[1:]  # in the track's axes
        contact = wheelset_run.contacts[:, k]
        sine, cosine, zeros = np.sin(contact["angle"]), np.cos(contact["angle"]), 0.0 * contact["angle"]
        normal = contact["load"][:, None] * np.stack([zeros, sine, -cosine], 1)
        creep = np.stack([contact["fx"], contact["fy"] * cosine, contact["fy"] * sine], 1)
        drawn_arrows += [
            ForceArrow(f"{kind}, {name}", kind, "wheelset", points, force)
            for kind, force in zip(ARROW_STYLES, (normal, creep), strict=True)
        ]
    return tuple(drawn_arrows)


def stage(wheelset: Wheelset) -> FilmStage:
    """Stage of the film: wheelset, rails and sleepers, seen from ahead and to the right; z down."""
    camera = Camera((2.75, 1.75, -0.95), (0.0, 0.12, 0.06), (0.0, 0.0, -1.0), 0.54)
    return FilmStage(
        f"Wheelset that hunts at {SPEED:g} m/s, creep forces by FASTSIM",
        f"displacements drawn {MOTION_MAGNIFICATION:g} times as large; forces on the wheels",
        {"wheelset": wheelset_shapes(wheelset)},
        {"wheelset": (0.0, 0.0, 0.0)},
        camera,
        ARROW_STYLES,
        FORCE_CURVE,
        lambda time: track_surfaces(wheelset, SPEED * time),
        MOTION_MAGNIFICATION,
        ("wheelset",),
    )


def wheelset_shapes(wheelset: Wheelset) -> list[PaintedSurface]:
    """Surfaces of an axle and two wheels with the model's conical treads; the flange clearance is drawn magnified."""
    end = wheelset.half_spacing + 0.12
    surfaces = [surface_of_revolution([-end, -end, end, end], [0.0, 0.085, 0.085, 0.0], DARK_COLOUR)]
    inner, outer = 0.036 + MOTION_MAGNIFICATION * wheelset.flange_clearance + 0.004, 0.075
    across = (
        np.array([-inner - 0.03, -inner - 0.025, -inner, outer, outer, 0.02, 0.02, 0.05, 0.05]) + wheelset.half_gauge
    )
    tread = [
        wheelset.radius + 0.028,
        wheelset.radius + wheelset.conicity * inner,
        wheelset.radius - wheelset.conicity * outer,
    ]
    radii = np.array([0.0, *tread, 0.39, 0.37, 0.19, 0.16, 0.0])
    for side, order in ((1.0, slice(None)), (-1.0, slice(None, None, -1))):
        surfaces.append(surface_of_revolution(side * across[order], radii[order], STEEL_COLOUR, segment_count=72))
        surfaces += [
            box(0.09, 0.03, 0.09, RUST_COLOUR).at(0.28 * np.cos(a), side * (wheelset.half_gauge + y), 0.28 * np.sin(a))
            for a in np.arange(6) * np.pi / 3.0
            for y in (0.016, -inner - 0.02)
        ]
    return surfaces


def track_surfaces(wheelset: Wheelset, travelled_distance: float) -> list[PaintedSurface]:
    """Surfaces of rails, sleepers and ballast after the wheelset has travelled a distance (m)."""
    first, rail_end, top = -24.0, 2.4, wheelset.radius
    head = np.array([[-0.036, 0.012], [-0.02, 0.0], [0.02, 0.0], [0.036, 0.012], [0.036, 0.05], [-0.036, 0.05]])
    rotation = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # the outline lies in y and z
    rail = [
        extruded_outline(head, rail_end - first, STEEL_COLOUR).rotated_and_shifted(np.zeros(3), rotation),
        box(rail_end - first, 0.02, 0.1, RAIL_COLOUR).at(0.0, 0.0, 0.1),
        box(rail_end - first, 0.14, 0.02, RAIL_COLOUR).at(0.0, 0.0, 0.16),
    ]
    sides = wheelset.half_gauge, -wheelset.half_gauge
    surfaces = [surface.at((first + rail_end) / 2.0, y, top) for y in sides for surface in rail]
    phase = travelled_distance % SLEEPER_SPACING
    for i in range(int(np.ceil(first / SLEEPER_SPACING)), int(np.floor(rail_end / SLEEPER_SPACING)) + 1):
        surfaces.append(box(0.24, 2.5, 0.1, CONCRETE_COLOUR).at(i * SLEEPER_SPACING - phase + 0.3, 0.0, top + 0.22))
    return [*surfaces, floor(top + 0.24, BALLAST_COLOUR, -1.0)]
