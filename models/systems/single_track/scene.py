"""Scenes of a single-track car that is driven by a measured steer angle and a measured speed."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from models.core.scene_file import SceneFile, checked
from models.core.strict import Strict, quantity
from models.systems.single_track.equations import AxleTyres, SingleTrackCar

LARGEST_SHARPNESS = 20.0
"""Largest exponent of the bend between cornering stiffness and friction."""


class CarTable(Strict):
    """[vehicle]: parameters of a rigid car in the plane."""

    mass: float = quantity("kg", "of the whole car")
    front: float = quantity("m", "from the centre of mass to the front axle")
    rear: float = quantity("m", "from the centre of mass to the rear axle")
    yaw_inertia: float = quantity("kg m^2", "about the upright through the centre of mass")
    centre_height: float = quantity(
        "m", "of the centre of mass, by which loads move ahead and back", default=0.0, zero=True
    )
    drag: float = quantity("N s^2/m^2", "of the air, by the square of the speed", default=0.0, zero=True)
    front_brake: float = Field(default=0.6, ge=0, le=1, description="share of the front axle in braking")
    front_drive: float = Field(default=0.0, ge=0, le=1, description="share of the front axle in driving")


class AxleTable(Strict):
    """[front] and [rear]: the tyres of one axle."""

    stiffness: float = quantity("1/rad", "cornering stiffness by load")
    friction: float = quantity("", "largest side force by load")
    sharpness: float = Field(
        default=2.0, ge=1.0, le=LARGEST_SHARPNESS, description="of the bend from stiffness to friction"
    )
    side: float = Field(default=0.0, ge=-0.5, le=0.5, description="share of friction more in left turns, less in right")
    lift: float = quantity("N s^2/m^2", "by which the air lifts the axle, or presses it", default=0.0, signed=True)
    rise: float = Field(default=0.0, ge=0.0, le=0.5, description="share of the stiffness that is left beyond the bend")

    def axle(self) -> AxleTyres:
        """Returns the axle's parameters in the form that the compiled equations use."""
        return AxleTyres(self.stiffness, self.friction, self.sharpness, self.side, self.lift, self.rise)


class MeasuredDriveTable(Strict):
    """[drive]: the measured steer angle and speed that drive the car."""

    file: str = Field(description="CSV with time, steer (of the front wheels, left positive) and speed, with units")
    low_pass: float = quantity("Hz", "of steer and speed, without phase; 0 for none", default=0.0, zero=True)
    stretch: list[float] = Field(
        default=[], max_length=2, description="[s, s] of the file's time that are driven; all of it where empty"
    )


class SensorErrorTable(Strict):
    """[sensors]: errors of the sensors, by which readings differ from the motion of the car."""

    steer_ratio: float = quantity("", "steer angle of the wheels by the measured one", default=1.0)
    steer_offset: float = quantity("rad", "added to the measured steer angle", default=0.0, signed=True)
    steer_delay: float = quantity("s", "by which the wheels follow the measured angle", default=0.0, signed=True)
    side_slip_offset: float = quantity("rad", "that the sensor adds", default=0.0, signed=True)
    yaw_rate_offset: float = quantity("rad/s", "that the sensor adds", default=0.0, signed=True)
    acceleration_offset: float = quantity("m/s^2", "that the sensor adds", default=0.0, signed=True)
    acceleration_ratio: float = quantity("", "measured by true lateral acceleration", default=1.0)


class SingleTrackScene(SceneFile):
    """A scene of a single-track car: all tables of its scene file."""

    system: Literal["single-track"] = "single-track"
    study: str = Field(default="single_track", description="the study that runs the scene")
    vehicle: CarTable
    front: AxleTable
    rear: AxleTable
    drive: MeasuredDriveTable
    sensors: SensorErrorTable = SensorErrorTable()

    def car(self) -> SingleTrackCar:
        """Returns the car's parameters in the form that the compiled equations use."""
        return SingleTrackCar(*self.vehicle.model_dump().values())


def build(scene_tables: Mapping[str, Any], scene_path: str = "", scene_folder: Path = Path()) -> SingleTrackScene:
    """Build a checked single-track scene from the nested tables of a scene file. Raises InputError for unknown keys and
    for values outside their ranges.
    """
    return checked(SingleTrackScene, scene_tables, scene_path, scene_folder)
