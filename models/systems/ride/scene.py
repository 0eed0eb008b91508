"""Scenes of ride: a vehicle, a random road of two tracks, speeds, and frequency weightings of outputs by ISO 2631-1."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Literal

from pydantic import Field

from models.core.errors import InputError
from models.core.scene_effects import with_effect_tables
from models.core.scene_file import SceneFile, checked
from models.core.speeds import Speeds, check_speeds
from models.core.strict import Query, Strict, accepted_queries_field, quantity
from models.ride.speed_profile import SpeedProfile
from models.road import TRACK_WIDTH
from models.road.two_track import MEAN_CORNER, ROLL_CORNER, TRACK_DENSITY_LEVEL

LeftRightCorrelation = Literal["modelled", "uncorrelated", "equal"]
FrontRearCorrelation = Literal["delayed", "uncorrelated", "equal"]
WheelTracks = Literal["own", "tracks"]


class RideVehicleTable(Strict):
    """[vehicle]: a vehicle file, and the operating point about which the vehicle is linearised."""

    file: str = Field(description="a vehicle that comes with twinrig, a TOML file of your own or a car in MJCF")
    small_motion: bool = Field(default=False, description="curves and friction of springs by their slopes at rest")
    operating_point: Literal["unloaded", "loaded"] = Field(default="unloaded", description="loaded: gravity, preload")
    accept: list[Query] = accepted_queries_field()


class RideRoadTable(Strict):
    """[road]: random road of two tracks, made of a mean and a roll process, with published values or fitted to a
    measured road.
    """

    file: str | None = Field(default=None, description="OpenCRG, or CSV of two tracks, to which both are fitted")
    track_width: float = quantity("m", "between the measured tracks", default=TRACK_WIDTH)
    first: float | None = quantity("m", "where along the file to begin", default=None, zero=True)
    last: float | None = quantity("m", "where along the file to end", default=None)

    level: float = quantity("m", "S0: a track's spectrum tends to S0 / Omega^2, two-sided", default=TRACK_DENSITY_LEVEL)
    iso8608: Literal["A", "B", "C", "D", "E", "F", "G", "H"] | None = Field(
        default=None, description="class instead of a level: its mean, one-sided as the standard has it"
    )
    q_mean: float | None = quantity("m", "intensity of the mean process instead of a level", default=None, zero=True)
    q_roll: float | None = quantity("1/m", "intensity of the roll process", default=None, zero=True)
    corner_mean: float = quantity("rad/m", "corner of the mean process", default=MEAN_CORNER)
    corner_roll: float = quantity("rad/m", "corner of the roll process", default=ROLL_CORNER)
    cutoff: float | None = quantity("rad/m", "second corner, where outputs see the road's rate", default=None)
    half_track: float | None = quantity("m", "where the tracks have the level: half the front track", default=None)
    left_right: LeftRightCorrelation = Field(default="modelled", description="how the tracks go together")
    front_rear: FrontRearCorrelation = Field(default="delayed", description="how the axles' roads go together")
    wheels: WheelTracks = Field(default="own", description="each at its own y, or in the front wheels' tracks")


class DriveTable(Strict):
    """[drive]: a speed that varies over time, linear between points."""

    time: list[float] = Field(description="times in s, rising")
    speed: list[float] = Field(description="speeds in m/s at these times, 0 for standstill")

    def profile(self, scene_path: str = "") -> SpeedProfile:
        """Returns the speed over time of the drive. Raises InputError for times that do not rise or negative speeds."""
        return SpeedProfile(self.time, self.speed, scene_path)


class RideScene(SceneFile):
    """A scene of ride: all tables of its scene file, among them either [speeds] or [drive]."""

    CHOOSING: ClassVar[str] = "ride_choice"

    system: Literal["ride"] = "ride"
    study: str = Field(default="ride", description="the study that runs the scene")
    vehicle: RideVehicleTable
    road: RideRoadTable = RideRoadTable()
    speeds: Speeds | None = Field(default=None, description="constant speeds")
    drive: DriveTable | None = Field(default=None, description="a speed that varies")
    weighting: dict[str, Literal["Wk", "Wd"]] = Field(default_factory=dict, description="ISO 2631-1, output by output")
    effects: dict[str, Any] = Field(default_factory=dict, description="effects of your own, a table each")

    def check_choice(self) -> None:
        """Raise InputError unless a scene that asks for a choice of effects has quantities, a tolerance and constant
        speeds.
        """
        super().check_choice()
        if self.study == self.CHOOSING and self.speeds is None:
            raise InputError(self.file, "drive", None, "effects are chosen at constant speeds: give [speeds]")


def build(scene_tables: Mapping[str, Any], scene_path: str = "", scene_folder: Path = Path()) -> RideScene:
    """Build a checked ride scene from the nested tables of a scene file. Raises InputError for unknown keys and for
    values outside their ranges.
    """
    scene = checked(RideScene, scene_tables, scene_path, scene_folder)
    if (scene.speeds is None) == (scene.drive is None):
        raise InputError(scene_path, "speeds", None, "give either the table speeds or the table drive, and not both")
    if scene.speeds is not None:
        check_speeds(scene_path, scene.speeds)
    if scene.drive is not None:
        scene.drive.profile(scene_path)
    _check_road(scene_path, scene.road)
    return with_effect_tables(scene)


KEYS_OF_ROAD_FILE = ("track_width", "first", "last")
"""Keys of [road] that have a meaning only with a measured road file."""
KEYS_REPLACED_BY_FILE = ("level", "iso8608", "q_mean", "q_roll", "corner_mean", "corner_roll", "half_track")
"""Keys of [road] whose values are fitted where a measured road file is given."""


def _check_road(scene_path: str, road_table: RideRoadTable) -> None:
    foreign = KEYS_OF_ROAD_FILE if road_table.file is None else KEYS_REPLACED_BY_FILE
    for name in foreign:
        if name in road_table.model_fields_set:
            allowed = (
                "has no meaning without road.file" if road_table.file is None else "is fitted to road.file: drop it"
            )
            raise InputError(scene_path, f"road.{name}", getattr(road_table, name), allowed)
    _check_intensities(scene_path, road_table)
    for name in ("corner_mean", "corner_roll"):
        if road_table.cutoff is not None and road_table.cutoff <= getattr(road_table, name):
            allowed = f"must be above road.{name}, {getattr(road_table, name):g} rad/m"
            raise InputError(scene_path, "road.cutoff", road_table.cutoff, allowed)


def _check_intensities(scene_path: str, road_table: RideRoadTable) -> None:
    given_intensities = [name for name in ("q_mean", "q_roll") if getattr(road_table, name) is not None]
    if len(given_intensities) == 1:
        missing_intensity = "q_roll" if given_intensities == ["q_mean"] else "q_mean"
        raise InputError(
            scene_path, f"road.{missing_intensity}", None, f"is missing: it belongs to road.{given_intensities[0]}"
        )
    if given_intensities and not road_table.q_mean and not road_table.q_roll:
        raise InputError(scene_path, "road.q_mean", road_table.q_mean, "is 0, and road.q_roll, too: this is no road")
    for name in ("level", "iso8608", "half_track") if given_intensities else ():
        if name in road_table.model_fields_set:
            raise InputError(
                scene_path, f"road.{name}", getattr(road_table, name), "is not read beside q_mean and q_roll"
            )
    if road_table.iso8608 is not None and "level" in road_table.model_fields_set:
        raise InputError(
            scene_path,
            "road.level",
            road_table.level,
            f"is that of class {road_table.iso8608} already: drop one of them",
        )
