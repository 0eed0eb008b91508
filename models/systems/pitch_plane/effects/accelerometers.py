"""Tri-axial accelerometers on the chassis, on rigid mounts or on a compliant bracket.

They read the engine's accelerations at their sampling times and have no effect on the motion. Between samples the
reading is constant.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from pydantic import Field

from models.core.noise import ACCELEROMETERS, normal_samples
from models.core.result import Result
from models.core.strict import Strict, quantity
from models.core.trajectory import Trajectory
from models.engines.assembly import Assembly, Channels
from models.engines.model import Model
from models.systems.pitch_plane.sampling import (
    PATH_FIELD,
    SEED_FIELD,
    check_rate,
    instant_numbers,
    sample_and_hold,
    within_range,
)

COST = "one acceleration of the engine per sample after the run; no state in any engine"
EXAMPLE = {"sampling_rate": 200.0, "sensors": {"one": {"x": 1.0, "z": 0.2}}}
COUNTS = {"all": {"channels": 3}}

CHANNELS = ("ax1", "ay1", "az1 and so on, three per sensor")
USUAL_RANGE = 157.0
"""Usual range (m/s^2) of an accelerometer: 16 g, the largest of most micromechanical ones."""
RATE_KEY = "effects.accelerometers.sampling_rate"


class Bracket(Strict):
    """[effects.accelerometers.sensors.NAME.bracket]: compliant mount of a sensor, too light to move the body."""

    frequency: float = quantity("Hz", "natural frequency of the sensor on its bracket")
    damping: float = quantity("", "damping ratio", zero=True)


class Sensor(Strict):
    """[effects.accelerometers.sensors.NAME]: position of a sensor from the centre of mass, in axes of the chassis."""

    x: float = quantity("m", "forward", signed=True)
    y: float = quantity("m", "to the right", default=0.0, signed=True)
    z: float = quantity("m", "down", signed=True)
    bracket: Bracket | None = Field(None, description="a compliant mount; rigid where it is left out")


class Parameters(Strict):
    """[effects.accelerometers]: sampling rate, sensors, noise and range."""

    sampling_rate: float = quantity("Hz", "samples per second; the run's steps must divide its period")
    sensors: dict[str, Sensor] = Field(min_length=1, description="tables with x, y, z of each sensor, by its name")
    deviation: float = quantity("m/s^2", "standard deviation of each sample's white noise", default=0.0, zero=True)
    range: float | None = quantity(
        "m/s^2", "largest reading of each axis; 157, as of most, where none is given", default=None
    )
    seed: int = SEED_FIELD
    path: int = PATH_FIELD

    def positions(self) -> dict[str, tuple[float, float, float]]:
        """Positions (x, y, z) of all sensors in m from the centre of mass, by name."""
        return {name: (sensor.x, sensor.y, sensor.z) for name, sensor in self.sensors.items()}


def channels_of_sensors(sensor_parameters: Parameters) -> list[tuple[str, ...]]:
    """Names of the three channels of each sensor, in the scene's order: ax1, ay1, az1, then ax2 and so on."""
    return [tuple(f"a{axis}{i + 1}" for axis in "xyz") for i in range(len(sensor_parameters.sensors))]


def readings_of(result: Result, sensor_parameters: Parameters) -> np.ndarray:
    """Returns the readings (n, sensors, 3) in m/s^2 of the accelerometers in a result."""
    return np.stack(
        [
            np.column_stack([result[channel] for channel in channels])
            for channels in channels_of_sensors(sensor_parameters)
        ],
        axis=1,
    )


@dataclass(frozen=True)
class Accelerometers:
    """Function that computes the readings of all accelerometers over a run."""

    parameters: Parameters

    def __call__(self, vehicle_assembly: Assembly, trajectory: Trajectory, engine_model: Model) -> Channels:
        """Returns three channels per sensor: specific force (m/s^2) along the chassis' x, y and z."""
        p, number = self.parameters, instant_numbers(trajectory.times, self.parameters.sampling_rate)
        row = sample_and_hold(
            trajectory.times, np.arange(len(trajectory.times)), p.sampling_rate, vehicle_assembly.scene, RATE_KEY
        )
        values = self._readings(vehicle_assembly, trajectory, engine_model, np.unique(row))[number]
        return {
            channel: ("m/s^2", f"accelerometer {sensor}, specific force along the chassis' {axis}", values[:, i, j])
            for i, (sensor, channels) in enumerate(zip(p.sensors, channels_of_sensors(p), strict=True))
            for j, (axis, channel) in enumerate(zip("xyz", channels, strict=True))
        }

    def _readings(
        self, vehicle_assembly: Assembly, trajectory: Trajectory, engine_model: Model, sample_rows: np.ndarray
    ) -> np.ndarray:
        """Readings (samples, sensors, 3) in m/s^2 at ``sample_rows``, the run's rows at the sampling times."""
        from models.sensors.sensor_array import reading_on_bracket, sensor_readings

        p, y = self.parameters, trajectory.states[sample_rows]
        accelerations = np.array(
            [
                engine_model.acceleration(trajectory.times[row], trajectory.positions[row], trajectory.rates[row])
                for row in sample_rows
            ]
        )
        sensor_positions = np.array(list(p.positions().values()))
        values = sensor_readings(
            sensor_positions, y[:, 3], y[:, 7], accelerations[:, 2], accelerations[:, 3], vehicle_assembly.parameters.g
        )
        for i, sensor in enumerate(p.sensors.values()):
            if sensor.bracket is not None:
                values[:, i] = reading_on_bracket(
                    values[:, i], 1 / p.sampling_rate, sensor.bracket.frequency, sensor.bracket.damping
                )
        noise = normal_samples(p.seed, p.path, len(values), 3 * len(sensor_positions), noise_source=ACCELEROMETERS)
        return values + p.deviation * noise.reshape(values.shape)


def extend(vehicle_assembly: Assembly, parameters: Any) -> Assembly:
    """Returns the assembly with accelerometer readings among its channels."""
    check_rate(vehicle_assembly.scene, RATE_KEY, parameters.sampling_rate)
    axes = {
        f"{sensor}, {axis}": channel
        for sensor, channels in zip(parameters.sensors, channels_of_sensors(parameters), strict=True)
        for axis, channel in zip("xyz", channels, strict=True)
    }
    range_assumption = within_range("accelerometers", axes, "m/s^2", parameters.range or USUAL_RANGE)
    return replace(
        vehicle_assembly,
        sensors=(*vehicle_assembly.sensors, Accelerometers(parameters)),
        assumptions=(*vehicle_assembly.assumptions, range_assumption),
    )
