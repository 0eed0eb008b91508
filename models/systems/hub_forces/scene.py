"""Scenes of hub forces: a vehicle without tyres, measured hub forces or a road for a virtual measurement, and a
stabiliser of roll and pitch.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field

from models.core.errors import InputError
from models.core.scene_effects import extended_by_effects, with_effect_tables
from models.core.scene_file import SceneFile, checked
from models.core.signals import Interpolation
from models.core.steps import dividing_step, step_divides
from models.core.strict import Query, Strict, accepted_queries_field, quantity
from models.core.tables import NEWTONS, RADIANS, RADIANS_PER_SECOND
from models.core.time_series import CHASSIS_SAMPLE_TIME, read_time_series, wrong_time_unit_hint
from models.engines.assembly import Settings
from models.engines.cut_vehicle import FIXED_STEP_METHOD, ForceRoute
from models.engines.error_control import AdaptiveEngineTable, check_engines
from models.own_model.scene_vehicle import scene_vehicle
from models.systems.hub_forces.measurement import HubForces, MeasuredAngles
from models.vehicles.cut_vehicle import CutVehicle, cut_at_hubs

ForceFrame = Literal["hub", "body", "inertial"]
NoiseKind = Literal["white", "none"]
StabiliserMethod = Literal["none", "kalman", "prescribed"]
FACTOR_TO_NEWTON_METRES = {"N m": 1.0, "kN m": 1e3}
"""Units of moments that files may have, with their factors to N m."""
COLUMNS_OF_HUB = {
    "fx": NEWTONS,
    "fy": NEWTONS,
    "fz": NEWTONS,
    "mx": FACTOR_TO_NEWTON_METRES,
    "my": FACTOR_TO_NEWTON_METRES,
    "mz": FACTOR_TO_NEWTON_METRES,
}
"""Columns of a hub's forces and moments in a file, headed HUB_fx and so on, with the units that they may have."""
COLUMNS_OF_ANGLES = {
    "roll": RADIANS,
    "pitch": RADIANS,
    "roll_rate": RADIANS_PER_SECOND,
    "pitch_rate": RADIANS_PER_SECOND,
}
"""Columns of the measured angles and rates in a file, with the units that they may have. Roll to the right and pitch
nose down are positive, as rotations about x and y are.
"""


class HubVehicleTable(Strict):
    """[vehicle]: a vehicle file, and the name of its chassis."""

    file: str = Field(description="a vehicle that comes with twinrig, a TOML file of your own or a car in MJCF")
    chassis: str = Field(default="body", description="the body with all six freedoms")
    accept: list[Query] = accepted_queries_field()


class HubRunTable(Strict):
    """[run]: duration, time step, and which spring forces the engines compute by native elements."""

    duration: float = quantity("s", "of the measurement and of every run", default=15.0)
    step: float = quantity(
        "s", "of Runge-Kutta 4 in every engine, or from row to row and the longest of [engines.NAME]", default=1e-3
    )
    forces: ForceRoute = Field(
        default="native", description="springs, mounts and bars of the engine's own, or all in its one callback"
    )


class TwoTrackRoadTable(Strict):
    """[road]: random road of two tracks, over which the virtual measurement is made."""

    iso8608: Literal["A", "B", "C", "D", "E", "F", "G", "H"] = Field(default="C", description="class, its mean")
    seed: int = Field(default=1, ge=0, le=2**62, description="of the left track; the right one takes the next")
    speed: float = quantity("m/s", "of travel", default=20.0)


class HubForceTable(Strict):
    """[forces]: hub forces from a file or from a virtual measurement, their frame, and the
    deviations of their noise.
    """

    file: str | None = Field(default=None, description="CSV: time [s], then HUB_fx [N] ... HUB_mz [N m] of every hub")
    frame: ForceFrame = Field(
        default="hub", description="axes of what carries the wheel, of the chassis, or of the space"
    )
    interpolation: Interpolation = Field(default="linear", description="held, linear or smooth between the samples")
    accept: list[str] = Field(default=[], description="findings of the checks of a file, by name, that are meant so")
    sampling_rate: float = quantity("Hz", "of the virtual measurement", default=500.0)
    noise: NoiseKind = Field(default="white", description="of the virtual measurement; what is stated stays")
    force_deviation: float = quantity("N", "white noise of every force sample", default=8.0)
    moment_deviation: float = quantity("N m", "white noise of every moment sample", default=1.0)


