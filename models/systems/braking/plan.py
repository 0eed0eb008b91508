"""The plan of a scene of braking: printed by ``twinrig show``, checked before any run."""

from collections.abc import Iterator

from models.brake.plane_vehicle import Truck
from models.brake.port.setup import PORT_KEYS, check_port
from models.core.assumptions import Assumption, assumption_lines
from models.core.errors import InputError
from models.core.finding import Finding
from models.core.scene_effects import effect_lines as effect_lines
from models.systems.braking.assumptions import assumptions
from models.systems.braking.of_scene import braked_vehicle, controller_of, sprung_of, surfaces_of, vehicle_of
from models.systems.braking.procedures import engines_of, port_run_of, vehicle_and_start_state
from models.systems.braking.scene import BrakingScene
from models.tyre.tyre_source import SURFACE_NAMES
from models.vehicles.plausible import (
    LARGEST_HEIGHT,
    USUAL_GYRATION_RATIOS,
    USUAL_MASS,
    USUAL_TRACK,
    USUAL_WHEELBASE,
    implausible_values,
)

PROCEDURE_TEXTS = {
    "straight": "straight braking",
    "split": "straight braking on split friction, wheels straight ahead",
    "turn": "braking in a turn, steering fixed as on the steady circle before",
    "j_turn": "J-turn: the steering is turned as the brake is applied, at once or by time",
}


def check(scene: BrakingScene, engines: tuple[str, ...]) -> None:
    """Raise InputError, before any file is written, for wrong vehicles, brakes, tyres, roads, controllers or ports, and
    for circles that the tyres cannot hold.
    """
    _check_parts(scene, engines_of(scene, engines))
    for name in scene.procedures:
        vehicle_and_start_state(scene, name)


def _check_parts(scene: BrakingScene, engines: tuple[str, ...]) -> None:
    """Raise InputError for wrong tyres, brakes, road, controller or port; the vehicle is not simulated."""
    for name, procedure in scene.procedures.items():
        known = (*SURFACE_NAMES, *scene.tyres.files)
        if procedure.right is not None and procedure.right not in known:
            raise InputError(scene.file, f"procedures.{name}.right", procedure.right, "no such surface", known)
        vehicle = braked_vehicle(scene, procedure)
        controller_of(scene, vehicle.plane.wheels, name)
        if scene.port is not None:
            for engine in engines:
                check_port(scene.port, port_run_of(scene, name, vehicle, engine))
    if scene.port is not None and scene.port.log is not None:
        _check_log(scene, scene.port.log, len(engines))


def _check_log(scene: BrakingScene, log_template: str, engine_count: int) -> None:
    """Raise InputError for a name of the port's log under which several procedures or engines would write the same
    file.
    """
    drives = {"procedure": len(scene.procedures), "engine": engine_count}
    for key, several in drives.items():
        if several > 1 and f"{{{key}}}" not in log_template:
            allowed = f"must have {{{key}}} in it: {several} of them are driven, and each writes a log of its own"
            raise InputError(scene.file, "port.log", log_template, allowed)


def check_reference(scene: BrakingScene, engines: tuple[str, ...]) -> None:
    """Raise InputError for --engine without the reference, and for a log at the port, in studies of many runs by the
    reference.
    """
    if engines and "reference" not in engines:
        allowed = f"the study {scene.study!r} computes by the reference: leave it out"
        raise InputError("--engine", "", engines[0], allowed)
    if scene.port is not None and scene.port.log is not None:
        allowed = f"the study {scene.study!r} drives many times: leave the log out"
        raise InputError(scene.file, "port.log", scene.port.log, allowed)


def findings(scene: BrakingScene) -> tuple[Finding, ...]:
    """Returns doubts about implausible parameters of the vehicle, except parameters that the scene accepts."""
    if scene.vehicle.file is not None:
        return implausible_values(sprung_of(scene).handling.given, scene.vehicle.accept)
    return tuple(
        query for query in _implausible_parameters(vehicle_of(scene)) if query.check not in scene.vehicle.accept
    )


REMEDY_OF_QUERY = {"mass": "Masses are in kg", "size": "Lengths are in m", "inertia": "Inertias are in kg m^2"}
"""Advice for implausible parameters, by kind."""
USUAL_RADIUS_RANGE = 0.1, 1.5
"""Smallest and largest radius (m) of usual wheels."""


def _implausible_parameters(truck: Truck) -> Iterator[Finding]:
    """Yields doubts about implausible parameters of a vehicle in the plane."""
    gyration, span = (
        (truck.yaw_inertia / truck.mass) ** 0.5,
        tuple(g * truck.wheelbase for g in USUAL_GYRATION_RATIOS["rz"]),
    )
    looks = [
        ("mass", "mass", truck.mass, USUAL_MASS),
        ("size", "wheelbase", truck.wheelbase, USUAL_WHEELBASE),
        ("size", "height", truck.height, (0.0, LARGEST_HEIGHT)),
        ("inertia", "radius of gyration by yaw_inertia", gyration, span),
    ]
    for name, axle in (("front", truck.front), ("rear", truck.rear)):
        looks += [
            ("size", f"{name}.track", axle.track, USUAL_TRACK),
            ("size", f"{name}.radius", axle.radius, USUAL_RADIUS_RANGE),
        ]
    for check, parameter_name, value, usual in looks:
        if not usual[0] <= value <= usual[1]:
            unit = "kg" if check == "mass" else "m"
            bounds = f"{usual[0]:.3g} to {usual[1]:.3g} {unit}"
            text = f"{parameter_name}: {value:.4g} {unit}; usual are {bounds}. {REMEDY_OF_QUERY[check]}."
            yield Finding(check, "doubt", parameter_name, text, value, unit)


