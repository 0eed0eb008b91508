"""Vehicle, road, tyres, brakes and controller of a braking scene."""

import math
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from models.brake.brake import Brake, brakes_of_wheels
from models.brake.controller import Controller
from models.brake.controllers import CONTROLLERS
from models.brake.plane_vehicle import GRAVITY, PAPER_TRUCK, PlaneVehicle, Truck, plane_of_truck
from models.brake.pressure import BrakeChambers
from models.brake.surfaces import RoadStretch as NumberedStretch
from models.brake.surfaces import RoadSurfaces, road_of_stretches
from models.brake.trailer import plane_of_train
from models.core.errors import InputError
from models.core.scene_effects import extended_by_effects
from models.core.scene_file import parse_toml
from models.core.strict import read
from models.systems.braking.march import BrakedVehicle, braked_vehicle_on_tyres
from models.systems.braking.measured_pressures import MeasuredPressures, read_pressures
from models.systems.braking.scene import (
    LARGEST_SUBSTEP_COUNT,
    AxleBrakeTable,
    BrakingProcedure,
    BrakingScene,
    RoadStretch,
)
from models.tyre.tyre_source import SCALE_BOUNDS, SURFACE_NAMES, table_from_file, table_of_named_tyre
from models.tyre.tyre_table import TyreTable

SPRUNG_ENGINE = "mujoco"
"""Engine of a vehicle on its suspension where the user names none."""


def braked_vehicle(scene: BrakingScene, procedure: BrakingProcedure) -> BrakedVehicle:
    """Build the scene's vehicle with its brakes on the road of a procedure. Raises InputError for inconsistent
    parts.
    """
    plane, known = plane_of(scene), (*SURFACE_NAMES, *scene.tyres.files)
    for name, scale in scene.tyres.scale.items():
        if name not in known:
            raise InputError(scene.file, f"tyres.scale.{name}", scale, "no such surface", known)
    names, kinds, lags = surfaces_of(scene, procedure), tyre_kinds_of(scene), scene.relaxation
    front, rear, behind = (brake_of(scene, axle) for axle in ("front", "rear", "trailer"))
    sprung = None if scene.vehicle.file is None else sprung_of(scene)
    engine = None if sprung is None else suspended_in_engine(SPRUNG_ENGINE, sprung)
    if engine is not None:
        engine.check_step(scene.run.sample / scene.run.substeps)
    on_front_unit = np.arange(plane.wheels) < 2
    vehicle = braked_vehicle_on_tyres(
        plane,
        [tyre_table_of(scene, name, kind) for name in names for kind in kinds],
        brakes_of_wheels(front, front, rear, rear, *[behind] * (plane.wheels - 4)),
        chambers_of(scene, plane.wheels),
        road_of(scene, procedure, names),
        kind=np.where(on_front_unit, 0, len(kinds) - 1),
        substeps=scene.run.substeps,
        sample=scene.run.sample,
        speed_given=scene.controller.true_speed,
        relaxation=None if lags is None else np.where(on_front_unit, lags.front, lags.rear),
        sprung=sprung,
        engine=engine,
    )
    if lags is not None:
        _check_lags(scene, vehicle, min(lags.front, lags.rear))
    return extended_by_effects(vehicle, scene)


def _check_lags(scene: BrakingScene, vehicle: BrakedVehicle, shortest_relaxation_length: float) -> None:
    """Raise InputError for time steps so long that the vehicle at rest would start to rock on its tyres.
    ``shortest_relaxation_length`` : shortest relaxation length (m).
    """
    from models.brake.relaxation import longest_stable_step

    lively = GRAVITY if vehicle.engine is None else vehicle.engine.liveliness
    longest = longest_stable_step(vehicle.slope, lively, shortest_relaxation_length)
    if vehicle.sample / vehicle.substeps > longest:
        least_substeps = math.ceil(vehicle.sample / longest)
        if least_substeps > LARGEST_SUBSTEP_COUNT:
            length = (
                shortest_relaxation_length * (vehicle.sample / (LARGEST_SUBSTEP_COUNT * longest)) ** 2
            )  # longest goes with its root
            allowed = (
                f"must be at least {1.01 * length:.2g} m: shorter ones need more than {LARGEST_SUBSTEP_COUNT} substeps"
            )
            raise InputError(scene.file, "relaxation", shortest_relaxation_length, allowed)
        allowed = f"must be at least {least_substeps}: at rest the vehicle rocks up on tyres of so short a [relaxation]"
        raise InputError(scene.file, "run.substeps", vehicle.substeps, allowed)


