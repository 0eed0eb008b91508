"""Drawing of one frame of a filmed motion on its stage."""

import numpy as np
from scipy.spatial.transform import Rotation

from studies.pictures.camera import painted_picture
from studies.pictures.film import FilmedMotion, FilmStage
from studies.pictures.shapes import arrow, rod

SKY_COLOURS = np.array([[0.80, 0.87, 0.94], [0.985, 0.99, 1.0]])
"""Colours (red, green, blue) of the sky at the top of a picture and at the horizon."""
ARROW_HALF_WIDTH = 0.024
"""Half width of an arrow's head divided by the height (m) that the picture shows at the camera's target."""
GREY_COLOUR = (0.35, 0.37, 0.4)


def draw_frame(
    filmed_motion: FilmedMotion, film_stage: FilmStage, frame_number: int, picture_width: int, picture_height: int
) -> np.ndarray:
    """Image (height, width, 3), with colours from 0 to 1, of frame number ``frame_number`` of a motion."""
    poses = {name: drawn_pose(filmed_motion, film_stage, name, frame_number) for name in film_stage.shapes}
    bodies = [
        surface.rotated_and_shifted(*poses[name]) for name, shapes in film_stage.shapes.items() for surface in shapes
    ]
    around = film_stage.scenery(float(filmed_motion.times[frame_number]))

    def end(body_name: str, body_point: tuple[float, float, float]) -> np.ndarray:
        position, turn = poses[body_name]
        return position + turn @ np.array(body_point)

    struts = [
        rod(end(s.first_body, s.first_point), end(s.second_body, s.second_point), 0.025, GREY_COLOUR)
        for s in film_stage.drawn_rods
    ]
    thick = ARROW_HALF_WIDTH * picture_height / film_stage.camera.pixels_per_metre(picture_height)
    arrows = [
        arrow(*line, thick, film_stage.arrow_styles[force.kind].colour)
        for force, line in zip(filmed_motion.arrows, arrow_lines(filmed_motion, film_stage, frame_number), strict=True)
    ]
    arrow_surfaces = [surface for surface in arrows if surface]
    return painted_picture(
        film_stage.camera, [around + struts + bodies, arrow_surfaces], picture_width, picture_height, SKY_COLOURS
    )


def arrow_lines(
    filmed_motion: FilmedMotion, film_stage: FilmStage, frame_number: int
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Start point (3,) and vector (3,) in m, as drawn, of each force arrow in frame number ``frame_number``."""
    spans = []
    for force in filmed_motion.arrows:
        position, turn = drawn_pose(filmed_motion, film_stage, force.body, frame_number)
        on_body = filmed_motion.rotations[force.body][frame_number].T @ (
            force.points[frame_number] - filmed_motion.positions[force.body][frame_number]
        )
        spans.append(
            (position + turn @ on_body, film_stage.arrow_styles[force.kind].scale * force.vectors[frame_number])
        )
    return spans


def drawn_pose(
    filmed_motion: FilmedMotion, film_stage: FilmStage, body_name: str, frame_number: int
) -> tuple[np.ndarray, np.ndarray]:
    """Position (3,) in m and rotation (3, 3) with which a body is drawn in frame number ``frame_number``. Displacement
    and rotation from rest are magnified, except for a wheel's spin."""
    rest_position = np.array(film_stage.rest_positions[body_name])
    position, turn = (
        rest_position + film_stage.magnification * (filmed_motion.positions[body_name][frame_number] - rest_position),
        filmed_motion.rotations[body_name][frame_number],
    )
    if body_name in film_stage.wheel_bodies:
        # the smallest rotation that takes the y axis to the axle
        axis = np.cross([0.0, 1.0, 0.0], turn[:, 1])
        sine = float(np.linalg.norm(axis))
        angle = np.arctan2(sine, turn[1, 1])
        lean = Rotation.from_rotvec(axis * (angle / sine if sine > 0 else 0.0))
        return position, _magnified_rotation(lean, film_stage.magnification) @ lean.as_matrix().T @ turn
    return position, _magnified_rotation(Rotation.from_matrix(turn), film_stage.magnification)


def _magnified_rotation(rotation: Rotation, magnification: float) -> np.ndarray:
    return Rotation.from_rotvec(magnification * rotation.as_rotvec()).as_matrix()
