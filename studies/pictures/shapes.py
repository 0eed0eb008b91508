"""Drawn surfaces of simple bodies as triangles, in the body's axes (m)."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

Colour = tuple[float, float, float]
PAINT_COLOUR: Colour = (0.16, 0.42, 0.72)
RUBBER_COLOUR: Colour = (0.16, 0.16, 0.17)
RIM_COLOUR: Colour = (0.78, 0.79, 0.8)
FLOOR_DISTANCE = 150.0
"""Distance (m) from the middle of a drawn floor to its edges."""


@dataclass(frozen=True, eq=False)
class PaintedSurface:
    """Surface of m triangles: corners (m, 3, 3) in m, outward unit normals at the corners (m, 3, 3), and colour (red,
    green, blue from 0 to 1).

    alpha : opacity from 0 to 1.
    """

    corners: np.ndarray
    normals: np.ndarray
    colour: Colour
    alpha: float = 1.0

    def rotated_and_shifted(self, displacement: np.ndarray, rotation: np.ndarray) -> "PaintedSurface":
        """The surface rotated by ``rotation`` (3, 3) and then shifted by ``displacement`` (3,) in m."""
        return replace(self, corners=self.corners @ rotation.T + displacement, normals=self.normals @ rotation.T)

    def at(self, *displacement: float) -> "PaintedSurface":
        """The surface shifted by x, y, z (m)."""
        return replace(self, corners=self.corners + np.array(displacement))


def flat_surface(corners: np.ndarray, colour: Colour) -> PaintedSurface:
    """Surface of flat triangles with corners (m, 3, 3) in m, counter-clockwise seen from outside."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals /= np.where(length > 0, length, 1.0)
    return PaintedSurface(corners, np.repeat(normals[:, None], 3, axis=1), colour)


def net_triangles(net_points: np.ndarray) -> np.ndarray:
    """Triangles (2 (a - 1)(b - 1), 3, 3) of a net of points (a, b, 3)."""
    first, second_corner, three, four = (
        net_points[:-1, :-1],
        net_points[1:, :-1],
        net_points[1:, 1:],
        net_points[:-1, 1:],
    )
    return np.concatenate(
        [
            np.stack([first, second_corner, three], 2).reshape(-1, 3, 3),
            np.stack([first, three, four], 2).reshape(-1, 3, 3),
        ]
    )


def surface_of_revolution(
    axial_positions: ArrayLike, radii: ArrayLike, colour: Colour, segment_count: int = 48
) -> PaintedSurface:
    """Surface of revolution about y from an outline of positions along y and radii (m), from left to right; it is
    shaded smoothly around the axis, with sharp edges at the outline's corners."""
    angles = np.linspace(0.0, 2.0 * np.pi, segment_count + 1)
    y, r = np.array(axial_positions, float), np.array(radii, float)
    ring = np.stack([np.sin(angles), 0.0 * angles, np.cos(angles)], 1)
    net = r[:, None, None] * ring + np.stack([0 * y, y, 0 * y], 1)[:, None]
    slopes = np.stack([np.diff(y), -np.diff(r)], 1)
    length = np.linalg.norm(slopes, axis=1, keepdims=True)
    slopes /= np.where(length > 0, length, 1.0)
    corners = [net_triangles(net[i : i + 2]) for i in range(len(slopes))]
    normals = [net_triangles(np.stack([slope[0] * ring + [0.0, slope[1], 0.0]] * 2)) for slope in slopes]
    return PaintedSurface(np.concatenate(corners), np.concatenate(normals), colour)


def tyred_wheel(radius: float) -> list[PaintedSurface]:
    """Surfaces of a wheel of a radius (m) about the y axis: tyre and rim."""
    tyre = surface_of_revolution(
        [-0.1, -0.1, -0.07, 0.07, 0.1, 0.1], np.array([0.62, 0.92, 1.0, 1.0, 0.92, 0.62]) * radius, RUBBER_COLOUR
    )
    return [
        tyre,
        surface_of_revolution([-0.09, -0.09, 0.09, 0.09], np.array([0.0, 0.64, 0.64, 0.0]) * radius, RIM_COLOUR),
    ]