class MeasuredAngleTable(Strict):
    """[angles]: measured roll and pitch with their rates, and the deviations of their noise."""

    file: str | None = Field(default=None, description="CSV: time [s], roll, pitch [rad]; roll_rate, pitch_rate")
    noise: NoiseKind = Field(default="white", description="of the virtual measurement; what the filter is told stays")
    angle_deviation: float = quantity("rad", "white noise of every angle", default=1.75e-3)
    rate_deviation: float = quantity("rad/s", "white noise of every rate", default=5e-3)

    @property
    def deviations(self) -> tuple[float, float]:
        """Standard deviations of the noise of every angle (rad) and of every rate (rad/s)."""
        return self.angle_deviation, self.rate_deviation


class HubStabiliserTable(Strict):
    """[stabilise]: method by which roll and pitch are kept from drifting off, and its settings."""

    method: StabiliserMethod = Field(default="none", description="what holds roll and pitch")
    bandwidth: float = quantity("Hz", "of the moment towards the filter's estimate", default=0.7)
    model: float = quantity(
        "rad/s^2",
        "standard deviation, in the filter, of the acceleration that the suspension adds to a rigid vehicle",
        default=10.0,
    )
    smoothing: float = quantity("Hz", "low-pass of angles before they are enforced", default=5.0)


class HubScene(SceneFile):
    """A scene of hub forces: all tables of its scene file."""

    system: Literal["hub-forces"] = "hub-forces"
    study: str = Field(default="hub_forces", description="the study that runs the scene")
    vehicle: HubVehicleTable
    run: HubRunTable = HubRunTable()
    road: TwoTrackRoadTable | None = Field(default=None, description="of the virtual measurement")
    forces: HubForceTable = HubForceTable()
    angles: MeasuredAngleTable = MeasuredAngleTable()
    stabilise: HubStabiliserTable = HubStabiliserTable()
    seed: int = Field(default=1, ge=0, le=2**62, description="of the noise")
    effects: dict[str, Any] = Field(default_factory=dict, description="effects of your own, a table each")
    engines: dict[str, AdaptiveEngineTable] = Field(
        default_factory=dict, description="engines that pick their own steps"
    )

    @property
    def step_count(self) -> int:
        """Number of time steps in every run."""
        return round(self.run.duration / self.run.step)

    def settings(self, engine: str) -> Settings:
        """Time integration settings of an engine: Runge-Kutta 4, or an integrator that chooses its own steps."""
        step, duration, adaptive = self.run.step, self.run.duration, self.engines.get(engine)
        if adaptive is None:
            return Settings(FIXED_STEP_METHOD, step, duration)
        return Settings(adaptive.integrator, step, duration, adaptive.tolerance)

    def spring_force_route(self, stabiliser_method: StabiliserMethod) -> ForceRoute:
        """How a run computes spring forces ("native" or "compiled") with a stabiliser. Enforced roll and pitch need
        compiled forces, whatever the scene says.
        """
        return "compiled" if stabiliser_method == "prescribed" else self.run.forces

    def cut_vehicle(self) -> CutVehicle:
        """Returns the vehicle without its tyres, cut at the hubs, with the scene's effects; raises InputError."""
        vehicle = scene_vehicle(self.vehicle.file, self.folder, self.file, "vehicle.file")
        return cut_at_hubs(extended_by_effects(vehicle, self), self.vehicle.chassis)

    def deviations(self, vehicle: CutVehicle) -> np.ndarray:
        """Standard deviations (6 h,) of the noise of each hub force (N) and moment (N m), hub by hub."""
        return np.tile(np.repeat([self.forces.force_deviation, self.forces.moment_deviation], 3), len(vehicle.hubs))

    def measured(self, vehicle: CutVehicle) -> tuple[HubForces, MeasuredAngles]:
        """Reads hub forces and angles from the scene's files; raises InputError."""
        assert self.forces.file is not None and self.angles.file is not None
        columns = {f"{hub}_{name}": units for hub in vehicle.hubs for name, units in COLUMNS_OF_HUB.items()}
        path = self.path(self.forces.file, "forces.file")
        forces, period = read_time_series(path, columns)
        if period > CHASSIS_SAMPLE_TIME:
            allowed = (
                f"its samples lie {period:g} s apart, and a vehicle moves within {CHASSIS_SAMPLE_TIME:g} s: if its "
                "times are "
                "in milliseconds, not in seconds, correct the unit that heads them"
            )
            raise InputError(self.file, "forces.file", self.forces.file, allowed)
        angles, spacing = read_time_series(self.path(self.angles.file, "angles.file"), COLUMNS_OF_ANGLES)
        if abs(spacing - period) > 1e-9 * period:
            raise InputError(
                self.file,
                "angles.file",
                self.angles.file,
                f"is sampled every {spacing:g} s and the forces every {period:g} s: they must agree",
            )
        last_time = period * (min(len(forces), len(angles)) - 1)
        if last_time < self.run.duration * (1 - 1e-9):
            allowed = f"the files end at {last_time:g} s{wrong_time_unit_hint(last_time, self.run.duration)}"
            raise InputError(self.file, "run.duration", self.run.duration, allowed)
        if self.forces.interpolation == "held" and not step_divides(self.run.step, period):
            allowed = f"must divide the period of {period:g} s over which samples are held"
            raise InputError(self.file, "run.step", self.run.step, allowed)
        count = round(self.run.duration / period) + 1
        return HubForces(forces[:count], period, self.forces.frame), MeasuredAngles(angles[:count], period)