def plane_of(scene: BrakingScene) -> PlaneVehicle:
    """Returns the plane model of the truck, of truck and trailer, or of a vehicle on its suspension with what it
    tows.
    """
    transfer = scene.load_transfer is not None
    if scene.vehicle.file is not None:
        plane: PlaneVehicle = sprung_of(scene).in_plane(transfer)
        return plane
    vehicle = vehicle_of(scene)
    try:
        return (
            plane_of_truck(vehicle, transfer)
            if scene.trailer is None
            else plane_of_train(vehicle, scene.trailer, transfer)
        )
    except InputError as error:
        raise InputError(scene.file, f"vehicle or trailer: {error.place}", error.value, error.allowed) from None


def spatial_vehicle_of(scene: BrakingScene) -> Any:
    """Returns the vehicle of vehicle.file with what it tows, a ``SpatialVehicle``; None where the scene has no such
    file.
    """
    from models.own_model.scene_vehicle import scene_vehicle

    name = scene.vehicle.file
    return None if name is None else scene_vehicle(name, scene.folder, scene.file, "vehicle.file", allows_towing=True)


def sprung_of(scene: BrakingScene) -> Any:
    """Returns the scene's vehicle on its suspension, a ``models.brake.sprung.SprungVehicle``; raises InputError."""
    from models.brake.sprung import suspended_vehicle

    return suspended_vehicle(
        spatial_vehicle_of(scene), float(scene.vehicle.spin_inertia or 0.0), trailer_spring_code=scene.run.forces
    )


def suspended_in_engine(engine: str, vehicle: Any) -> Any:
    """Builds a vehicle on its suspension in "exudyn" or "mujoco", or by the independent reference."""
    if engine == "reference":
        from models.engines.braking_sprung_plain import PlainSprungVehicle

        return PlainSprungVehicle(vehicle)
    from models.engines.braking_sprung import EngineSprungVehicle

    return EngineSprungVehicle(engine, vehicle)


def vehicle_of(scene: BrakingScene) -> Truck:
    """Returns the parameters of the scene's vehicle, with the scene's overrides; for a vehicle on its suspension the
    parameters of its plane model.
    """
    if scene.vehicle.file is not None:
        plane: Truck = sprung_of(scene).plane
        return plane
    name, file = scene.vehicle.parameters, scene.file
    if name.endswith(".toml"):
        path = scene.path(name, "vehicle.parameters")
        table, file = parse_toml(path), path.name
        vehicle = read(Truck, table, file)
    elif name == "paper":
        vehicle = PAPER_TRUCK
    else:
        raise InputError(file, "vehicle.parameters", name, "no such set; a file of your own ends in .toml", ("paper",))
    if scene.vehicle.override:
        changed = merged_tables(vehicle.model_dump(), scene.vehicle.override)
        vehicle = read(Truck, changed, scene.file, "vehicle.override")
    if scene.load_transfer is not None and "front" in scene.load_transfer.model_fields_set:
        share = scene.load_transfer.front
        parts = {"front": {"roll_share": share}, "rear": {"roll_share": 1.0 - share}}
        vehicle = Truck(**merged_tables(vehicle.model_dump(), parts))
    return vehicle


def merged_tables(base_tables: Mapping[str, Any], changed_values: Mapping[str, Any]) -> dict[str, Any]:
    """Returns nested tables with some of their values changed; a table that gives another ``kind`` replaces the old
    table.
    """
    new = dict(base_tables)
    for key, value in changed_values.items():
        old = base_tables.get(key)
        are_tables = isinstance(old, Mapping) and isinstance(value, Mapping) and "kind" not in value
        new[key] = merged_tables(old, value) if are_tables else value  # type: ignore[arg-type]
    return new


def surfaces_of_stretch(procedure: BrakingProcedure, stretch: RoadStretch) -> tuple[str, str]:
    """Names of the surfaces left and right of the line on a stretch; a split procedure may name the right surface."""
    return stretch.left, procedure.right or stretch.right or stretch.left


def surfaces_of(scene: BrakingScene, procedure: BrakingProcedure) -> list[str]:
    """Names of all surfaces of the road of a procedure, without repetition."""
    return list(
        dict.fromkeys(name for stretch in scene.road.stretches for name in surfaces_of_stretch(procedure, stretch))
    )


def road_of(scene: BrakingScene, procedure: BrakingProcedure, surface_names: list[str]) -> RoadSurfaces:
    """Returns the road of a procedure, with surfaces numbered by their index in ``surface_names``."""
    stretches = [
        NumberedStretch(s.x, *(surface_names.index(name) for name in surfaces_of_stretch(procedure, s)))
        for s in scene.road.stretches
    ]
    try:
        return road_of_stretches(stretches, scene.road.line, len(tyre_kinds_of(scene)))
    except InputError as error:
        raise InputError(scene.file, "road.stretches", error.value, error.allowed) from None


def tyre_kinds_of(scene: BrakingScene) -> tuple[bool, ...]:
    """Kinds of tyres in use: False for the front tyre and, if the rear wheels have another tyre, True for the rear
    tyre.
    """
    return (False, True) if scene.tyres.own_rear else (False,)


