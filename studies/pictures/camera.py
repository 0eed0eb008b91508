"""Camera of a picture, and drawing of shaded triangles into pixels.

The nearest surface wins at every pixel; colours run straight between corners.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from models.machine.compiled import njit
from studies.pictures.shapes import PaintedSurface

NEAREST_DRAWN = 0.05
"""Least distance (m) from the camera at which surfaces are drawn."""
LIGHT_DIRECTION = np.array([0.35, 0.5, 0.8])
"""Direction towards the lamp in the camera's axes: right, up, back."""
HAZE_DISTANCE = 70.0
"""Distance (m) at which haze in the colour of the horizon covers 63 % of a surface's colour."""
SHADED_BRIGHTNESS = 0.4
"""Brightness of a surface that faces away from the lamp, relative to one that faces it."""


@dataclass(frozen=True)
class Camera:
    """A camera at ``eye`` that looks at ``target`` (both in m); ``up``: vector that points upward in the picture;
    angle_of_view: vertical angle of view (rad)."""

    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    angle_of_view: float = 0.5

    @cached_property
    def axes(self) -> np.ndarray:
        """Unit vectors (3, 3) of the camera's axes as rows: right, up, and from the target back to the camera."""
        back = np.subtract(self.eye, self.target)
        back /= np.linalg.norm(back)
        right = np.cross(self.up, back)
        right /= np.linalg.norm(right)
        return np.array([right, np.cross(back, right), back])

    def pixels_per_metre(self, picture_height: int) -> float:
        """Pixels per metre at the camera's target, in a picture of a height in pixels."""
        return picture_height / (
            2.0 * np.tan(self.angle_of_view / 2.0) * float(np.linalg.norm(np.subtract(self.eye, self.target)))
        )

    def horizon_row(self, picture_height: int) -> float:
        """Row (pixels from the top) of the horizon in a picture of a height in pixels; negative if it lies above the
        picture."""
        _, upright, back = self.axes
        level = float(np.dot(back, self.up) / np.dot(upright, self.up))
        return picture_height / 2.0 * (1.0 - level / np.tan(self.angle_of_view / 2.0))

    def projected_points(
        self, points: np.ndarray, picture_width: int, picture_height: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Pixels (..., 2) of points (..., 3) in m, and inverse distances (...) in 1/m along the camera's axis; these
        are negative for points behind the camera."""
        in_camera_axes = (points - self.eye) @ self.axes.T
        near = -1.0 / in_camera_axes[..., 2]
        scale = picture_height / (2.0 * np.tan(self.angle_of_view / 2.0)) * near
        return np.stack(
            [
                picture_width / 2.0 + scale * in_camera_axes[..., 0],
                picture_height / 2.0 - scale * in_camera_axes[..., 1],
            ],
            -1,
        ), near


def painted_picture(
    camera: Camera,
    surface_layers: list[list[PaintedSurface]],
    picture_width: int,
    picture_height: int,
    sky_colours: np.ndarray,
) -> np.ndarray:
    """Image (height, width, 3) of surfaces in front of a sky; sky_colours (2, 3) : its colours at the top of the
    picture and at the horizon.

    A later layer lies over all earlier ones, as arrows over bodies do.
    """
    height_share = np.clip(
        np.arange(2 * picture_height) / max(1.0, 2.0 * camera.horizon_row(picture_height)), 0.0, 1.0
    )[:, None]
    shade = (sky_colours[0] + height_share * (sky_colours[1] - sky_colours[0])).astype(np.float32)
    image = np.broadcast_to(shade[:, None], (2 * picture_height, 2 * picture_width, 3)).copy()
    for layer in surface_layers:
        inverse_depths = np.zeros(image.shape[:2], np.float32)
        solid = [surface for surface in layer if surface.alpha == 1.0]
        if solid:
            paint_triangles(
                *_shaded_triangles(camera, solid, picture_width, picture_height, sky_colours[1]), image, inverse_depths
            )
        for surface in (surface for surface in layer if surface.alpha < 1.0):
            veil, front = image.copy(), inverse_depths.copy()
            paint_triangles(
                *_shaded_triangles(camera, [surface], picture_width, picture_height, sky_colours[1]), veil, front
            )
            image += np.float32(surface.alpha) * (veil - image)
    return (image[::2, ::2] + image[1::2, ::2] + image[::2, 1::2] + image[1::2, 1::2]) / 4.0  # smooth edges


def _shaded_triangles(
    camera: Camera, surfaces: list[PaintedSurface], picture_width: int, picture_height: int, haze_colour: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners, inverse distances and colours, as ``paint_triangles`` takes them, of the triangles in front of the
    camera."""
    corners, near = camera.projected_points(
        np.concatenate([surface.corners for surface in surfaces]), 2 * picture_width, 2 * picture_height
    )
    normals = np.concatenate([surface.normals for surface in surfaces])
    sizes = [len(surface.corners) for surface in surfaces]
    colours = np.repeat([surface.colour for surface in surfaces], sizes, axis=0)
    in_front = ((near > 0.0) & (near < 1.0 / NEAREST_DRAWN)).all(axis=1)
    towards = LIGHT_DIRECTION @ camera.axes / np.linalg.norm(LIGHT_DIRECTION)
    light = SHADED_BRIGHTNESS + (1.0 - SHADED_BRIGHTNESS) * (0.5 + 0.5 * normals[in_front] @ towards)
    clear = np.exp(-1.0 / (HAZE_DISTANCE * near[in_front]))[..., None]
    return (
        corners[in_front],
        near[in_front],
        clear * light[..., None] * colours[in_front, None] + (1.0 - clear) * haze_colour,
    )


@njit(cache=True, error_model="numpy")
def columns_with_positive_value(start_value, growth_per_column, left_column, right_column):
    """First and last column between ``left_column`` and ``right_column`` for which start_value + column * growth is not
    negative; the first is greater than the last if there is no such column.
    """
    if growth_per_column > 0.0:
        return max(left_column, -start_value / growth_per_column), right_column
    if growth_per_column < 0.0:
        return left_column, min(right_column, -start_value / growth_per_column)
    return left_column, right_column if start_value >= 0.0 else left_column - 1.0


@njit(cache=True, error_model="numpy")
def paint_triangles(corners, inverse_distances, colours, image, inverse_depths):
    """Paint triangles into ``image`` (h, w, 3), at pixels where the triangle is nearer to the camera than the surface
    recorded in ``inverse_depths`` (h, w), in 1/m.

    corners (m, 3, 2) : pixels, x to the right, y down; inverse_distances (m, 3) : from the camera (1/m), which are
    linear in pixels; colours (m, 3, 3) : red, green, blue from 0 to 1 at each corner.
    """
    height, width = inverse_depths.shape
    for k in range(len(corners)):
        x0, y0 = corners[k, 0]
        x1, y1 = corners[k, 1]
        x2, y2 = corners[k, 2]
        area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        if area == 0.0:
            continue
        top, bottom = max(0, math.ceil(min(y0, y1, y2))), min(height - 1, math.floor(max(y0, y1, y2)))
        for row in range(top, bottom + 1):
            # Shares of corners 1 and 2 at column 0, and their growth from column to column.
            first, one_on = (-x0 * (y2 - y0) - (x2 - x0) * (row - y0)) / area, (y2 - y0) / area
            weight_of_second, two_on = ((x1 - x0) * (row - y0) + x0 * (y1 - y0)) / area, -(y1 - y0) / area
            left, right = columns_with_positive_value(
                first, one_on, max(0.0, min(x0, x1, x2)), min(width - 1.0, max(x0, x1, x2))
            )
            left, right = columns_with_positive_value(weight_of_second, two_on, left, right)
            left, right = columns_with_positive_value(1.0 - first - weight_of_second, -one_on - two_on, left, right)
            for column in range(math.ceil(left), math.floor(right) + 1):
                b, c = first + column * one_on, weight_of_second + column * two_on
                a = 1.0 - b - c
                inverse_depth = a * inverse_distances[k, 0] + b * inverse_distances[k, 1] + c * inverse_distances[k, 2]
                if inverse_depth > inverse_depths[row, column]:
                    inverse_depths[row, column] = inverse_depth
                    for i in range(3):
                        image[row, column, i] = a * colours[k, 0, i] + b * colours[k, 1, i] + c * colours[k, 2, i]
