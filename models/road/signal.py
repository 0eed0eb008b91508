"""Road heights under the two wheels of a moving vehicle over time."""

from dataclasses import dataclass

import numpy as np

from models.road.profile import RoadProfile


@dataclass(frozen=True)
class RoadUnderWheels:
    """Road heights zeta1, zeta2 (m, down) under the front and rear wheel and their time derivatives (m/s), at constant
    speed (m/s).

    The front contact is at s = speed t, the rear one ``wheelbase`` (m) behind it, with no rounding of the
    delay to whole steps.
    """

    profile: RoadProfile
    speed: float
    wheelbase: float
    kink_stations: tuple[float, ...] = (0.0,)
    channels: int = 4
    period: None = None
    held: bool = False

    @property
    def resolution(self) -> float:
        """Time (s) in which the vehicle passes the finest detail of the road: a station spacing or a quarter of a
        wavelength."""
        return self.profile.finest / self.speed

    def sample(self, start_time: float, step: float, sample_count: int) -> np.ndarray:
        """Heights and their rates at start_time + i step (s), shape (sample_count, 4)."""
        values_out = np.empty((sample_count, 4))
        for wheel, behind in enumerate((0.0, self.wheelbase)):
            height, slope = self.profile.sample_uniform(
                self.speed * start_time - behind, self.speed * step, sample_count
            )
            values_out[:, wheel], values_out[:, 2 + wheel] = height, self.speed * slope
        return values_out

    def at(self, time: float) -> np.ndarray:
        """Heights and their rates at a time (s), shape (4,)."""
        values_out = np.empty(4)
        for wheel, behind in enumerate((0.0, self.wheelbase)):
            height, slope = self.profile.height_slope_at(self.speed * time - behind)
            values_out[wheel], values_out[2 + wheel] = height, self.speed * slope
        return values_out

    def knots(self, duration: float) -> np.ndarray:
        """Times (s) at which a wheel passes a point where the road is only C2, such as its start."""
        stations = np.array(self.kink_stations)
        times = np.concatenate((stations, stations + self.wheelbase)) / self.speed
        return np.unique(times[(times > 0) & (times < duration)])