def tyre_table_of(scene: BrakingScene, surface_name: str, for_rear_tyre: bool = False) -> TyreTable:
    """Returns the tyre table (friction over slip) of a surface, from a file of the scene if it names one, scaled as in
    [tyres].
    """
    scale = scene.tyres.scale.get(surface_name, 1.0)
    if not SCALE_BOUNDS[0] < scale <= SCALE_BOUNDS[1]:
        raise InputError(scene.file, f"tyres.scale.{surface_name}", scale, "must be above 0 and at most 2")
    if surface_name in scene.tyres.files:
        table = table_from_file(scene.path(scene.tyres.files[surface_name], f"tyres.files.{surface_name}"))
    elif surface_name in SURFACE_NAMES:
        table = table_of_named_tyre(surface_name, for_rear_tyre)
    else:
        raise InputError(
            scene.file, "road.stretches", surface_name, "no such surface", (*SURFACE_NAMES, *scene.tyres.files)
        )
    return table if scale == 1.0 else table.scaled(scale)


def tyre_tables_of(scene: BrakingScene) -> dict[str, TyreTable]:
    """Returns the tyre tables of all surfaces under all procedures, by name; a different rear tyre has the name
    SURFACE/rear.
    """
    names = dict.fromkeys(name for procedure in scene.procedures.values() for name in surfaces_of(scene, procedure))
    return {
        f"{name}/rear" if rear else name: tyre_table_of(scene, name, rear)
        for name in names
        for rear in tyre_kinds_of(scene)
    }


def brake_of(scene: BrakingScene, axle_name: str) -> Brake:
    """Returns the law of torque over pressure of the brakes of "front", "rear" or "trailer"."""
    brake: AxleBrakeTable = getattr(scene.brakes, axle_name)
    return read(
        Brake,
        {
            "push_out": brake.push_out,
            "release": brake.push_out if brake.release is None else brake.release,
            "rising": brake.gradient,
            "falling": brake.gradient if brake.falling is None else brake.falling,
        },
        scene.file,
        f"brakes.{axle_name}",
    )


def chambers_of(scene: BrakingScene, wheel_count: int) -> BrakeChambers:
    """Returns the brake chambers of all wheels; without [pressure] their time constants are zero."""
    pressure, zeros = scene.pressure, np.zeros(wheel_count)
    if pressure is None:
        return BrakeChambers(zeros, zeros, scene.brakes.supply)
    chambers = BrakeChambers(zeros + pressure.fill, zeros + pressure.empty, scene.brakes.supply, delay=pressure.delay)
    chambers = chambers if pressure.slow is None else chambers._replace(slow=zeros + pressure.slow)
    return (
        chambers
        if pressure.reservoir is None
        else chambers._replace(volumes=zeros + pressure.volume, reservoir=pressure.reservoir)
    )


def measured_pressures_of(scene: BrakingScene, procedure_name: str, wheel_count: int) -> MeasuredPressures | None:
    """Reads the measured pressures of a procedure; None if the scene has no [measured]."""
    if scene.measured is None:
        return None
    name = scene.measured.file.replace("{procedure}", procedure_name)
    measured = read_pressures(scene.path(name, "measured.file"), wheel_count, scene.run.sample)
    largest_pressure, supply = float(measured.pressures.max()), scene.brakes.supply
    if largest_pressure > supply:
        allowed = f"must be at least {largest_pressure:g} bar, the largest pressure in {name}"
        raise InputError(scene.file, "brakes.supply", supply, allowed)
    return measured


def controller_of(scene: BrakingScene, wheel_count: int, procedure_name: str) -> Controller:
    """Returns the controller of a procedure's run: measured pressures, or a new controller of the scene."""
    measured = measured_pressures_of(scene, procedure_name, wheel_count)
    if measured is not None:
        return measured
    kind = scene.controller.kind
    if kind not in CONTROLLERS:
        raise InputError(scene.file, "controller.kind", kind, "no such controller", tuple(CONTROLLERS))
    make, parameters = CONTROLLERS[kind], scene.controller.parameters
    known = tuple(field.name for field in fields(make) if field.name not in ("wheels", "period"))
    for name, value in parameters.items():
        if name not in known:
            raise InputError(scene.file, f"controller.parameters.{name}", value, f"no parameter of {kind}", known)
    if parameters.get("slow") is True and (scene.pressure is None or scene.pressure.slow is None):
        allowed = "needs valves that can apply slowly: pressure.slow"
        raise InputError(scene.file, "controller.parameters.slow", True, allowed)
    period = {"period": scene.run.sample} if kind != "none" else {}
    try:
        return make(wheel_count, **parameters, **period)
    except InputError as error:
        raise InputError(scene.file, error.place, error.value, error.allowed) from None
    except TypeError:
        raise InputError(scene.file, "controller.parameters", parameters, "must be numbers") from None
