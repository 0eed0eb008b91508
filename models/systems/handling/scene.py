"""Scenes of handling: a vehicle, its tyres, the road, and manoeuvres that are simulated separately."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field, PrivateAttr

from models.core.errors import InputError
from models.core.scene_effects import extended_by_effects, with_effect_tables
from models.core.scene_file import SceneFile, checked
from models.core.steps import MOST_STEPS, dividing_step, step_divides
from models.core.strict import Query, Strict, accepted_queries_field, quantity
from models.engines.assembly import Settings
from models.engines.error_control import AdaptiveEngineTable, check_engines
from models.multibody.numbers import Controls, Handling, TyreParameters
from models.own_model.scene_vehicle import scene_vehicle
from models.road.iso8608 import level_of_class
from models.road.plane_waves import plane_waves
from models.vehicles.spatial import SpatialVehicle

if TYPE_CHECKING:
    from models.measured.drive import MeasuredDrive

TimeValuePair = Annotated[list[float], Field(min_length=2, max_length=2)]
Knots = Annotated[list[TimeValuePair], Field(min_length=1)]
NO_CONTROL = [[0.0, 0.0]]
CONTROL_LIMITS = {"steer": (-1.2, 1.2, "rad"), "brake": (0.0, 1e5, "N m"), "drive": (0.0, 1e5, "N m")}
"""Smallest and largest value of each of the driver's controls, with its unit."""


class HandlingVehicleTable(Strict):
    """[vehicle]: file of a vehicle whose chassis has six degrees of freedom, with a cornering stiffness for every tyre;
    it may tow trailers.
    """

    file: str = Field(
        default="r19_free", description="a vehicle that comes with twinrig, a TOML file of your own or a car in MJCF"
    )
    accept: list[Query] = accepted_queries_field()


class HandlingTyreTable(Strict):
    """[tyres]: parameters of wheels and tyres that are not in the vehicle file."""

    friction: float = quantity("", "coefficient between tyre and road", default=0.9)
    half_width: float = Field(default=0.09, gt=0.0, le=0.5, description="m, of the patch, across")
    inclination: float = Field(
        default=0.0,
        ge=-0.5,
        le=0.5,
        description="rad, of the left wheels about their forward axis; the right ones mirrored",
    )
    cells: int = Field(default=21, ge=3, le=200, description="of the patch's net, per strip")
    spin_inertia: float = quantity("kg m^2", "of a wheel about its axle, chosen", default=1.7)
    brake_rate: float = quantity("rad/s", "spin from which a brake's torque is whole", default=1.0)
    cornering: list[Annotated[float, Field(gt=0.0, le=10.0)]] = Field(
        default=[], description="ratio of each axle's cornering stiffness to the vehicle file's, front first; empty: 1"
    )


class HandlingRoadTable(Strict):
    """[road]: the rough road surface, the same for all manoeuvres that run on a rough road."""

    iso8608: Literal["A", "B", "C", "D", "E", "F", "G", "H"] = Field(default="A", description="class, its mean level")
    waves: int = Field(default=48, ge=1, le=10_000, description="plane waves that make up the surface")
    seed: int = Field(default=1, ge=0, le=2**62, description="of the waves")


class HandlingRunTable(Strict):
    """[run]: time step, and which spring forces the engines compute by native elements."""

    step: float = quantity(
        "s", "of Runge-Kutta 4 in every engine, or from row to row and the longest of [engines.NAME]", default=1e-3
    )
    forces: Literal["native", "compiled"] = Field(
        default="native",
        description="springs of what is towed: the engine's own as far as it has them, or compiled forces",
    )


class Manoeuvre(Strict):
    """[manoeuvres.NAME]: a manoeuvre from straight rolling; the driver's controls go smoothly between knots
    [time, value].

    A measured drive has no controls of its own: the car steers as measured, and its torques give the measured speed.
    """

    measured: str = Field(default="", description="CSV with time, steer (front wheels, left positive) and speed")
    stretch: list[float] = Field(
        default=[], max_length=2, description="[s, s] of the measured file's time that is driven; all of it where empty"
    )
    speed: float = quantity("m/s", "at the start; a measured drive has its own", default=0.0, zero=True)
    duration: float = quantity("s", "of the manoeuvre; of a measured drive all, or at most that", default=4.0)
    steer: Knots = Field(default=NO_CONTROL, description="angle of the front wheels, left positive: [[s, rad], ...]")
    brake: Knots = Field(default=NO_CONTROL, description="torque of all brakes together: [[s, N m], ...]")
    drive: Knots = Field(default=NO_CONTROL, description="torque of all driven wheels together: [[s, N m], ...]")
    front_brake: float = Field(default=0.65, ge=0, le=1, description="share of the front axle in braking")
    front_drive: float = Field(default=0.0, ge=0, le=1, description="share of the front axle in driving")
    rough: bool = Field(default=False, description="on the rough road of [road], else on a flat one")

    def controls(self) -> Controls:
        """Returns the driver's steer angle, brake torque and drive torque over time, with the shares of the axles."""
        steer, brake, drive = (
            tuple((float(time), float(value)) for time, value in getattr(self, name)) for name in CONTROL_LIMITS
        )
        return Controls(steer, brake, drive, self.front_brake, self.front_drive)


