"""One picture of a motion on its stage."""

import numpy as np
from scipy.spatial.transform import Rotation

from studies.pictures.camera import picture
from studies.pictures.film import Arrow, Motion, Stage
from studies.pictures.shapes import arrow, rod

SKY = np.array([[0.80, 0.87, 0.94], [0.985, 0.99, 1.0]])
"""Colour at the top of a picture and at the horizon."""
THICKNESS = 0.024
"""Half width of an arrow's head, by the height that the picture shows at its target."""
GREY = (0.35, 0.37, 0.4)


def drawn(motion: Motion, stage: Stage, k: int, width: int, height: int) -> np.ndarray:
    """Image (height, width, 3), colours from 0 to 1, of frame ``k``."""
    poses = {name: pose(motion, stage, name, k) for name in stage.shapes}
    bodies = [surface.moved(*poses[name]) for name, shapes in stage.shapes.items() for surface in shapes]
    around = stage.scenery(float(motion.times[k]))
    struts = [
        rod(_point(poses[s.one], s.point_one), _point(poses[s.two], s.point_two), 0.025, GREY) for s in stage.struts
    ]
    thick = THICKNESS * height / stage.camera.pixels(height)
    arrows = [
        arrow(*line, thick, stage.kinds[own.kind].colour)
        for own, line in zip(motion.arrows, lines(motion, stage, k), strict=True)
    ]
    return picture(stage.camera, [around + struts + bodies, [own for own in arrows if own]], width, height, SKY)


def lines(motion: Motion, stage: Stage, k: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Where each arrow of frame ``k`` begins and what it spans (3,), in m of the picture."""
    return [_line(own, motion, stage, k) for own in motion.arrows]


def _line(own: Arrow, motion: Motion, stage: Stage, k: int) -> tuple[np.ndarray, np.ndarray]:
    place, turn = pose(motion, stage, own.body, k)
    on_body = motion.turns[own.body][k].T @ (own.points[k] - motion.places[own.body][k])
    return place + turn @ on_body, stage.kinds[own.kind].scale * own.vectors[k]


def pose(motion: Motion, stage: Stage, body: str, k: int) -> tuple[np.ndarray, np.ndarray]:
    """Place (3,) and turn (3, 3) at which a body is drawn: magnified about its place at rest."""
    rest = np.array(stage.rest[body])
    place, turn = rest + stage.magnified * (motion.places[body][k] - rest), motion.turns[body][k]
    if body in stage.wheels:
        lean = _leaning(turn[:, 1])
        return place, _magnified(lean, stage.magnified) @ lean.as_matrix().T @ turn
    return place, _magnified(Rotation.from_matrix(turn), stage.magnified)


def _leaning(axle: np.ndarray) -> Rotation:
    """The smallest rotation that takes the y axis to an axle."""
    axis = np.cross([0.0, 1.0, 0.0], axle)
    sine = float(np.linalg.norm(axis))
    angle = np.arctan2(sine, axle[1])
    return Rotation.from_rotvec(axis * (angle / sine if sine > 0 else 0.0))


def _magnified(turn: Rotation, times: float) -> np.ndarray:
    return Rotation.from_rotvec(times * turn.as_rotvec()).as_matrix()


def _point(pose: tuple[np.ndarray, np.ndarray], point: tuple[float, float, float]) -> np.ndarray:
    return pose[0] + pose[1] @ np.array(point)
