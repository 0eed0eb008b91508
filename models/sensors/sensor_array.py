"""Arrangement of tri-axial accelerometers on a body: what it can and cannot measure, and simulated readings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from models.core.errors import InputError
from models.sensors.rotations import quaternion_from_cardan, rotation_matrix, skew_matrix

ArrayFormula = Literal["auto", "spatial", "plane"]
LINE_SPREAD_RATIO = 1e-3
"""Ratio of the second spread of the sensors to the first below which they lie on a line: on a car some millimetres, no
better known."""
FLAT_SPREAD_RATIO = 0.1
"""Ratio of the third spread of the sensors to the second below which "auto" takes the formula for sensors in a
plane."""
HALF_WITH_ROUNDING_BIAS = "gives half the angular acceleration plus a bias"
PLANE_SPREAD_RATIO = 1e-6
"""Ratio of the third spread of the sensors to the second below which they lie in a plane to rounding, so that there is
no choice."""


@dataclass(frozen=True)
class SensorArray:
    """Tri-axial accelerometers that are fixed at known positions on a body.

    Attributes
    ----------
    names : of the sensors; positions : (sensors, 3) in m, local components from the body's reference point
    principal_axes : (3, 3), its columns are the principal directions e1, e2, n, right-handed; n is the normal of the
    plane
        in which the sensors lie, or nearly lie
    spreads : (3,) in m, root of the sum of squared distances from the mean position along e1, e2, n
    is_planar : True where the formula for sensors in a plane is used: it does not need what n would tell
    position_weights : (sensors, 3) in 1/m, the pseudo-inverse of the relative positions (R^+ of eq. 18), along e1, e2,
    n;
        (sensors, 2) where the sensors lie in a plane, which tells nothing along n
    """

    names: tuple[str, ...]
    positions: np.ndarray
    principal_axes: np.ndarray
    spreads: np.ndarray
    is_planar: bool
    position_weights: np.ndarray

    @property
    def redundancy(self) -> int:
        """Number of equations per sample that a rigid body must satisfy beyond those needed for its motion; they check
        the fit."""
        return 3 * (len(self.names) - 1) - 6

    @property
    def lies_in_plane(self) -> bool:
        """Whether the sensors lie in a plane, except for rounding."""
        return self.position_weights.shape[1] == 2

    def noise_gains(self, with_plane_formula: bool | None = None) -> np.ndarray:
        """Ratios (3,), in 1/m, of the standard deviation of the angular acceleration about x, y, z to that of the
        readings.

        The readings' noise is independent and the same on all axes of all sensors. For sensors in a plane the spatial
        formula gives infinite gains.
        """
        squares = self.array_noise_gains(self.is_planar if with_plane_formula is None else with_plane_formula) ** 2
        shares = np.where(
            np.abs(self.principal_axes) > PLANE_SPREAD_RATIO, self.principal_axes**2, 0.0
        )  # infinity times a rounding error
        return np.sqrt(np.multiply(shares, squares, out=np.zeros((3, 3)), where=shares > 0).sum(axis=1))

    def array_noise_gains(self, with_plane_formula: bool) -> np.ndarray:
        """Noise gains (3,) as ``noise_gains`` gives, but about the array's axes e1, e2, n."""
        first, second_axis, three = self.inverse_squares
        return np.sqrt(
            [second_axis, first, (first + second_axis) / 4]
            if with_plane_formula
            else np.array([second_axis + three, first + three, first + second_axis]) / 4
        )

    @property
    def inverse_squares(self) -> np.ndarray:
        """Inverse squares 1 / spreads^2 (3,) in 1/m^2: variances of the columns of M for readings with unit
        variance."""
        return np.append(1 / self.spreads[:2] ** 2, np.inf if self.lies_in_plane else 1 / self.spreads[2] ** 2)

    def description_sentences(self) -> list[str]:
        """Sentences on the strengths and weaknesses of the sensor arrangement."""
        normal = ", ".join(f"{value:.3g}" for value in np.round(self.principal_axes[:, 2], 12) + 0.0)
        flatness = self.spreads[2] / self.spreads[1]
        spreads = ", ".join(f"{value:.3g}" for value in self.spreads)
        lines = [f"{len(self.names)} sensors, spread {spreads} m along their principal directions"]
        if self.is_planar:
            lies = "lie in a plane" if self.lies_in_plane else f"lie nearly in a plane (flatness {flatness:.2g})"
            lines += [
                f"the sensors {lies} with the normal ({normal}): about axes in that plane the plain formula "
                f"{HALF_WITH_ROUNDING_BIAS if self.lies_in_plane else self._amplified_noise()}; "
                "the formula for a plane is used, integrated together with the rates"
            ]
        gains = ", ".join(f"{value:.2f}" for value in self.noise_gains())
        lines += [f"noise of 1 m/s^2 in the readings gives ({gains}) rad/s^2 in roll, pitch and yaw acceleration"]
        if self.redundancy == 0:
            lines += ["three sensors leave nothing over to check that the body is rigid: a loose one is not found"]
        return lines

    def _amplified_noise(self) -> str:
        return f"amplifies noise {max(self.noise_gains(False) / self.noise_gains(True)):.1f} times as much"


