"""Random road under two tracks as a mean height and a roll process, and the heights that every wheel meets.

The height at y (m, to the left) of a straight lane is z = z_M + y theta, heights up, z_M and theta independent, each
white noise through a shape filter in path (G. Rill, The Influence of Correlated Random Road-Excitation Processes on
Vehicle Vibrations, eq. 3 to 7: z_l = z_M + b2 theta, z_r = z_M - b1 theta). Hence over the wavenumber Omega (rad/m),
two-sided:

    S(y1, y2) = S_M + y1 y2 S_theta,    coherency = |S(y1, y2)| / sqrt(S(y1, y1) S(y2, y2)),

the square of which others call the coherence. A track's spectrum at y tends to S0(y) / Omega^2 with
S0(y) = (q1 + y^2 q2) / (2 pi); one-sided, as ISO 8608 counts, twice that.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from models.core.errors import InputError
from models.road.excitation import RoadExcitation
from models.road.iso8608 import class_at_level
from models.road.shape_filter import ShapeFilter
from models.vehicles.linear_vehicle import WheelPosition

MEAN_CORNER, ROLL_CORNER = 0.3, 1.5
"""Corner wavenumbers (rad/m) of the mean height and the roll process in Rill's paper."""
TRACK_DENSITY_LEVEL = 1.6e-5
"""Level S0 (m) of a track in Rill's paper, as far as a bad scan of it can be read; neither exponent nor split between
the two processes is certain."""
TRACK_CORRELATIONS = ("modelled", "uncorrelated", "equal")
FRONT_REAR = ("delayed", "uncorrelated", "equal")
CORRELATION_CASES = {
    1: ("modelled", "uncorrelated"),
    2: ("modelled", "equal"),
    3: ("modelled", "delayed"),
    4: ("uncorrelated", "delayed"),
    5: ("equal", "delayed"),
}
"""The five cases of correlation in Rill's paper: left and right, front and rear."""


@dataclass(frozen=True)
class TwoTrackRoad:
    """Random road of two processes: mean height (m, intensity q1 in m) and roll (rad, intensity q2 in 1/m)."""

    mean: ShapeFilter
    roll: ShapeFilter

    def spectrum(self, wavenumber: np.ndarray, lateral_position: float) -> np.ndarray:
        """Two-sided spectral density (m^3) of the height at lateral position y (m) over the wavenumber (rad/m)."""
        return self.cross_spectrum(wavenumber, lateral_position, lateral_position)

    def cross_spectrum(
        self, wavenumber: np.ndarray, first_lateral_position: float, second_lateral_position: float
    ) -> np.ndarray:
        """Two-sided cross density (m^3) of the heights at lateral positions y1 and y2 (m); it is real, because both
        points lie at the same station."""
        return self.mean.spectrum(wavenumber) + first_lateral_position * second_lateral_position * self.roll.spectrum(
            wavenumber
        )

    def coherency(
        self, wavenumber: np.ndarray, first_lateral_position: float, second_lateral_position: float
    ) -> np.ndarray:
        """Coherency |S12| / sqrt(S1 S2), 0 to 1, of the heights at lateral positions y1 and y2 (m)."""
        cross = self.cross_spectrum(wavenumber, first_lateral_position, second_lateral_position)
        return np.abs(cross) / np.sqrt(
            self.spectrum(wavenumber, first_lateral_position) * self.spectrum(wavenumber, second_lateral_position)
        )

    def covariance(
        self, distance: np.ndarray, first_lateral_position: float, second_lateral_position: float
    ) -> np.ndarray:
        """Covariance (m^2) of the height at y1 with that at y2, ``distance`` (m) farther along the path."""
        roll = (
            first_lateral_position * second_lateral_position * self.roll.covariance(distance)
            if first_lateral_position * second_lateral_position
            else 0.0
        )
        return self.mean.covariance(distance) + roll

    def level(self, lateral_position: float) -> float:
        """Level S0 (m) of the road's spectrum at lateral position lateral_position (m): without cutoffs the two-sided
        spectrum there tends to S0 / Omega^2.
        """
        return (self.mean.intensity + lateral_position * lateral_position * self.roll.intensity) / (2.0 * math.pi)

    def label(self, lateral_position: float) -> str:
        """Text with the name of the road at lateral position y (m) and the convention of its level."""
        cutoffs = {f.cutoff for f in (self.mean, self.roll) if f.cutoff is not None}
        steep = f", cut off at {' and '.join(f'{c:g}' for c in sorted(cutoffs))} rad/m" if cutoffs else ""
        level = self.level(lateral_position)
        return (
            f"two tracks, corners {self.mean.corner:g} and {self.roll.corner:g} rad/m{steep}; at y = "
            f"{lateral_position:g} m the spectrum tends to {level:.4g} m / Omega^2 two-sided, "
            f"{2.0 * level:.4g} m^3 one-sided at 1 rad/m ({class_at_level(level)})"
        )