def box(x_length: float, y_length: float, z_length: float, colour: Colour) -> PaintedSurface:
    """Surface of a box about the origin with edge lengths x, y, z (m)."""
    half = np.array([x_length, y_length, z_length]) / 2.0
    return extruded_outline(np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half[[0, 2]], 2.0 * half[1], colour)


def extruded_outline(outline: np.ndarray, width: float, colour: Colour) -> PaintedSurface:
    """Surface of a convex outline (n, 2) in x and z (m), counter-clockwise from x to z, extruded along y to a width (m)
    about the origin."""
    front = np.insert(outline, 1, -width / 2.0, axis=1)
    back = np.insert(outline, 1, width / 2.0, axis=1)
    fan = [
        np.stack([np.broadcast_to(side[:1], side[2:].shape), side[1:-1], side[2:]], 1) for side in (front, back[::-1])
    ]
    closed = np.stack([np.vstack([front, front[:1]]), np.vstack([back, back[:1]])])
    return flat_surface(np.concatenate([*fan, net_triangles(closed)]), colour)


def floor(height: float, colour: Colour, up_sign: float) -> PaintedSurface:
    """Surface of a horizontal square about the origin at height z (m); its tiles are small near the origin, because
    tiles that reach behind the camera are not drawn.

    up_sign : 1 if z is up, -1 if it is down.
    """
    lines = FLOOR_DISTANCE * np.sinh(np.linspace(-6.0, 6.0, 57)) / np.sinh(6.0)
    x, y = np.meshgrid(up_sign * lines, lines, indexing="ij")
    return flat_surface(net_triangles(np.stack([x, y, np.full_like(x, height)], -1)), colour)


def ball(radius: float, colour: Colour) -> PaintedSurface:
    """Surface of a sphere of a radius (m) about the origin."""
    angle = np.linspace(0.0, np.pi, 17)
    round_about = surface_of_revolution(-radius * np.cos(angle), radius * np.sin(angle), colour, 32)
    return replace(round_about, normals=round_about.corners / radius)


def line_solid(
    tail_point: np.ndarray, head_point: np.ndarray, axial_positions: np.ndarray, radii: np.ndarray, colour: Colour
) -> PaintedSurface:
    """Surface of revolution about the axis from a point (tail) to another (head); ``axial_positions`` : positions (m)
    along the axis from the tail; ``radii`` : radii (m) there."""
    direction = (head_point - tail_point) / np.linalg.norm(head_point - tail_point)
    perpendicular = np.cross(direction, np.eye(3)[np.abs(direction).argmin()])
    perpendicular /= np.linalg.norm(perpendicular)
    turn = np.column_stack([perpendicular, direction, np.cross(perpendicular, direction)])
    return surface_of_revolution(axial_positions, radii, colour, 16).rotated_and_shifted(tail_point, turn)


def rod(tail_point: np.ndarray, head_point: np.ndarray, radius: float, colour: Colour) -> PaintedSurface:
    """Surface of a round rod of a radius (m) from one point to another."""
    length = float(np.linalg.norm(head_point - tail_point))
    return line_solid(
        tail_point, head_point, np.array([0.0, 0.0, length, length]), radius * np.array([0.0, 1.0, 1.0, 0.0]), colour
    )


def arrow(tail_point: np.ndarray, arrow_vector: np.ndarray, thickness: float, colour: Colour) -> PaintedSurface | None:
    """Surface of an arrow as long as the vector (3,) in m; None if it is shorter than a tenth of its thickness (m)."""
    length = float(np.linalg.norm(arrow_vector))
    if length < 0.1 * thickness:
        return None
    head = min(2.6 * thickness, length)
    axial = np.array([0.0, 0.0, length - head, length - head, length])
    radii = thickness * min(1.0, length / (2.6 * thickness)) * np.array([0.0, 0.35, 0.35, 1.0, 0.0])
    return line_solid(tail_point, tail_point + arrow_vector, axial, radii, colour)
