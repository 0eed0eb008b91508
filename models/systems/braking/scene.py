"""Scenes of braking: a vehicle, surfaces of the road, brakes, a controller in the loop, and test procedures."""

import math
from collections.abc import Iterator, Mapping
from itertools import chain, product
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from models.brake.controller import LARGEST_PRESSURE, SAMPLING_PERIOD
from models.brake.port.setup import PortTable
from models.brake.trailer import Trailer
from models.core.errors import InputError
from models.core.scene_effects import check_effects, read_tables
from models.core.scene_file import SceneFile, checked
from models.core.strict import Query, Strict, accepted_queries_field, quantity
from models.own_model.scene_vehicle import MJCF_EXTENSION

LARGEST_SPEED = 100.0
"""Largest speed (m/s) at which braking may begin; no road vehicle is faster."""
LARGEST_TORQUE = 1e6
"""Largest brake torque of a wheel (N m) that a scene may have: twenty times that of a real brake."""
LONGEST_TIME_STEP = 0.02
"""Longest time step (s) for which light braking and braking from rolling were compared with closed forms."""
LARGEST_SUBSTEP_COUNT = 1000
"""Most time steps within a sample of the controller."""
ProcedureKind = Literal["straight", "split", "turn", "j_turn"]


TimeAnglePair = Annotated[list[float], Field(min_length=2, max_length=2)]


class BrakedVehicleTable(Strict):
    """[vehicle]: parameters of a vehicle in the plane, or the file of a vehicle on its suspension."""

    parameters: str = Field(default="paper", description="paper, or a TOML file with every parameter")
    override: dict[str, Any] = Field(default_factory=dict, description="parameters that are changed")
    file: str | None = Field(
        default=None,
        description="in their place a vehicle on its suspension: one that comes "
        "with twinrig, as r19_free, a TOML file of your own or a car in MJCF",
    )
    spin_inertia: float | None = quantity("kg m^2", "of a wheel about its axle, which a TOML file lacks", default=None)
    accept: list[Query] = accepted_queries_field()


class LoadTransfer(Strict):
    """[load_transfer]: quasi-static load transfer by the accelerations of the body; without this table wheel loads are
    those at rest.
    """

    front: float = Field(default=0.3, ge=0.0, le=1.0, description="share of the front axle in that of cornering")


class RoadStretch(Strict):
    """[[road.stretches]]: surfaces of the road from x on, left and right of the line."""

    x: float = quantity("m", "where it begins; the first also holds before", default=0.0, signed=True)
    left: str = Field(description="surface left of the line")
    right: str | None = Field(default=None, description="surface right of it, if it is another one")


class BrakingRoadTable(Strict):
    """[road]: stretches along x, each with its surfaces left and right of a line."""

    stretches: list[RoadStretch] = Field(default=[RoadStretch(left="ice")], min_length=1, description="along the road")
    line: float = quantity("m", "y of the line between left and right", default=0.0, signed=True)


class SurfaceFrictionTable(Strict):
    """[tyres]: friction of tyres on the surfaces of the road."""

    scale: dict[str, float] = Field(default_factory=dict, description="factor on the friction of a surface")
    files: dict[str, str] = Field(default_factory=dict, description="CSV or .tir file of the friction on a surface")
    own_rear: bool = Field(default=False, description="rear tyres by their own figures, where a surface has them")


class AxleBrakeTable(Strict):
    """[brakes.front], [brakes.rear], [brakes.trailer]: torque of a wheel's brake over pressure, linear unless falling
    pressure has another line.
    """

    gradient: float = quantity("N m/bar", "of the torque while pressure rises")
    push_out: float = quantity("bar", "pressure above which torque rises from none", default=0.0, zero=True)
    release: float | None = quantity(
        "bar", "pressure at which a falling torque ends; push_out if not said", default=None, zero=True
    )
    falling: float | None = quantity(
        "N m/bar", "gradient while the pressure falls; without it, that of rising pressure", default=None
    )


class BrakesTable(Strict):
    """[brakes]: brakes of the front axle, the rear axle and the trailer's wheels, and the supply pressure."""

    front: AxleBrakeTable = AxleBrakeTable(gradient=1500.0)
    rear: AxleBrakeTable = AxleBrakeTable(gradient=1200.0)
    trailer: AxleBrakeTable = AxleBrakeTable(gradient=1200.0)
    supply: float = quantity("bar", "pressure at the valves", default=6.0)


class ChamberTable(Strict):
    """[pressure]: brake chambers that fill and empty with first-order lag; without this table pressures follow the
    valves at once.
    """

    fill: float = quantity("s", "time constant of filling", default=0.15)
    empty: float = quantity("s", "time constant of emptying", default=0.1)
    slow: float | None = quantity(
        "s",
        "time constant of filling by valves that can apply slowly, at least that of fill; without it no valve can",
        default=None,
    )
    delay: float = quantity("s", "of the valves", default=0.0, zero=True)
    reservoir: float | None = quantity(
        "l", "volume of the supply reservoir; without it the supply pressure is constant", default=None
    )
    volume: float = quantity("l", "of one chamber, which the reservoir fills", default=1.5)


