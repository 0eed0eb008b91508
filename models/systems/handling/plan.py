"""The plan of a scene of handling: printed by ``twinrig show``, checked before any run."""

from models.core.assumptions import assumption_lines
from models.core.finding import Finding
from models.core.scene_effects import effect_lines as effect_lines
from models.engines.error_control import plan_lines
from models.engines.free_vehicle import ENGINES, native_share
from models.engines.towed_springs import towed_division
from models.multibody.numbers import Handling
from models.systems.handling.assumptions import assumptions
from models.systems.handling.scene import CONTROL_LIMITS, HandlingScene
from models.vehicles.plausible import implausible_values
from models.vehicles.towing import hitch_line


def check(scene: HandlingScene, engines: tuple[str, ...]) -> None:
    """Raise InputError, before any file is written, for vehicles, tyres or roads that cannot be built."""
    for name in scene.manoeuvres:
        scene.model_with_scene_controls(name)


def findings(scene: HandlingScene) -> tuple[Finding, ...]:
    """Returns doubts about implausible parameters of the vehicle, except parameters that the scene accepts."""
    return implausible_values(scene.model_with_scene_controls(next(iter(scene.manoeuvres))).given, scene.vehicle.accept)


def describe(scene: HandlingScene) -> str:
    """Returns the plan of a handling scene as text: vehicle, tyres, road, manoeuvres, engines, effects, assumptions."""
    first = scene.model_with_scene_controls(next(iter(scene.manoeuvres)))
    tyres, free = scene.tyres, first.vehicle
    loads = ", ".join(f"{name} {load:.0f} N" for name, load in first.held.tyres.items())
    mass = sum(body.mass for body in free.bodies)
    lines = [
        scene.title,
        _plan_line("scene", f"{scene.file}, study {scene.study}"),
        _plan_line(
            "vehicle",
            f"{free.name}: {len(free.coordinates())} freedoms on a carrier that turns through any angle, {mass:.6g} kg",
        ),
        *(_plan_line("trailer", hitch_line(free, first.held, name)) for name in free.towed),
        _plan_line("tyres", f"brushes of {tyres.cells} cells per strip, mu = {tyres.friction:g}; static loads {loads}"),
        _plan_line(
            "road",
            f"ISO 8608 class {scene.road.iso8608}, {scene.road.waves} plane waves, where a manoeuvre is "
            "rough, else flat",
        ),
        *(_plan_line("read", note) for note in first.given.notes),
        *(_plan_line(name, _manoeuvre_text(scene, name)) for name in scene.manoeuvres),
        _plan_line("run", f"Runge-Kutta 4, {scene.run.step:g} s, in both engines around the same compiled forces"),
        *(_plan_line(*line) for line in plan_lines(scene.engines, scene.run.step)),
        *(_plan_line(*line) for line in _native_shares(first)),
        _plan_line("shared", "tyres, bristles, driver's controls and the road: no engine has them"),
        _plan_line("reference", "plain equations that share no force with them, where --engine reference asks for it"),
    ]
    never = "compliance of the carcass, roll and pitch of wheels, steering system"
    assumed = assumption_lines(assumptions(first), 18)
    return "\n".join([*lines, *effect_lines(scene, 18), *assumed, _plan_line("never", never)])


def _native_shares(handling_model: Handling) -> list[tuple[str, str]]:
    """Lines (heading, text) on the springs that each engine computes by native elements, and on why other springs are
    computed by compiled forces.
    """
    divisions = {engine: towed_division(handling_model, engine) for engine in ENGINES}
    native = {engine: division.native for engine, division in divisions.items()}
    reasons = [
        ("shared", f"{engine}: {name}: {why}")
        for engine, division in divisions.items()
        for name, why in division.reasons.items()
    ]
    return [*native_share(handling_model.vehicle, native), *reasons]


def _manoeuvre_text(scene: HandlingScene, manoeuvre_name: str) -> str:
    manoeuvre = scene.manoeuvres[manoeuvre_name]
    if manoeuvre.measured:
        return f"{manoeuvre.duration:g} s along the measured steer angle and speed of {manoeuvre.measured}"
    acts = [control for control in CONTROL_LIMITS if any(value for _, value in getattr(manoeuvre, control))]
    return f"{manoeuvre.speed:g} m/s, {manoeuvre.duration:g} s, {' and '.join(acts) or 'nothing'} by the driver"


def _plan_line(label: str, text: str) -> str:
    return f"  {label:<18} {text}"