def road_of_level(
    half_track_width: float,
    density_level: float = TRACK_DENSITY_LEVEL,
    *,
    corner_wavenumbers: tuple[float, float] = (MEAN_CORNER, ROLL_CORNER),
    cutoff_wavenumber: float | None = None,
) -> TwoTrackRoad:
    """Road whose tracks at y = +- half_track (m) have the level S0 (m, two-sided); the default is the paper's road.

    Mean and roll share the level in halves, q1 = half_track^2 q2 = pi S0: only then does the coherency fall to 0 at
    short waves, as the paper's Fig. 3 shows. The paper leaves the split open. Raises InputError for no track.
    """
    if not (math.isfinite(half_track_width) and half_track_width > 0.0):
        raise InputError(
            "", "half_track", half_track_width, "must be above 0, in m: half the distance of the two tracks"
        )
    half = math.pi * density_level
    return TwoTrackRoad(
        ShapeFilter(corner_wavenumbers[0], half, cutoff_wavenumber),
        ShapeFilter(corner_wavenumbers[1], half / half_track_width**2, cutoff_wavenumber),
    )


def half_track(wheel_positions: Sequence[WheelPosition]) -> float:
    """Half the lateral distance (m) between the outermost wheels of the first axle; 0 for wheels on the centre line."""
    front = [wheel.y for wheel in wheel_positions if wheel.axle == 0]
    return (max(front) - min(front)) / 2.0


def wheels_on_track(wheel_positions: Sequence[WheelPosition], lateral_position: float) -> tuple[WheelPosition, ...]:
    """The wheels moved laterally to the track at y (m); so a quarter or half car, drawn on the centre line, drives on
    one track of a road."""
    return tuple(replace(wheel, y=lateral_position) for wheel in wheel_positions)


def road_excitation(
    two_track_road: TwoTrackRoad,
    wheel_positions: Sequence[WheelPosition],
    left_right_correlation: str = "modelled",
    front_rear_correlation: str = "delayed",
) -> RoadExcitation:
    """Excitation of the wheels by a two-track two_track_road: one filter per axle, with each wheel at its own lateral
    position.

    Parameters
    ----------
    left_right_correlation : "modelled", z = z_M + y theta; "uncorrelated", the left wheels and the right wheels each
        with a pair (z_M, theta) of their own; "equal", z = z_M + abs(y) theta
    front_rear_correlation : "delayed", every axle meets the noise of the first, its distance later; "uncorrelated",
        every axle has noise of its own; "equal", every axle meets the noise of the first at once

    Raises
    ------
    InputError : an unknown word; axles not numbered from the front, wheels of one axle at different x; wheels both on
        and beside the centre line where left and right are uncorrelated
    """
    _check_word("left_right", left_right_correlation, TRACK_CORRELATIONS)
    _check_word("front_rear", front_rear_correlation, FRONT_REAR)
    behind = _axle_distances(wheel_positions)
    F, G, mean, roll = _both_filters(two_track_road)
    if left_right_correlation == "uncorrelated":
        F, G = block_diag(F, F), block_diag(G, G)
    rows = np.array(
        [_height_row(wheel, mean, roll, left_right_correlation, wheel_positions) for wheel in wheel_positions]
    )
    axle = np.array([wheel.axle for wheel in wheel_positions])
    heights = tuple(np.where((axle == i)[:, None], rows, 0.0) for i in range(len(behind)))
    lengths = tuple(0.0 for _ in behind) if front_rear_correlation == "equal" else behind
    return RoadExcitation(F, G, heights, lengths, front_rear_correlation == "uncorrelated")


