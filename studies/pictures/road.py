"""Drawn road that moves past the vehicle: chequered tiles with the heights of both tracks."""

from dataclasses import dataclass

import numpy as np

from studies.pictures.shapes import Colour, PaintedSurface, box, flat_surface, floor, net_triangles

LIGHT_GREY: Colour = (0.60, 0.61, 0.63)
ASPHALT_COLOUR: Colour = (0.54, 0.55, 0.57)
GRASS_COLOUR: Colour = (0.55, 0.64, 0.46)
LINE_COLOUR: Colour = (0.97, 0.97, 0.95)
DRAWN_ROAD_LENGTH = 45.0
"""Length (m) of road that is drawn before and behind the vehicle."""
TILE_LENGTH = 0.5


@dataclass(frozen=True, eq=False)
class PassingRoad:
    """Road that moves past the vehicle at a speed (m/s): heights (n, 2) in m at ``distances`` (n,) in m along it, for
    two tracks at lateral positions ``track_positions`` (m).

    up_component : vertical component of the upward direction, 1 or -1; magnification : factor on the heights;
    half_width : half of the road's width (m).
    """

    distances: np.ndarray
    heights: np.ndarray
    track_positions: tuple[float, float]
    speed: float
    up_component: float = 1.0
    magnification: float = 1.0
    half_width: float = 2.6

    def surfaces_at(self, time: float) -> list[PaintedSurface]:
        """Surfaces of road, edge lines and grass at a time (s)."""
        first = np.floor((self.speed * time - DRAWN_ROAD_LENGTH) / TILE_LENGTH)
        stations = np.arange(first, first + 2.0 * DRAWN_ROAD_LENGTH / TILE_LENGTH)
        across = np.linspace(-self.half_width, self.half_width, 2 * round(self.half_width / TILE_LENGTH) + 1)
        x, y = np.meshgrid(TILE_LENGTH * stations - self.speed * time, across, indexing="ij")
        net = np.stack([x, y, self._magnified_height(x + self.speed * time, y)], -1)
        dark = (stations[:-1, None] + np.arange(len(across) - 1)) % 2 == 1
        if self.up_component < 0:
            net, dark = net[:, ::-1], dark[:, ::-1]
        grass = floor(-0.35 * self.up_component, GRASS_COLOUR, self.up_component)
        side, starts = self.half_width - 0.15, 4.0 * np.arange(-10, 11) - self.speed * time % 4.0
        marks = [
            box(1.6, 0.1, 0.02, LINE_COLOUR).at(
                x, y, float(self._magnified_height(x + self.speed * time, y)) + 0.01 * self.up_component
            )
            for x in starts
            for y in (-side, side)
        ]
        return [_chosen_tiles(net, dark, ASPHALT_COLOUR), _chosen_tiles(net, ~dark, LIGHT_GREY), grass, *marks]

    def _magnified_height(self, distance: np.ndarray, y: np.ndarray | float) -> np.ndarray:
        """Magnified height (m) of the drawn road at a distance (m) along it and a lateral position y (m)."""
        left, right_height = (np.interp(distance, self.distances, column) for column in self.heights.T)
        share = (np.asarray(y) - self.track_positions[0]) / (self.track_positions[1] - self.track_positions[0])
        return self.magnification * (left + share * (right_height - left))


def _chosen_tiles(net_of_points: np.ndarray, is_chosen: np.ndarray, colour: Colour) -> PaintedSurface:
    """Surface of the tiles of a net of points (a, b, 3) that ``is_chosen`` (a - 1, b - 1) selects."""
    return flat_surface(net_triangles(net_of_points)[np.tile(is_chosen.ravel(), 2)], colour)