class HandlingScene(SceneFile):
    """A scene of handling: all tables of its scene file."""

    system: str = Field(default="handling", pattern="^handling$")
    study: str = Field(default="handling", description="the study that runs the scene")
    vehicle: HandlingVehicleTable = HandlingVehicleTable()
    tyres: HandlingTyreTable = HandlingTyreTable()
    road: HandlingRoadTable = HandlingRoadTable()
    run: HandlingRunTable = HandlingRunTable()
    manoeuvres: dict[str, Manoeuvre] = Field(min_length=1, description="driven one by one, a table each")
    effects: dict[str, Any] = Field(default_factory=dict, description="effects of your own, a table each")
    engines: dict[str, AdaptiveEngineTable] = Field(
        default_factory=dict, description="engines that pick their own steps"
    )
    _measured_controls: dict[str, Controls] = PrivateAttr(default_factory=dict)
    """Controls that were computed for measured drives, by manoeuvre."""

    def adaptive(self, engine: str, manoeuvre_name: str) -> Settings | None:
        """Returns the settings of an engine that chooses its own time steps in a manoeuvre; None for Runge-Kutta 4."""
        adaptive = self.engines.get(engine)
        duration = self.manoeuvres[manoeuvre_name].duration
        return None if adaptive is None else Settings(adaptive.integrator, self.run.step, duration, adaptive.tolerance)

    def handling(self, manoeuvre_name: str) -> Handling:
        """Returns vehicle, tyres, road and controls of a manoeuvre. Torques of a measured drive are computed once."""
        car = self.model_with_scene_controls(manoeuvre_name)
        if not self.manoeuvres[manoeuvre_name].measured:
            return car
        if manoeuvre_name not in self._measured_controls:
            from models.systems.handling.following import controls_following_drive

            self._measured_controls[manoeuvre_name] = controls_following_drive(
                car, self.drive(manoeuvre_name), self.run.step, self.file
            )
        return car.changed(controls=self._measured_controls[manoeuvre_name])

    def model_with_scene_controls(self, manoeuvre_name: str) -> Handling:
        """Returns vehicle, tyres, road and scene controls of a manoeuvre, without the controls of a measured drive."""
        manoeuvre, road = self.manoeuvres[manoeuvre_name], self.road
        waves = (
            plane_waves(level_of_class(road.iso8608), road.waves, road.seed) if manoeuvre.rough else np.empty((0, 4))
        )
        tyres = TyreParameters(**self.tyres.model_dump(exclude={"cornering"}))
        return extended_by_effects(
            Handling(self.file_vehicle(), tyres, manoeuvre.controls(), waves, forces=self.run.forces), self
        )

    def drive(self, manoeuvre_name: str) -> "MeasuredDrive":
        """Reads the measured drive of a manoeuvre, cut to the manoeuvre's duration. Raises InputError for a file
        without a drive.
        """
        from models.measured.drive import read_drive

        manoeuvre = self.manoeuvres[manoeuvre_name]
        path = self.path(manoeuvre.measured, f"manoeuvres.{manoeuvre_name}.measured")
        read, table = read_drive(path, tuple(manoeuvre.stretch)), manoeuvre.model_fields_set
        if "duration" not in table:
            return read
        count = round(manoeuvre.duration / float(read.times[1] - read.times[0])) + 1
        return replace(read, **{key: getattr(read, key)[:count] for key in ("times", "steer", "speed")})

    def start_time(self, manoeuvre_name: str) -> float:
        """Start time (s) of a manoeuvre's results: that of its measured drive, or else 0."""
        return float(self.drive(manoeuvre_name).times[0]) if self.manoeuvres[manoeuvre_name].measured else 0.0

    def file_vehicle(self) -> SpatialVehicle:
        """Returns the vehicle of the vehicle file with its trailers, and with cornering stiffnesses scaled as in
        [tyres].
        """
        vehicle = scene_vehicle(self.vehicle.file, self.folder, self.file, "vehicle.file", allows_towing=True)
        if not (ratios := self.tyres.cornering):
            return vehicle
        axles = len({tyre.axle for tyre in vehicle.tyres})
        if len(ratios) != axles:
            raise InputError(self.file, "tyres.cornering", ratios, f"needs a ratio for each of the {axles} axles")
        ratio = {tyre.name: ratios[tyre.axle] for tyre in vehicle.tyres}
        forces = (
            replace(side_force, stiffness=ratio[side_force.name] * side_force.stiffness)
            for side_force in vehicle.side_forces
        )
        return replace(vehicle, side_forces=tuple(forces))


