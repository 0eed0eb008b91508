"""Filmed motions, with poses computed by an engine, and the stage on which they are drawn.

Axes are those of the run, whatever they are; the camera's ``up`` says where up is. Lengths in m, forces in N.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from models.core.result import Result
from studies.pictures.camera import Camera
from studies.pictures.shapes import Colour, PaintedSurface


@dataclass(frozen=True, eq=False)
class ForceArrow:
    """Arrow of a force over f frames: points (f, 3) in m in space, on ``body``, and vectors (f, 3) in N; ``kind`` gives
    its scale and colour."""

    name: str
    kind: str
    body: str
    points: np.ndarray
    vectors: np.ndarray


@dataclass(frozen=True, eq=False)
class FilmedMotion:
    """Motion by one engine at the times (f,) in s of f frames: positions (f, 3) in m and rotations (f, 3, 3) of each
    body, from body to space axes.

    run : the drawn result, if the system has one.
    """

    engine: str
    times: np.ndarray
    positions: dict[str, np.ndarray]
    rotations: dict[str, np.ndarray]
    arrows: tuple[ForceArrow, ...] = ()
    run: Result | None = None


@dataclass(frozen=True)
class ArrowStyle:
    """Style of the force arrows of one kind: colour, scale (m/N), and the force (N) shown in the legend."""

    colour: Colour
    scale: float
    legend: float


@dataclass(frozen=True)
class ForceCurve:
    """Force that is plotted over time below the pictures: forces of one kind along a direction, and a name of the
    direction."""

    kind: str
    direction: tuple[float, float, float]
    direction_text: str


@dataclass(frozen=True)
class DrawnRod:
    """Drawn rod between two points (m), each fixed to a body, in the body's axes."""

    first_body: str
    first_point: tuple[float, float, float]
    second_body: str
    second_point: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class FilmStage:
    """Shapes of the bodies and of their surroundings, with the camera and the settings of the picture.

    shapes : surfaces of each body in its axes; rest_positions : position (m) of each body at rest; magnification :
    factor on displacements and rotations from rest (except for the spin of ``wheel_bodies`` about y); arrow_styles : by
    the kind of force; force_curve : plotted below; scenery : surfaces of the surroundings at a time (s), in space.
    """

    title: str
    caption: str
    shapes: dict[str, list[PaintedSurface]]
    rest_positions: Mapping[str, ArrayLike]
    camera: Camera
    arrow_styles: dict[str, ArrowStyle]
    force_curve: ForceCurve
    scenery: Callable[[float], list[PaintedSurface]] = lambda time: []
    magnification: float = 1.0
    wheel_bodies: tuple[str, ...] = ()
    drawn_rods: tuple[DrawnRod, ...] = ()


def largest_motion_differences(first_motion: FilmedMotion, second_motion: FilmedMotion) -> tuple[float, float, float]:
    """Largest differences between two filmed motions: of positions (m), of elements of rotation matrices, and of forces
    (N)."""
    position_pairs = [(position, second_motion.positions[name]) for name, position in first_motion.positions.items()]
    rotations = [(turn, second_motion.rotations[name]) for name, turn in first_motion.rotations.items()]
    forces = [(a.vectors, b.vectors) for a, b in zip(first_motion.arrows, second_motion.arrows, strict=True)]
    largest = (
        max((float(np.abs(a - b).max()) for a, b in pairs), default=0.0)
        for pairs in (position_pairs, rotations, forces)
    )
    return next(largest), next(largest), next(largest)


Poses = tuple[dict[str, np.ndarray], dict[str, np.ndarray]]
"""Positions (f, 3) in m and rotations (f, 3, 3), from body to space axes, of each body by its name, over f frames."""


def mujoco_poses(mujoco_model: Any, body_numbers: Mapping[str, int], coordinates: np.ndarray) -> Poses:
    """Poses of bodies by MuJoCo's ``mj_kinematics`` at its coordinates ``qpos`` (f, nq) of f frames; ``body_numbers`` :
    MuJoCo's body number for each name."""
    import mujoco

    data, frames = mujoco.MjData(mujoco_model), []
    for data.qpos[:] in coordinates:
        mujoco.mj_kinematics(mujoco_model, data)
        frames.append([(data.xpos[i].copy(), data.xmat[i].copy()) for i in body_numbers.values()])
    return _poses_of_frames(frames, body_numbers)


def exudyn_poses(mbs: Any, body_outputs: Mapping[str, Callable[[Any], Any]], coordinates: np.ndarray) -> Poses:
    """Poses of bodies by Exudyn at its coordinates (f, n) of f frames, in Exudyn's order; each function in
    ``body_outputs`` returns the body's value of an output variable."""
    import exudyn as exu

    kinds, frames = exu.OutputVariableType, []
    for row in coordinates:
        mbs.systemData.SetODE2Coordinates(row)
        frames.append([(ask(kinds.Position), ask(kinds.RotationMatrix)) for ask in body_outputs.values()])
    return _poses_of_frames(frames, body_outputs)


def _poses_of_frames(poses_in_frames: list[list[tuple[Any, Any]]], body_names: Iterable[str]) -> Poses:
    """Poses of every body from its (position, rotation) in every frame."""
    by_body = {
        name: list(zip(*path, strict=True))
        for name, path in zip(body_names, zip(*poses_in_frames, strict=True), strict=True)
    }
    positions = {name: np.array(position) for name, (position, _) in by_body.items()}
    return positions, {name: np.reshape(turn, (-1, 3, 3)) for name, (_, turn) in by_body.items()}
