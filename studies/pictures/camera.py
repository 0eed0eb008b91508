"""Where the spectator stands, and what a surface looks like from there."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from studies.pictures.raster import halved, paint
from studies.pictures.shapes import Surface

NEAREST = 0.05
"""m: what is nearer to the eye, or behind it, is not drawn."""
LIGHT = np.array([0.35, 0.5, 0.8])
"""Towards the lamp: to the spectator's right, back to him, up."""
HAZE = 70.0
"""m: how far one sees until the sky's lower colour hides two thirds."""
DIM = 0.4
"""Brightness of a surface that looks away from the lamp."""


@dataclass(frozen=True)
class Camera:
    """An eye that looks at a target (m), with the direction ``up``; opening : the picture's height in rad."""

    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    opening: float = 0.5

    @cached_property
    def axes(self) -> np.ndarray:
        """Rows: to the right, up, back to the spectator."""
        back = np.subtract(self.eye, self.target)
        back /= np.linalg.norm(back)
        right = np.cross(self.up, back)
        right /= np.linalg.norm(right)
        return np.array([right, np.cross(back, right), back])

    def pixels(self, height: int) -> float:
        """Pixels per metre at the target, in a picture of this height."""
        return height / (2.0 * np.tan(self.opening / 2.0) * float(np.linalg.norm(np.subtract(self.eye, self.target))))

    def horizon(self, height: int) -> float:
        """Row (pixels from the top) of what is far away and level with the eye; negative above the picture."""
        _, upright, back = self.axes
        level = float(np.dot(back, self.up) / np.dot(upright, self.up))
        return height / 2.0 * (1.0 - level / np.tan(self.opening / 2.0))

    def seen(self, points: np.ndarray, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
        """Pixels (..., 2) and inverse distances (...) of points (..., 3); not positive behind the eye."""
        own = (points - self.eye) @ self.axes.T
        near = -1.0 / own[..., 2]
        scale = height / (2.0 * np.tan(self.opening / 2.0)) * near
        return np.stack([width / 2.0 + scale * own[..., 0], height / 2.0 - scale * own[..., 1]], -1), near


def picture(camera: Camera, layers: list[list[Surface]], width: int, height: int, sky: np.ndarray) -> np.ndarray:
    """Image (h, w, 3) of surfaces before a sky, whose two colours are those of the picture's top and of the horizon.

    A later layer lies over all earlier ones, as arrows over bodies do.
    """
    down = np.clip(np.arange(2 * height) / max(1.0, 2.0 * camera.horizon(height)), 0.0, 1.0)[:, None]
    shade = (sky[0] + down * (sky[1] - sky[0])).astype(np.float32)
    image = np.broadcast_to(shade[:, None], (2 * height, 2 * width, 3)).copy()
    for layer in layers:
        nearest = np.zeros(image.shape[:2], np.float32)
        solid = [surface for surface in layer if surface.alpha == 1.0]
        if solid:
            paint(*_shaded(camera, solid, width, height, sky[1]), image, nearest)
        for surface in (surface for surface in layer if surface.alpha < 1.0):
            veil, front = image.copy(), nearest.copy()
            paint(*_shaded(camera, [surface], width, height, sky[1]), veil, front)
            image += np.float32(surface.alpha) * (veil - image)
    return halved(image)


def _shaded(
    camera: Camera, surfaces: list[Surface], width: int, height: int, haze: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What ``paint`` takes, of the triangles that lie before the eye."""
    corners, near = camera.seen(np.concatenate([one.corners for one in surfaces]), 2 * width, 2 * height)
    normals = np.concatenate([one.normals for one in surfaces])
    colours = np.repeat([one.colour for one in surfaces], [len(one.corners) for one in surfaces], axis=0)
    kept = ((near > 0.0) & (near < 1.0 / NEAREST)).all(axis=1)
    towards = LIGHT @ camera.axes / np.linalg.norm(LIGHT)
    light = DIM + (1.0 - DIM) * (0.5 + 0.5 * normals[kept] @ towards)
    clear = np.exp(-1.0 / (HAZE * near[kept]))[..., None]
    return corners[kept], near[kept], clear * light[..., None] * colours[kept, None] + (1.0 - clear) * haze