def describe(scene: BrakingScene) -> str:
    """Returns the plan of a braking scene as text: vehicle, brakes, controller, procedures, step, assumptions, effects.

    Raises InputError for inconsistent parts.
    """
    _check_parts(scene, engines_of(scene, ())[:1])
    vehicle, run, file = vehicle_of(scene), scene.run, scene.vehicle.file
    motion = "plane motion" if file is None else "suspension, roll and pitch"
    texts = {
        "scene": f"{scene.file}, study {scene.study}",
        "vehicle": f"{file or scene.vehicle.parameters}: {vehicle.mass:g} kg, {vehicle.yaw_inertia:g} kg m^2, "
        f"axles at {vehicle.front.x:g} and {vehicle.rear.x:g} m, wheels of {vehicle.front.radius:g} m; {motion}, "
        "wheels turn",
        "brakes": f"supply {scene.brakes.supply:g} bar",
        "controller": f"{controller_text(scene)}, every {1e3 * run.sample:g} ms",
    }
    lines = [_plan_line(*head_and_text) for head_and_text in texts.items()]
    for name, procedure in scene.procedures.items():
        names = ", ".join(surfaces_of(scene, procedure))
        lines.append(_plan_line(name, f"{PROCEDURE_TEXTS[procedure.kind]}, from {procedure.speed:g} m/s on {names}"))
    length = f"{1e3 * run.sample / run.substeps:g} ms, {run.substeps} to a sample"
    lines.append(_plan_line("step", f"{length}; order two, wheels exact within it"))
    if file is not None:
        lines += [_plan_line(*line) for line in (*_towed_body_lines(scene), *_native_and_other_forces(scene))]
    assumed = {
        assumption.says: assumption for name in scene.procedures for assumption in _assumptions_of_scene(scene, name)
    }
    return "\n".join([scene.title, *lines, *assumption_lines(assumed.values()), *effect_lines(scene)])


def _native_and_other_forces(scene: BrakingScene) -> list[tuple[str, str]]:
    """Lines (heading, text) on the forces of a suspended vehicle: computed by native elements of engines, shared by all
    engines, and computed independently by the reference.
    """
    from models.engines.free_vehicle import ENGINES, native_share
    from models.engines.towed_springs import towed_division

    handling = sprung_of(scene).handling
    divisions = {engine: towed_division(handling, engine) for engine in ENGINES}
    reasons_beside = [
        (engine, *name_and_reason)
        for engine, division in divisions.items()
        for name_and_reason in division.reasons.items()
    ]
    return [
        *(("read", note) for note in handling.vehicle.notes),
        *native_share(handling.vehicle, {engine: division.native for engine, division in divisions.items()}),
        *(("shared", f"{engine}: {name}: {why}") for engine, name, why in reasons_beside),
        ("shared", "tyres, wheels that turn, brakes and the road: no engine has them"),
        ("reference", "plain code that shares no force with them, where --engine reference asks for it"),
    ]


def _towed_body_lines(scene: BrakingScene) -> list[tuple[str, str]]:
    """Lines (heading, text) on the bodies that a suspended vehicle tows; hitch positions are measured forward from its
    centre of mass.
    """
    from models.vehicles.towing import hitch_line

    handling = sprung_of(scene).handling
    return [("trailer", hitch_line(handling.vehicle, handling.held, name)) for name in handling.vehicle.towed]


def _assumptions_of_scene(scene: BrakingScene, procedure_name: str) -> list[Assumption]:
    return assumptions(scene, procedure_name, braked_vehicle(scene, scene.procedures[procedure_name]))


def user_code(scene: BrakingScene) -> str:
    """Name of the user's code (callable, command or FMU) that a run of the scene executes, "" if there is none."""
    named = [key for key in ("callable", "command", "fmu") if getattr(scene.port, key, None) is not None]
    return f"{named[0]} {getattr(scene.port, named[0])}" if named else ""


def controller_text(scene: BrakingScene) -> str:
    """Text that names the scene's controller, what is connected to the port, or the file of measured pressures."""
    if scene.measured is not None:
        return f"measured pressures {scene.measured.file}"
    named = [] if scene.port is None else [key for key in PORT_KEYS if getattr(scene.port, key) is not None]
    return f"{named[0]} {getattr(scene.port, named[0])}" if named else scene.controller.kind


def _plan_line(label: str, text: str) -> str:
    return f"  {label:<10} {text}"