def sensor_array(sensor_positions: Mapping[str, Sequence[float]], formula: ArrayFormula = "auto") -> SensorArray:
    """``SensorArray`` of named sensors at local positions (3,) in m.

    ``formula`` "spatial" is eq. (18) as it stands, "plane" the one that leaves the normal out, which is exact for
    any arrangement and the less noisy one where the sensors lie nearly in a plane. Raises InputError for fewer than
    three sensors, for sensors on a line, and for "spatial" where they lie in a plane.
    """
    names, position_rows = (
        tuple(sensor_positions),
        np.array([list(position) for position in sensor_positions.values()], dtype=float),
    )
    if len(names) < 3:
        raise InputError("", "sensors", len(names), "at least three sensors that are not on a line are needed")
    if position_rows.shape != (len(names), 3) or not np.isfinite(position_rows).all():
        raise InputError("", "sensors", None, "each position must be three finite numbers x, y, z in m")
    frame, spreads, rows = np.linalg.svd((position_rows - position_rows.mean(axis=0)).T, full_matrices=False)
    if not spreads[1] > LINE_SPREAD_RATIO * spreads[0]:
        raise InputError(
            "",
            "sensors",
            None,
            "the sensors lie on a line, about which the body could turn unseen: put one of them elsewhere",
        )
    flat, near = (spreads[2] < limit * spreads[1] for limit in (PLANE_SPREAD_RATIO, FLAT_SPREAD_RATIO))
    if formula == "spatial" and flat:
        raise InputError(
            "",
            "formula",
            formula,
            "the sensors lie in a plane, where this formula gives half of the "
            "angular acceleration plus a bias without a word: use 'auto' or 'plane'",
        )
    normal_sign = np.copysign(1.0, frame[np.abs(frame[:, 2]).argmax(), 2])  # the normal along its axis, not against it
    hand = np.array([1.0, normal_sign * np.linalg.det(frame), normal_sign])  # e1, e2, n right-handed
    weights = (rows.T * hand / np.where(spreads > 0, spreads, 1.0))[:, : 2 if flat else 3]
    planar = flat or formula == "plane" or (formula == "auto" and near)
    return SensorArray(names, position_rows, frame * hand, spreads, bool(planar), weights)


def sensor_readings(
    sensor_positions: np.ndarray,
    pitch: np.ndarray,
    pitch_rate: np.ndarray,
    heave_acceleration: np.ndarray,
    pitch_acceleration: np.ndarray,
    gravity: float,
) -> np.ndarray:
    """Specific forces (n, sensors, 3) in m/s^2 at sensors on a vehicle that heaves and pitches, in the chassis' axes (x
    forward, y right, z down), eqs (16), (17).

    sensor_positions : (sensors, 3) in m from the centre of mass, local; pitch (rad, nose up), its rate and
    acceleration, and the heave acceleration (m/s^2, down), each (n,). The vehicle moves in its plane: no roll, no yaw,
    no surge.
    """
    count = len(pitch)
    no_angles = np.zeros(count)
    turn = rotation_matrix(quaternion_from_cardan(no_angles, pitch, no_angles))
    alpha, w = (np.column_stack([no_angles, values, no_angles]) for values in (pitch_acceleration, pitch_rate))
    felt = (heave_acceleration - gravity)[:, None] * turn[:, 2]  # S^T along the global vertical
    return specific_forces_on_body(sensor_positions, felt, w, alpha)


def specific_forces_on_body(
    sensor_positions: np.ndarray, specific_forces: np.ndarray, w: np.ndarray, alpha: np.ndarray
) -> np.ndarray:
    """Specific forces (n, sensors, 3) in m/s^2 at sensors on a body in any motion, in the body's axes, eqs (16), (17).

    sensor_positions : (sensors, 3) in m from a point of the body with ``specific_forces`` (n, 3); w, alpha : (n, 3),
    the body's rates and their derivatives about its own axes, rad/s and rad/s^2. Any right-handed axes.
    """
    lever = skew_matrix(alpha) + skew_matrix(w) @ skew_matrix(w)
    return specific_forces[:, None] + np.einsum("nij,sj->nsi", lever, np.asarray(sensor_positions))


def reading_on_bracket(
    mount_reading: np.ndarray, sample_period: float, natural_frequency: float, damping_ratio: float
) -> np.ndarray:
    """Reading (n, 3) of a sensor on a light flexible bracket from that of a rigid mount (n, 3), sampled every
    ``sample_period`` (s).

    Along each of the body's axes a one-way coupled oscillator of natural frequency (Hz) and damping ratio: its
    mass is too small to move the body, and what the sensor feels is what spring and damper pass on,
    (2 zeta w0 s + w0^2) / (s^2 + 2 zeta w0 s + w0^2) of the mount's. Exact for readings that are linear between
    their samples, whatever the period; at the first sample it is at rest under that reading.
    """
    from scipy.signal import cont2discrete, lfilter, lfilter_zi, ss2tf

    w0 = 2 * np.pi * natural_frequency
    change = np.array([[0.0, 1.0], [-(w0**2), -2 * damping_ratio * w0]])
    *system, _ = cont2discrete((change, np.eye(2)[:, 1:], -change[1:], np.zeros((1, 1))), sample_period, method="foh")
    upper, lower = ss2tf(*system)
    start = lfilter_zi(upper[0], lower)
    return lfilter(upper[0], lower, mount_reading, axis=0, zi=start[:, None] * mount_reading[0])[0]
