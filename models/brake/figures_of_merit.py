"""Figures of merit of a braking test: decelerations, distances, adhesion utilisation, split friction, turns.

Formulas of UN Regulation 13, of ISO 21994, 16552 and 14794 as they are commonly quoted: not checked against the text of
the regulation or standard. Speeds in m/s, times in s, distances in m, forces in N; z is a deceleration divided by g.
"""

from dataclasses import dataclass

import numpy as np

from models.brake.plane_vehicle import GRAVITY
from models.core.errors import InputError

METRES_PER_SECOND_OF_KMH = 1.0 / 3.6
"""Speed (m/s) of one kilometre per hour."""
NOT_CHECKED_REMARK = "not checked against the text of the regulation"
"""Remark on formulas that were not compared with the regulation."""
ROLLING_DRIVEN, ROLLING_FREE = 0.015, 0.010
"""Rolling resistance coefficients that Annex 13 takes for an unbraked axle: driven, and not driven."""
LEAST_ADHESION_UTILISATION = 0.75
"""Least adhesion utilisation of a category 1 anti-lock system."""


@dataclass(frozen=True)
class AxleLoads:
    """Data of a two-axle vehicle: static loads (N) of front and rear axle, wheelbase (m), height of the centre of mass
    (m).
    """

    front: float
    rear: float
    wheelbase: float
    height: float

    @property
    def weight(self) -> float:
        """Weight of the vehicle (N)."""
        return self.front + self.rear

    def dynamic_loads(self, z: float) -> tuple[float, float]:
        """Loads (N) of the front and the rear axle when the vehicle decelerates at z times g."""
        transferred_load = self.height / self.wheelbase * z * self.weight
        return self.front + transferred_load, self.rear - transferred_load


def crossing_time(times: np.ndarray, speeds: np.ndarray, speed_limit: float) -> float:
    """Time (s) at which the vehicle's speed first falls below ``speed_limit`` (m/s), interpolated linearly between
    samples; NaN if it never does, or is below at the first sample already.
    """
    rows_below = np.flatnonzero(speeds < speed_limit)
    if rows_below.size == 0 or rows_below[0] == 0:
        return float("nan")
    i = rows_below[0]
    share = (speeds[i - 1] - speed_limit) / (speeds[i - 1] - speeds[i])
    return float(times[i - 1] + share * (times[i] - times[i - 1]))


def distance_at_time(times: np.ndarray, distances: np.ndarray, speeds: np.ndarray, time: float) -> float:
    """Distance (m) covered at a time (s) between two samples, with constant deceleration between them."""
    i = int(np.clip(np.searchsorted(times, time, side="right") - 1, 0, len(times) - 2))
    passed, long = time - times[i], times[i + 1] - times[i]
    rate = (speeds[i + 1] - speeds[i]) / long
    full_distance = long * (speeds[i] + 0.5 * rate * long)
    partial_distance = passed * (speeds[i] + 0.5 * rate * passed)
    return float(
        distances[i]
        + (distances[i + 1] - distances[i]) * (partial_distance / full_distance if full_distance > 0.0 else 0.0)
    )


def mean_fully_developed_deceleration(times: np.ndarray, distances: np.ndarray, speeds: np.ndarray) -> float:
    """Mean fully developed deceleration (m/s^2): (vb^2 - ve^2) / (2 (s_e - s_b)) between vb = 0.8 v0 and ve = 0.1 v0.

    Source: UN R13, Annex 4, d_m = (vb^2 - ve^2) / (25.92 (s_e - s_b)) in km/h and m; not checked against the text of
    the regulation. Not a number if the vehicle does not get so slow.
    """
    high, low = 0.8 * speeds[0], 0.1 * speeds[0]
    begin, end = (crossing_time(times, speeds, speed) for speed in (high, low))
    if not np.isfinite(begin + end):
        return float("nan")
    covered = distance_at_time(times, distances, speeds, end) - distance_at_time(times, distances, speeds, begin)
    return float((high**2 - low**2) / (2.0 * covered))


def equivalent_deceleration(initial_speed: float, stopping_distance: float) -> float:
    """Uniform deceleration v0^2 / (2 d) in m/s^2 that stops in the same distance d (m) from the speed v0 (m/s)."""
    return initial_speed**2 / (2.0 * stopping_distance)


def braking_rate(higher_speed: float, lower_speed: float, duration: float) -> float:
    """Braking rate z, deceleration divided by g, of a vehicle that takes ``duration`` (s) to slow down from one speed
    to a lower one (m/s).

    From 40 to 20 km/h it is 0.566 / t, from 45 to 15 km/h 0.849 / t (UN R13, Annex 13; not checked against the text).
    """
    return (higher_speed - lower_speed) / (GRAVITY * duration)


