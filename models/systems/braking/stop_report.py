"""Results of a stop: distances, yaw, decelerations, side slip; slips, locks and pressures of each wheel.

Source: the tables beside Figs 2 and 3 of G. Palmkvist and O. Nordstrom, A hybrid laboratory test method for anti-lock
systems. Both decelerations are given that may be called mean: v0^2 / 2d and v0 / T differ by a few per cent.
"""

from dataclasses import dataclass

import numpy as np

from models.brake.figures_of_merit import (
    WheelLockTimes,
    equivalent_deceleration,
    mean_fully_developed_deceleration,
    wheel_lock_times,
    yaw_rate_ratio,
)
from models.systems.braking.march import BrakingPath

WHEEL_NAMES = "front left", "front right", "rear left", "rear right"
TOWED_WHEELS = {
    0: (),
    2: ("trailer left", "trailer right"),
    4: ("trailer front left", "trailer front right", "trailer rear left", "trailer rear right"),
}
"""Names of the wheels of towed vehicles, by the number of these wheels."""
HITCH_SUFFIX = " hitch rz"
"""Ending of the names of coordinates that are the yaw of a towed body relative to its towing vehicle."""
SLOWEST_SLIP_SPEED = 1.0
"""Speed (m/s) below which slips and slip angles are left out, as they mean nothing for a vehicle that hardly moves."""
SLIP_LIMITS = (0.2, 0.5)
"""Slips for which the report gives the share of time above them: chosen, as the paper's are not legible."""


def wheel_names(wheel_count: int) -> tuple[str, ...]:
    """Names of a vehicle's ``wheel_count`` wheels, including wheels of towed vehicles."""
    return (*WHEEL_NAMES, *TOWED_WHEELS[wheel_count - len(WHEEL_NAMES)])