class RelaxationLengths(Strict):
    """[relaxation]: relaxation lengths over which slip angles lag; without this table side forces build up at once."""

    front: float = quantity("m", "relaxation length across the front wheels")
    rear: float = quantity("m", "relaxation length across all others")


class ControllerTable(Strict):
    """[controller]: the brake controller in the loop, with parameters that the controller checks."""

    kind: str = Field(default="none", description="none, or the name of a controller")
    parameters: dict[str, Any] = Field(default_factory=dict, description="of the controller")
    true_speed: bool = Field(default=True, description="the vehicle's speed is given to it")


class MeasuredPressureTable(Strict):
    """[measured]: measured chamber pressures that brake the vehicle in place of a controller."""

    file: str = Field(description="CSV of them, and of wheel speeds if they were measured; {procedure} is its name")


class BrakingProcedure(Strict):
    """[procedures.NAME]: a test procedure: initial speed, and steering of the driver, positive to the left."""

    kind: ProcedureKind = Field(default="straight", description="straight, split, turn or j_turn")
    speed: float = quantity("m/s", "at which the brake is applied", default=11.11)
    right: str | None = Field(default=None, description="surface right of the line on every stretch (split)")
    steer: float | None = quantity("rad", "fixed angle of the front wheels (j_turn)", default=None, signed=True)
    steering: list[TimeAnglePair] | None = Field(
        default=None,
        min_length=1,
        description="angle of the front wheels by time in place of steer, linear between: [[s, rad], ...] (j_turn)",
    )
    radius: float | None = quantity("m", "of the steady circle before braking (turn)", default=None, signed=True)


class BrakingRunTable(Strict):
    """[run]: sample time of the controller, time steps within a sample, and duration."""

    sample: float = quantity("s", "time between two exchanges with the controller", default=SAMPLING_PERIOD)
    substeps: int = Field(default=4, ge=1, le=LARGEST_SUBSTEP_COUNT, description="steps of the vehicle within a sample")
    forces: Literal["native", "compiled"] = Field(
        default="native",
        description="springs of what vehicle.file tows: the engine's own as far as it has them, or compiled forces",
    )
    duration: float = quantity("s", "after which a run ends that does not stop", default=60.0)


class BrakingScene(SceneFile):
    """A scene of braking: all tables of its scene file. Tables that are effects are None where the scene does not have
    them.
    """

    system: Literal["braking"] = "braking"
    study: str = Field(default="braking", description="the study that runs the scene")
    vehicle: BrakedVehicleTable = BrakedVehicleTable()
    trailer: Trailer | None = Field(default=None, description="a drawbar trailer of two axles")
    load_transfer: LoadTransfer | None = Field(default=None, description="semi-static load transfer")
    road: BrakingRoadTable = BrakingRoadTable()
    tyres: SurfaceFrictionTable = SurfaceFrictionTable()
    relaxation: RelaxationLengths | None = Field(default=None, description="lag of the slip angles")
    brakes: BrakesTable = BrakesTable()
    pressure: ChamberTable | None = Field(default=None, description="dynamics of the chambers")
    controller: ControllerTable = ControllerTable()
    port: PortTable | None = Field(default=None, description="what stands behind the port, its signals and faults")
    measured: MeasuredPressureTable | None = Field(
        default=None, description="pressures that were measured, instead of a controller"
    )
    effects: dict[str, Any] = Field(default_factory=dict, description="effects of your own, a table each")
    procedures: dict[str, BrakingProcedure] = Field(min_length=1, description="driven one by one, a table each")
    run: BrakingRunTable = BrakingRunTable()


def build(scene_tables: Mapping[str, Any], scene_path: str = "", scene_folder: Path = Path()) -> BrakingScene:
    """Build a checked braking scene from the nested tables of a scene file. Raises InputError for unknown keys and for
    values outside their ranges.
    """
    scene = checked(BrakingScene, scene_tables, scene_path, scene_folder)
    parts = (_procedure_refusals, _vehicle_refusals, _brake_refusals, _run_refusals)
    for key_path, value, allowed in chain.from_iterable(refusals_of(scene) for refusals_of in parts):
        raise InputError(scene.file, key_path, value, allowed)
    check_effects(scene)
    return scene.model_copy(update={"effects": read_tables(scene.effects, scene.system, scene_path)})


KEYS_OF_PROCEDURE = {"straight": (), "split": ("right",), "turn": ("radius",), "j_turn": ("steer", "steering")}
"""Keys that each kind of procedure has besides its speed; exactly one of them is needed."""
LARGEST_STEER_ANGLE = 1.0
"""Largest steer angle (rad) of the front wheels in a scene."""
BrakingRefusals = Iterator[tuple[str, Any, str]]
"""Wrong keys of a scene, their values, and what is allowed there."""