def mean_of_shortest_times(braking_times: np.ndarray) -> float:
    """Mean (s) of the shortest times: at most three, and only those within 1.05 times the shortest one.

    Source: UN R13, Annex 13, appendix 2; not checked against the text of the regulation.
    """
    ordered = np.sort(np.asarray(braking_times, float)[np.isfinite(braking_times)])
    if ordered.size == 0:
        raise InputError("", "times", [], "needs at least one run that slows down far enough")
    return float(ordered[ordered <= 1.05 * ordered[0]][:3].mean())


def adhesion_front(z: float, axle_loads: AxleLoads) -> float:
    """Adhesion coefficient k of the front axle, rounded to 0.001, from the braking rate z with only that axle braked
    and the rear axle driven.

    (z P g - 0.015 F2) / (F1 + (h / E) z P g). Source: UN R13, Annex 13; not checked against the text of the regulation.
    """
    return round((z * axle_loads.weight - ROLLING_DRIVEN * axle_loads.rear) / axle_loads.dynamic_loads(z)[0], 3)


def adhesion_rear(z: float, axle_loads: AxleLoads) -> float:
    """Adhesion coefficient k of the rear axle, rounded to 0.001, from the braking rate z with only that axle braked and
    the front axle not driven.

    (z P g - 0.010 F1) / (F2 - (h / E) z P g). Source: UN R13, Annex 13; not checked against the text of the regulation.
    """
    return round((z * axle_loads.weight - ROLLING_FREE * axle_loads.front) / axle_loads.dynamic_loads(z)[1], 3)


def adhesion_trailer(z: float, train_weight: float, axle_load: float) -> float:
    """Adhesion coefficient k = z P g / F_dyn of one trailer axle, from the braking rate z of the train (weight in N)
    when only that axle brakes.

    axle_load: F_dyn, N. The formula is ours. Rolling resistance is not subtracted, because wheels have none here; that
    of a whole train would be a third of the force of one axle on ice.
    """
    return round(z * train_weight / axle_load, 3)


def adhesion_of_vehicle(z: float, k_front: float, k_rear: float, axle_loads: AxleLoads) -> float:
    """Adhesion coefficient of the vehicle, k_M = (k_f F_fdyn + k_r F_rdyn) / (P g), with the axle loads at the braking
    rate z of the anti-lock system.

    Source: UN R13, Annex 13; not checked against the text of the regulation.
    """
    front, rear = axle_loads.dynamic_loads(z)
    return (k_front * front + k_rear * rear) / axle_loads.weight


def least_braking_rate_on_split(k_low_side: float, k_high_side: float) -> float:
    """Least braking rate z_MALS on split friction: the larger of 0.75 (4 k_L + k_H) / 5 and k_L.

    Source: UN R13, Annex 13, laden vehicles of category 1; not checked against the text of the regulation.
    """
    return max(LEAST_ADHESION_UTILISATION * (4.0 * k_low_side + k_high_side) / 5.0, k_low_side)


def yaw_rate_ratio(yaw_rate: float, speed: float, radius: float) -> float:
    """Ratio r R / v of the yaw rate to that of the circle at the present speed: 1 for a vehicle that stays on its
    circle.

    Source: ISO 7975 and ISO 14794, one second after the brake is applied; not checked against the text of the standard.
    """
    return yaw_rate * radius / speed


@dataclass(frozen=True)
class WheelLockTimes:
    """How long each wheel (W,) was locked while the vehicle was above a speed: total time (s), its ratio to the time
    above the speed, and longest single lock (s).
    """

    time: np.ndarray
    share: np.ndarray
    longest_lock: np.ndarray


def wheel_lock_times(
    sample_durations: np.ndarray,
    is_locked: np.ndarray,
    vehicle_speeds: np.ndarray,
    least_speed: float = 15.0 * METRES_PER_SECOND_OF_KMH,
) -> WheelLockTimes:
    """Locked times of the wheels while the vehicle is above a speed (m/s). sample_durations (n,): durations of the
    samples (s);
    is_locked (n, W): whether a wheel is locked; vehicle_speeds (n,): of the vehicle (m/s).

    UN R13, Annex 13 lets wheels lock below 15 km/h, and briefly above; not checked against the text of the regulation.
    """
    counted = is_locked & (vehicle_speeds > least_speed)[:, None]
    longest, locked_time = np.zeros(is_locked.shape[1]), np.zeros(is_locked.shape[1])
    for length, row in zip(sample_durations, counted, strict=True):
        locked_time = np.where(row, locked_time + length, 0.0)
        longest = np.maximum(longest, locked_time)
    time = sample_durations @ counted
    time_above = float(sample_durations[vehicle_speeds > least_speed].sum())
    return WheelLockTimes(time, time / time_above if time_above else time, longest)