def build(scene_tables: Mapping[str, Any], scene_path: str = "", scene_folder: Path = Path()) -> HandlingScene:
    """Build a checked handling scene from the nested tables of a scene file. Raises InputError for unknown keys and for
    values outside their ranges.
    """
    scene = checked(HandlingScene, scene_tables, scene_path, scene_folder)
    scene = _with_measured_drives(scene)
    for name, manoeuvre in scene.manoeuvres.items():
        key_path = f"manoeuvres.{name}"
        _check_times(scene, key_path, manoeuvre)
        for control, limits in CONTROL_LIMITS.items():
            _check_knots(scene, f"{key_path}.{control}", getattr(manoeuvre, control), *limits)
    check_engines(scene.file, scene.engines)
    return with_effect_tables(scene)


def _with_measured_drives(scene: HandlingScene) -> HandlingScene:
    """Returns the scene with speed and duration of each measured drive filled in. Raises InputError for a manoeuvre
    without a speed.
    """
    filled = dict[str, Manoeuvre]()
    for name, manoeuvre in scene.manoeuvres.items():
        if manoeuvre.measured:
            filled[name] = _measured_manoeuvre(scene, name, manoeuvre)
        elif manoeuvre.speed > 0.0:
            filled[name] = manoeuvre
        else:
            raise InputError(scene.file, f"manoeuvres.{name}.speed", None, "is missing, or not above 0 (m/s)")
    return scene.model_copy(update={"manoeuvres": filled})


def _measured_manoeuvre(scene: HandlingScene, manoeuvre_name: str, manoeuvre: Manoeuvre) -> Manoeuvre:
    """Returns a manoeuvre with the speed and duration of its measured drive. Raises InputError for keys that contradict
    the measured file.
    """
    file, key_path, drive = scene.file, f"manoeuvres.{manoeuvre_name}", scene.drive(manoeuvre_name)
    for control in CONTROL_LIMITS:
        if getattr(manoeuvre, control) != NO_CONTROL:
            raise InputError(file, f"{key_path}.{control}", None, "cannot go with a measured drive, which has its own")
    period = float(drive.times[1] - drive.times[0])
    if not step_divides(scene.run.step, period):
        raise InputError(
            file, "run.step", scene.run.step, f"must divide {period:g} s, the clock of {key_path}.measured"
        )
    first, lasts = float(drive.speed[0]), round(period * (len(drive.times) - 1), 9)
    if manoeuvre.speed not in (0.0, first):
        raise InputError(file, f"{key_path}.speed", manoeuvre.speed, f"the measured drive begins with {first:g} m/s")
    if "duration" in manoeuvre.model_fields_set and manoeuvre.duration > lasts * (1.0 + 1e-9):
        raise InputError(file, f"{key_path}.duration", manoeuvre.duration, f"the measured drive lasts {lasts:g} s")
    return manoeuvre.model_copy(update={"speed": first, "duration": lasts})


def _check_times(scene: HandlingScene, key_path: str, manoeuvre: Manoeuvre) -> None:
    step, duration = scene.run.step, manoeuvre.duration
    if duration / step > MOST_STEPS:
        allowed = f"needs {duration / step:.3g} steps; at most {MOST_STEPS:,} are possible"
        raise InputError(scene.file, f"{key_path}.duration", duration, allowed)
    if not step_divides(step, duration):
        allowed = f"must divide {key_path}.duration = {duration:g} s; use for example {dividing_step(step, duration)}"
        raise InputError(scene.file, "run.step", step, allowed)


def _check_knots(
    scene: HandlingScene, key_path: str, knots: list[TimeValuePair], lower_limit: float, upper_limit: float, unit: str
) -> None:
    """Raise InputError for knots of a control whose times do not rise, whose values exceed the limits, or whose
    value changes within less than a time step.
    """
    (knot_times, values), file, step = np.array(knots, float).T, scene.file, scene.run.step
    if not np.isfinite(knot_times).all() or (np.diff(knot_times) <= 0.0).any():
        raise InputError(file, key_path, knot_times.tolist(), "times must be finite and rise from knot to knot, in s")
    if not ((values >= lower_limit) & (values <= upper_limit)).all():
        raise InputError(
            file, key_path, values.tolist(), f"values must be from {lower_limit:g} to {upper_limit:g} {unit}"
        )
    shortest = float(np.diff(knot_times)[np.diff(values) != 0.0].min(initial=np.inf))
    if shortest < step * (1.0 - 1e-9):
        allowed = f"changes within {shortest:.3g} s, which steps of {step:g} s do not see: run.step must not be longer"
        raise InputError(file, key_path, None, allowed)