def _procedure_refusals(scene: BrakingScene) -> BrakingRefusals:
    for name, procedure in scene.procedures.items():
        yield from ((f"procedures.{name}.{key}", *wrong) for key, *wrong in _refusals_of_procedure(procedure))


def _refusals_of_procedure(procedure: BrakingProcedure) -> BrakingRefusals:
    if procedure.speed > LARGEST_SPEED:
        yield "speed", procedure.speed, f"must be at most {LARGEST_SPEED:g} m/s"
    read = KEYS_OF_PROCEDURE[procedure.kind]
    named = [key for key in ("right", "steer", "steering", "radius") if getattr(procedure, key) is not None]
    for key in named:
        if key not in read:
            yield key, getattr(procedure, key), f"has no meaning for {procedure.kind}"
    if read and not named:
        yield read[0], None, f"is missing: {procedure.kind} needs {' or '.join(read)}"
    if len(named) > 1:
        yield named[1], None, f"has no meaning beside {named[0]}: leave one out"
    if procedure.steer is not None and abs(procedure.steer) > LARGEST_STEER_ANGLE:
        yield "steer", procedure.steer, f"must be at most {LARGEST_STEER_ANGLE:g} rad, of either sign"
    if procedure.steering is not None:
        knot_times, angles = np.array(procedure.steering, float).T
        if (np.diff(knot_times) <= 0.0).any() or knot_times[0] < 0.0:
            yield "steering", knot_times.tolist(), "times must rise from knot to knot, from 0 on, in s"
        if np.abs(angles).max() > LARGEST_STEER_ANGLE:
            yield "steering", angles.tolist(), f"angles must be at most {LARGEST_STEER_ANGLE:g} rad, of either sign"
    if procedure.radius is not None and abs(procedure.radius) < 10.0:
        yield "radius", procedure.radius, "must be at least 10 m, of either sign"


def _vehicle_refusals(scene: BrakingScene) -> BrakingRefusals:
    """Yields refusals of [vehicle] keys that repeat what vehicle.file defines, and of keys that have no meaning without
    this file.
    """
    vehicle = scene.vehicle
    if vehicle.file is None:
        if vehicle.spin_inertia is not None:
            yield "vehicle.spin_inertia", vehicle.spin_inertia, "has no meaning without vehicle.file"
        if scene.run.forces == "compiled":
            yield "run.forces", scene.run.forces, "has no meaning without vehicle.file: nothing has springs"
        return
    if vehicle.spin_inertia is None and not str(vehicle.file).endswith(MJCF_EXTENSION):
        yield "vehicle.spin_inertia", None, "is missing: a vehicle file does not say it"
    for key, named in (("parameters", "parameters" in vehicle.model_fields_set), ("override", vehicle.override)):
        if named:
            yield f"vehicle.{key}", None, "has no meaning beside vehicle.file, which says it all"


def _brake_refusals(scene: BrakingScene) -> BrakingRefusals:
    """Yields refusals of a supply pressure that no vehicle has, and of torques that no brake gives."""
    supply = scene.brakes.supply
    if supply > LARGEST_PRESSURE:
        yield "brakes.supply", supply, f"must be at most {LARGEST_PRESSURE:g} bar"
    torque_limit = (
        f"must be at most {LARGEST_TORQUE / supply:g} N m/bar: no brake gives more than {LARGEST_TORQUE:g} N m"
    )
    for axle, key in product(("front", "rear", "trailer"), ("gradient", "falling")):
        value = getattr(getattr(scene.brakes, axle), key) or 0.0
        if value * supply > LARGEST_TORQUE:
            yield f"brakes.{axle}.{key}", value, torque_limit


def _run_refusals(scene: BrakingScene) -> BrakingRefusals:
    run, pressure = scene.run, scene.pressure
    if not 1e-4 <= run.sample <= 0.1:
        yield "run.sample", run.sample, "must be from 0.0001 to 0.1 s"
    if run.sample / run.substeps > LONGEST_TIME_STEP * (1.0 + 1e-9):
        least_substeps = math.ceil(run.sample / LONGEST_TIME_STEP - 1e-9)
        longer = f"steps of more than {LONGEST_TIME_STEP:g} s mistake stopping distances by percents"
        yield "run.substeps", run.substeps, f"must be at least {least_substeps}: {longer}"
    if pressure is not None and pressure.delay > 1.0:
        yield "pressure.delay", pressure.delay, "must be at most 1 s"
    if pressure is not None and pressure.slow is not None and pressure.slow < pressure.fill:
        allowed = f"must be at least fill, {pressure.fill:g} s: it is that of filling slowly"
        yield "pressure.slow", pressure.slow, allowed
    if run.duration < 2.0 * run.sample:
        yield "run.duration", run.duration, f"must be at least {2.0 * run.sample:g} s, two samples"
    if run.duration > 1000.0:
        yield "run.duration", run.duration, "must be at most 1000 s"