def build(scene_tables: Mapping[str, Any], scene_path: str = "", scene_folder: Path = Path()) -> HubScene:
    """Build a checked scene of hub forces from the nested tables of a scene file. Raises InputError for unknown keys
    and for values outside their ranges.
    """
    scene = checked(HubScene, scene_tables, scene_path, scene_folder)
    if (scene.forces.file is None) == (scene.road is None):
        raise InputError(
            scene_path, "road", None, "give either the table road, for a virtual measurement, or forces.file"
        )
    if (scene.forces.file is None) != (scene.angles.file is None):
        missing = "angles.file" if scene.angles.file is None else "forces.file"
        raise InputError(scene_path, missing, None, "is missing: forces and angles are measured together")
    if scene.forces.file is not None:
        _check_file_only(scene_path, scene)
    elif scene.forces.accept:
        raise InputError(scene_path, "forces.accept", scene.forces.accept, "is of forces.file: nothing else is checked")
    if "forces" in scene.run.model_fields_set and scene.run.forces != scene.spring_force_route(scene.stabilise.method):
        allowed = "an enforced tilt needs all forces in one place: drop it, or choose another stabilise.method"
        raise InputError(scene_path, "run.forces", scene.run.forces, allowed)
    _check_steps(scene_path, scene)
    check_engines(scene_path, scene.engines)
    return with_effect_tables(scene)


def _check_file_only(scene_path: str, scene: HubScene) -> None:
    """Raise InputError for keys that only a virtual measurement can have, in a scene with measured files."""
    for table, name in (("forces", "sampling_rate"), ("forces", "noise"), ("angles", "noise")):
        entries = getattr(scene, table)
        if name in entries.model_fields_set:
            raise InputError(scene_path, f"{table}.{name}", getattr(entries, name), f"is that of {table}.file: drop it")


def _check_steps(scene_path: str, scene: HubScene) -> None:
    step, duration = scene.run.step, scene.run.duration
    if not step_divides(step, duration):
        allowed = f"must divide run.duration = {duration:g} s, as {dividing_step(step, duration)} s does"
        raise InputError(scene_path, "run.step", step, allowed)
    period = 1.0 / scene.forces.sampling_rate
    if scene.road is not None and not (step_divides(step, period) and step_divides(period, duration)):
        allowed = f"its period must be a multiple of run.step = {step:g} s and divide run.duration = {duration:g} s"
        raise InputError(scene_path, "forces.sampling_rate", scene.forces.sampling_rate, allowed)
