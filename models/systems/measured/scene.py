"""Scenes of measured recordings: files and their channel map, vehicle, stabiliser, and output of section forces."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from models.core.errors import InputError
from models.core.scene_effects import with_effect_tables
from models.core.scene_file import SceneFile, checked
from models.core.strict import Query, Strict, accepted_queries_field, quantity
from models.drift.score import AcceptanceLimits
from models.measured.axle_balance import LOCATIONS_OF_AXLE_FORCES
from models.measured.signal import Frame, MeasurementPlaces, Quantity, TransducerPlace
from models.own_model.scene_vehicle import scene_vehicle
from models.systems.measured.pitch_plane import CHASSIS_NAME, SPRING_NAMES
from models.systems.measured.sections import section_names
from models.systems.measured.verdict import RUN_LIMITS
from models.systems.measured.virtual import VirtualTable
from models.systems.pitch_plane.scene import parameter_set
from models.vehicles.cut_vehicle import CutVehicle, cut_at_hubs
from models.vehicles.pitch_plane import PitchPlaneParameters

Engine = Literal["reference", "exudyn", "mujoco"]


@dataclass(frozen=True)
class MeasuredRig:
    """The vehicle that a recording drives, with the places of its sensors and sections.

    name : of the vehicle or the parameter set; chassis : body whose angles are measured; sections : names of sections
    at which forces can be requested; angles : components of the measured angles; vehicle : without tyres, None in the
    pitch plane.
    """

    name: str
    chassis: str
    places: MeasurementPlaces
    sections: tuple[str, ...]
    angles: tuple[str, ...]
    vehicle: CutVehicle | None

    @property
    def hubs(self) -> tuple[str, ...]:
        """Names of the hubs at which forces drive the vehicle."""
        return self.places.hubs


class MeasuredVehicleTable(Strict):
    """[vehicle]: a vehicle file and the name of its chassis, or a parameter set of the pitch-plane vehicle."""

    file: str | None = Field(
        default=None, description="a vehicle that comes with twinrig, a TOML file of your own or a car in MJCF"
    )
    chassis: str = Field(default="body", description="the body with all six freedoms")
    parameters: str | None = Field(default=None, description="of the pitch-plane vehicle: a set, or a TOML file")
    accept: list[Query] = accepted_queries_field()


class MappedChannel(Strict):
    """[[files.channels]]: quantity, place, component, axes and unit of a channel of the file."""

    channel: str = Field(description="name in the file")
    quantity: Quantity = Field(description="what it measures")
    at: str = Field(min_length=1, description="hub, body, connector or sensor that it belongs to")
    component: str = Field(default="", description="x, y, z; roll, pitch, yaw of angles and rates; none of a travel")
    frame: Frame | None = Field(default=None, description="whose axes")
    sign: Literal[1, -1] = Field(default=1, description="-1 where the file counts the other way")
    unit: str | None = Field(default=None, description="where the file names none, or another than it means")
    zero: float = Field(default=0.0, allow_inf_nan=False, description="what it reads at nought, in its unit: taken off")
    gravity: bool = Field(default=True, description="whether an acceleration includes it: +9.81 m/s^2 upwards at rest")
    check: bool = Field(default=False, description="only compared with, never put in")


class MeasuredFile(Strict):
    """[[files]]: a measurement file (CSV, MDF4, RPC III or TDMS), its clock and its channel map."""

    file: str = Field(description="the file, beside the scene")
    offset: float = quantity("s", "added to its clock", default=0.0, signed=True)
    drift: float = Field(default=0.0, gt=-0.1, lt=0.1, description="by which its clock is fast: 1e-4 is 0.36 s an hour")
    channels: list[MappedChannel] = Field(min_length=1, description="what its channels measure")


class SensorPlace(Strict):
    """[sensors.NAME]: body and position of an accelerometer or gyro."""

    body: str = Field(description="that carries it")
    position: list[float] = Field(min_length=3, max_length=3, description="x, y, z in m, in the vehicle's design axes")


class RecordingClock(Strict):
    """[clock]: sampling rate, start and duration of the recording; by default those of the wheel forces."""

    rate: float | None = quantity("Hz", "samples per second of the recording", default=None)
    start: float = quantity("s", "left out at the beginning", default=0.0, zero=True)
    duration: float | None = quantity("s", "length of the recording that is used; without it, all of it", default=None)


class NoiseTable(Strict):
    """[noise]: standard deviations of the white noise on each sample; estimated from the recording where not given."""

    force: float | None = quantity("N", "of every force sample", default=None)
    moment: float | None = quantity("N m", "of every moment sample", default=None)
    angle: float | None = quantity("rad", "of every angle", default=None)
    rate: float | None = quantity("rad/s", "of every angular rate", default=None)


class MeasuredStabiliserTable(Strict):
    """[stabilise]: method by which roll and pitch are kept from drifting off, and its settings."""

    method: Literal["kalman", "prescribed", "none"] = Field(default="kalman", description="what holds roll and pitch")
    bandwidth: float = quantity("Hz", "of the moment towards the filter's estimate", default=0.7)
    model: float = quantity("rad/s^2", "deviation of what springs add to a rigid vehicle, to the filter", default=10.0)
    smoothing: float = quantity("Hz", "low-pass of angles before they are enforced", default=5.0)


class MeasuredRunTable(Strict):
    """[run]: engine and time step of the runs."""

    engine: Engine = Field(default="mujoco", description="that computes it; --engine names another")
    step: float | None = quantity("s", "of Runge-Kutta 4; else the clock's period, or a part of it", default=None)


class SectionForceFilesTable(Strict):
    """[hand_on]: sections, file formats and Woehler exponents of the section forces that are written to files."""

    sections: list[str] | None = Field(default=None, description="springs, mounts, bars, joints; all if not named")
    formats: list[Literal["csv", "mf4", "rsp", "tdms"]] = Field(default=["csv"], description="of the section forces")
    slopes: list[float] = Field(default=[3.0, 5.0, 8.0], min_length=1, description="Woehler exponents")


class MeasuredScene(SceneFile):
    """A scene of a measured recording: all tables of its scene file."""

    system: Literal["measured"] = "measured"
    study: str = Field(default="recording", description="the study that runs the scene")
    vehicle: MeasuredVehicleTable
    files: list[MeasuredFile] = Field(default=[], description="what was measured")
    virtual: VirtualTable | None = Field(default=None, description="a virtual measurement in place of files")
    levers: dict[str, float] = Field(
        default={},
        description="hub -> m by which the point that its moments are about "
        "lies above it; of the contact patch minus the radius",
    )
    sensors: dict[str, SensorPlace] = Field(default={}, description="where accelerometers sit")
    clock: RecordingClock = RecordingClock()
    noise: NoiseTable = NoiseTable()
    stabilise: MeasuredStabiliserTable = MeasuredStabiliserTable()
    run: MeasuredRunTable = MeasuredRunTable()
    limits: AcceptanceLimits = Field(default=RUN_LIMITS, description="of the verdict")
    hand_on: SectionForceFilesTable = SectionForceFilesTable()
    effects: dict[str, Any] = Field(default_factory=dict, description="effects of your own, a table each")

    def rig(self) -> MeasuredRig:
        """Returns the vehicle that the recording drives, with its places. The pitch plane is driven at its axles or at
        the wheels of each axle. Raises InputError.
        """
        given_vehicle = self.vehicle
        if given_vehicle.file is None:
            hubs, springs = (
                tuple(hub for axle in LOCATIONS_OF_AXLE_FORCES.values() for hub in axle),
                tuple(SPRING_NAMES.values()),
            )
            places = MeasurementPlaces(hubs, (CHASSIS_NAME,), springs)
            return MeasuredRig(str(given_vehicle.parameters), CHASSIS_NAME, places, springs, ("pitch",), None)
        vehicle = cut_at_hubs(
            scene_vehicle(given_vehicle.file, self.folder, self.file, "vehicle.file"), given_vehicle.chassis
        )
        bodies, elements = (tuple(each.name for each in parts) for parts in (vehicle.uncut.bodies, vehicle.elements))
        places = MeasurementPlaces(vehicle.hubs, bodies, elements, tuple(self.sensors))
        return MeasuredRig(
            vehicle.tree.name, vehicle.chassis, places, section_names(vehicle), ("roll", "pitch"), vehicle
        )

    @property
    def places(self) -> dict[str, TransducerPlace]:
        """Body and position of each sensor, by name."""
        return {
            name: TransducerPlace(s.body, (s.position[0], s.position[1], s.position[2]))
            for name, s in self.sensors.items()
        }

    def plane(self) -> PitchPlaneParameters | None:
        """Returns the parameters of a pitch-plane vehicle, None for a vehicle in space; raises InputError."""
        parameters = self.vehicle.parameters
        return None if parameters is None else parameter_set(parameters, self.file, Path(self.folder))


def build(scene_tables: Mapping[str, Any], scene_path: str = "", scene_folder: Path = Path()) -> MeasuredScene:
    """Build a checked scene of a recording from the nested tables of a scene file. Raises InputError for unknown keys
    and for values outside their ranges.
    """
    scene = checked(MeasuredScene, scene_tables, scene_path, scene_folder)
    vehicle, names = scene.vehicle, [each.file for each in scene.files]
    if (vehicle.file is None) == (vehicle.parameters is None):
        what = "name either file, of a vehicle in space, or parameters, of the pitch-plane vehicle"
        raise InputError(scene_path, "vehicle", None, what)
    if vehicle.parameters is not None and "chassis" in vehicle.model_fields_set:
        raise InputError(scene_path, "vehicle.chassis", vehicle.chassis, "belongs to a vehicle file: drop it")
    if vehicle.parameters is not None and scene.virtual is not None:
        raise InputError(scene_path, "virtual", None, "is of a vehicle file: the pitch plane needs [[files]]")
    if bool(names) == (scene.virtual is not None):
        raise InputError(scene_path, "files", None, "give either [[files]] that were measured, or a table [virtual]")
    for i, name in enumerate(names):
        if name in names[:i]:
            raise InputError(
                scene_path, f"files.{i}.file", name, "is named twice: put all its channels into one [[files]]"
            )
    return with_effect_tables(scene)
