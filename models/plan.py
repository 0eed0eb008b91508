"""What a scene will compute: printed by ``twinrig show``, checked before any run."""

from importlib import import_module

from models.assembly import Assembly, assemble
from models.engines.catalogue import CATALOGUE
from models.engines.protocol import build, check as check_engine, settings_of
from models.errors import InputError
from models.scene import Scene

MODES = {
    "free": "free motion on the flat road",
    "road": "excited by a road (eq. 38)",
    "force": "excited by wheel forces in the inertial frame (eq. 37)",
    "force-body": "excited by wheel forces in the chassis' frame",
    "pitch": "excited by wheel forces, pitch prescribed (eq. 39)",
}


def check(scene: Scene, engines: tuple[str, ...]) -> None:
    """Everything that can be refused before a run is refused here, before any file is written."""
    assembly = assemble(scene)
    for engine in engines:
        check_engine(engine, assembly, settings_of(scene, engine))


def describe(scene: Scene) -> str:
    """The scene's plan as text: vehicle, states, effects, channels, and what each engine builds."""
    assembly = assemble(scene)
    lines = [scene.title, f"  {MODES[assembly.mode]}, geometry {scene.vehicle.geometry}, {scene.run.duration:g} s"]
    lines += _vehicle(assembly) + _effects(scene) + _engines(scene, assembly)
    return "\n".join(lines)


def _vehicle(assembly: Assembly) -> list[str]:
    vehicle = assembly.vehicle
    bodies = ", ".join(f"{body.name} {body.mass:g} kg" for body in vehicle.bodies)
    struts = ", ".join(f"{strut.name} {strut.stiffness:g} N/m {strut.damping:g} N s/m" for strut in vehicle.struts)
    states = ", ".join(f"{body} {kind}" for body, kind in vehicle.coordinates())
    return [f"  bodies    {bodies}", f"  struts    {struts}", f"  states    2 x ({states})",
            f"  channels  {', '.join(_channels(assembly))}"]


def _channels(assembly: Assembly) -> list[str]:
    names = ["states", "f1", "f2", "f3", "f4", "suspension_moment"]
    names += ["inertia_term", "enforced_moment"] if assembly.mode == "pitch" else []
    return names + [output.__name__ for output in assembly.outputs]


def _effects(scene: Scene) -> list[str]:
    """Effects that the scene names, with what each costs; all others are not imported."""
    if not scene.effects:
        return ["  effects   none"]
    return [f"  effect    {name}: {import_module(f'models.effects.{name}').COST}" for name in scene.effects]


def _engines(scene: Scene, assembly: Assembly) -> list[str]:
    lines = []
    for engine in CATALOGUE:
        settings = settings_of(scene, engine)
        head = f"  {engine:<10}{settings.integrator}, step {settings.step:g} s, {settings.steps} steps"
        try:
            plan = build(engine, assembly, settings).plan()
        except InputError as error:
            lines.append(f"{head}: refused: {error}")
            continue
        lines.append(f"{head}: " + ", ".join(f"{count} {what}" for what, count in plan.items()))
    return lines