@dataclass(frozen=True)
class StopHistory:
    """Time histories of a braking run for the centre of mass of the towing vehicle, along and across its path.

    times, speed, way, side_slip (n,): s, m/s, m, rad; lateral_acceleration (n - 1,): m/s^2 to the left; lengths (n -
    1,): of the samples (s).
    """

    path: BrakingPath

    @property
    def times(self) -> np.ndarray:
        """Times (n,) of the samples in s."""
        return self.path.times

    @property
    def lengths(self) -> np.ndarray:
        """Durations (n - 1,) of the samples in s."""
        return np.diff(self.path.times)

    @property
    def speed(self) -> np.ndarray:
        """Speed (n,) of the towing vehicle's centre of mass in m/s."""
        return np.hypot(self.path.states[:, 1, 0], self.path.states[:, 1, 1])

    @property
    def distance_travelled(self) -> np.ndarray:
        """Distance (n,) in m along the path since the start."""
        steps = np.diff(self.path.states[:, 0, :2], axis=0)
        return np.concatenate(([0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))))

    @property
    def side_slip(self) -> np.ndarray:
        """Side slip angle (n,) in rad, from the vehicle's x axis to its velocity; 0 where the vehicle is slower than
        SLOWEST_SLIP_SPEED.
        """
        course = np.arctan2(self.path.states[:, 1, 1], self.path.states[:, 1, 0])
        angle = np.remainder(course - self.path.states[:, 0, 2] + np.pi, 2.0 * np.pi) - np.pi
        return np.where(self.speed > SLOWEST_SLIP_SPEED, angle, 0.0)

    @property
    def lateral_acceleration(self) -> np.ndarray:
        """Mean acceleration (n - 1,) across the path in every sample, in m/s^2, positive to the left."""
        rates_before, rates_after = self.path.states[:-1, 1, :2], self.path.states[1:, 1, :2]
        size = np.maximum(self.speed[:-1], 1e-9)
        change = (rates_after - rates_before) / np.maximum(self.lengths, 1e-12)[:, None]
        return (rates_before[:, 0] * change[:, 1] - rates_before[:, 1] * change[:, 0]) / size

    def vehicle_results(self) -> dict[str, float]:
        """Results of the vehicle over a stop, by name and unit: distance, time, decelerations, yaw, side slip."""
        path, speed, distances = self.path, self.speed, self.distance_travelled
        slip, lateral = _index_of_peak(self.side_slip), _index_of_peak(self.lateral_acceleration)
        time, distance = float(path.times[-1]), float(distances[-1])
        return {
            "initial speed [m/s]": float(speed[0]),
            "stopping distance [m]": distance,
            "stopping time [s]": time,
            "x [m]": float(path.states[-1, 0, 0] - path.states[0, 0, 0]),
            "y [m]": float(path.states[-1, 0, 1] - path.states[0, 0, 1]),
            "final yaw [deg]": float(np.degrees(path.states[-1, 0, 2] - path.states[0, 0, 2])),
            "v0^2/2d [m/s^2]": equivalent_deceleration(float(speed[0]), distance)
            if path.ended_at_rest
            else float("nan"),
            "v0/T [m/s^2]": float(speed[0] - speed[-1]) / time,
            "MFDD [m/s^2]": mean_fully_developed_deceleration(path.times, distances, speed),
            "largest side slip [deg]": float(np.degrees(self.side_slip[slip])),
            "largest side slip at [s]": float(path.times[slip]),
            "largest lateral acceleration [m/s^2]": float(self.lateral_acceleration[lateral]),
            "largest lateral acceleration at [s]": float(path.times[lateral]),
        } | self.body_results()

    @property
    def lean(self) -> np.ndarray | None:
        """Roll to the right and pitch nose down (n, 2) in rad of a vehicle on its suspension; None for a plane
        vehicle.
        """
        columns = [i for i, name in enumerate(self.path.coordinates) if name in ("sway rx", "sway ry")]
        return self.path.states[:, 0, columns] if columns else None

    def body_results(self) -> dict[str, float]:
        """Largest roll, largest pitch and least wheel load over a stop, by name and unit; empty for a plane vehicle."""
        if self.lean is None:
            return {}
        roll, pitch = np.degrees(self.lean).T
        return {
            "largest roll [deg]": float(roll[_index_of_peak(roll)]),
            "largest pitch [deg]": float(pitch[_index_of_peak(pitch)]),
            "least wheel load [N]": float(self.path.reports.load.min()),
        }

    @property
    def units(self) -> np.ndarray:
        """Position (m) of the towing vehicle's centre of mass, then headings (rad) of all units, shape (n, 2 + U); also
        for a vehicle on its suspension.
        """
        coordinates = self.path.states[:, 0]
        if self.lean is None:
            return coordinates
        yaws = [2, *(i for i, name in enumerate(self.path.coordinates) if name.endswith(HITCH_SUFFIX))]
        return np.column_stack((coordinates[:, :2], np.cumsum(coordinates[:, yaws], axis=1)))

    @property
    def hitch(self) -> np.ndarray | None:
        """Angle (n,) in rad from the towing vehicle to the first towed unit, positive to the left; None without a
        train.
        """
        units = self.units
        return units[:, 3] - units[:, 2] if units.shape[1] > 3 else None

    def hitch_results(self) -> dict[str, float]:
        """Largest and final hitch angle over a stop, by name and unit; empty for a vehicle that tows nothing."""
        hitch = self.hitch
        if hitch is None:
            return {}
        largest = _index_of_peak(hitch)
        return {
            "largest hitch angle [deg]": float(np.degrees(hitch[largest])),
            "largest hitch angle at [s]": float(self.times[largest]),
            "final hitch angle [deg]": float(np.degrees(hitch[-1])),
        }

    def wheel_results(self) -> dict[str, np.ndarray]:
        """Slips, locks and pressures of each wheel (W,) over a stop, by name and unit. Slips and mean pressures count
        at speeds above SLOWEST_SLIP_SPEED, or above half of a lower initial speed."""
        path, fast = self.path, self.speed[:-1] > min(SLOWEST_SLIP_SPEED, 0.5 * self.speed[0])
        lengths, slips = self.lengths[fast], path.reports.slip[fast]
        pressures, fast_duration = path.pressures[1:][fast], float(self.lengths[fast].sum())
        wheels = {"mean slip": lengths @ slips / fast_duration, "largest slip": slips.max(axis=0)}
        wheels |= {
            f"slip above {limit:g} [% of time]": 100.0 * (lengths @ (slips > limit)) / fast_duration
            for limit in SLIP_LIMITS
        }
        locks = self.lock_times()
        return wheels | {
            "locked above 15 km/h [s]": locks.time,
            "longest lock [s]": locks.longest_lock,
            "mean pressure [bar]": lengths @ pressures / fast_duration,
            "final pressure [bar]": path.pressures[-1],
        }

    def results_in_turn(self, turn_radius: float, time_after_braking: float = 1.0) -> dict[str, float]:
        """Results at ``time_after_braking`` (s) after the brake is applied on a circle (radius in m, positive to the
        left), by name and unit.

        Source: ISO 14794 (heavy vehicles), ISO 7975 (cars); not checked against the text of the standard.
        """
        speed, yaw_rate, slip = (
            float(np.interp(time_after_braking, self.times, values))
            for values in (self.speed, self.path.states[:, 1, 2], self.side_slip)
        )
        position = [np.interp(time_after_braking, self.times, self.path.states[:, 0, i]) for i in range(2)]
        vx, vy = self.path.states[0, 1, :2] / self.speed[0]
        centre = self.path.states[0, 0, :2] + turn_radius * np.array([-vy, vx])
        return {
            "yaw rate by that of the circle": yaw_rate_ratio(yaw_rate, speed, turn_radius),
            "mean deceleration [m/s^2]": float(self.speed[0] - speed) / time_after_braking,
            "outside of the circle [m]": float(np.hypot(*(position - centre)) - abs(turn_radius)),
            "side slip [deg]": float(np.degrees(slip)),
        }

    def lock_times(self) -> WheelLockTimes:
        """Times for which wheels lock at speeds above 15 km/h."""
        return wheel_lock_times(self.lengths, self.path.reports.locked > 0.0, self.speed[:-1])


def _index_of_peak(signed_values: np.ndarray) -> int:
    """Index of the value with the largest magnitude."""
    return int(np.argmax(np.abs(signed_values)))