def input_covariance(
    two_track_road: TwoTrackRoad,
    wheel_positions: Sequence[WheelPosition],
    left_right_correlation: str = "modelled",
    front_rear_correlation: str = "delayed",
) -> np.ndarray:
    """Covariance (w, w) in m^2 of the heights under the wheels, in closed form; arguments and errors as above."""
    behind = road_excitation(two_track_road, wheel_positions, left_right_correlation, front_rear_correlation).lengths
    covariances = np.zeros((len(wheel_positions), len(wheel_positions)))
    for i, first in enumerate(wheel_positions):
        for j, second_wheel in enumerate(wheel_positions):
            if left_right_correlation == "uncorrelated" and (first.y < 0.0) != (second_wheel.y < 0.0):
                continue
            if front_rear_correlation == "uncorrelated" and first.axle != second_wheel.axle:
                continue
            y1, y2 = (
                (abs(first.y), abs(second_wheel.y)) if left_right_correlation == "equal" else (first.y, second_wheel.y)
            )
            covariances[i, j] = float(
                two_track_road.covariance(np.array(behind[first.axle] - behind[second_wheel.axle]), y1, y2)
            )
    return covariances


def _both_filters(two_track_road: TwoTrackRoad) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Filter matrices F, G of both processes together, and the rows that read z_M and theta; a roll process of
    zero intensity is left out."""
    parts = [two_track_road.mean, two_track_road.roll] if two_track_road.roll.intensity else [two_track_road.mean]
    F, G, H = (block_diag(*matrices) for matrices in zip(*(process.matrices() for process in parts), strict=True))
    return F, G, H[0], H[1] if len(H) == 2 else np.zeros(len(F))


def _height_row(
    wheel_position: WheelPosition,
    mean_row: np.ndarray,
    roll_row: np.ndarray,
    left_right_correlation: str,
    wheel_positions: Sequence[WheelPosition],
) -> np.ndarray:
    """Factors of the filter states in the road height under a wheel."""
    if left_right_correlation == "equal":
        return mean_row + abs(wheel_position.y) * roll_row
    height = mean_row + wheel_position.y * roll_row
    if left_right_correlation == "modelled":
        return height
    if wheel_position.y == 0.0 and any(other_wheel.y for other_wheel in wheel_positions):
        allowed = f"wheel {wheel_position.name!r} stands at y = 0, neither left nor right"
        raise InputError("", "left_right", left_right_correlation, allowed)
    zeros_of_other = np.zeros(len(height))
    return np.concatenate([height, zeros_of_other] if wheel_position.y >= 0.0 else [zeros_of_other, height])


def _axle_distances(wheels: Sequence[WheelPosition]) -> tuple[float, ...]:
    """Distance (m) of each axle behind the first."""
    axles = sorted({wheel.axle for wheel in wheels})
    if not axles or axles != list(range(len(axles))):
        raise InputError("", "axles", axles, "must be numbered 0, 1, ... from the front, each with a wheel")
    wheel_positions = [{wheel.x for wheel in wheels if wheel.axle == axle} for axle in axles]
    for axle, places_of_axle in enumerate(wheel_positions):
        if len(places_of_axle) > 1:
            raise InputError("", f"axle {axle}, x", sorted(places_of_axle), "the wheels of an axle must stand at one x")
    behind = tuple(min(wheel_positions[0]) - min(places_of_axle) for places_of_axle in wheel_positions)
    for axle in range(1, len(behind)):
        if behind[axle] < behind[axle - 1]:
            raise InputError("", f"axle {axle}, x", min(wheel_positions[axle]), f"must not lie before axle {axle - 1}")
    return behind


def _check_word(option_name: str, chosen_word: str, allowed_words: tuple[str, ...]) -> None:
    if chosen_word not in allowed_words:
        raise InputError("", option_name, chosen_word, "must say how the wheels' roads go together", allowed_words)
