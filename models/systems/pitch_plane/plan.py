"""The plan of a pitch-plane scene: printed by ``twinrig show``, checked before any run."""

from models.core.assumptions import assumption_lines
from models.core.errors import Refused
from models.core.finding import Finding
from models.core.scene_effects import effect_lines as effect_lines
from models.core.scene_effects import effect_of
from models.core.systems import DEFAULT_SYSTEM
from models.engines.assembly import Assembly
from models.engines.catalogue import CATALOGUE
from models.engines.protocol import build
from models.engines.protocol import check_assembly as check_engine
from models.systems.pitch_plane.assumptions import assumptions
from models.systems.pitch_plane.scene import Scene, assembly_of_scene, settings_of
from models.vehicles.pitch_plane import STATE_NAMES
from models.vehicles.plausible_plane import implausible_plane_values

MODE_TEXTS = {
    "free": "free motion on the flat road",
    "road": "excited by a road (eq. 38)",
    "force": "excited by wheel forces in the inertial frame (eq. 37)",
    "force-body": "excited by wheel forces in the chassis' frame",
    "pitch": "excited by wheel forces, pitch prescribed (eq. 39)",
    "heave-pitch": "excited by wheel forces, heave and pitch of the chassis prescribed",
}


def check(scene: Scene, engines: tuple[str, ...]) -> None:
    """Raise InputError or Refused, before any file is written, for a scene that cannot be assembled or an engine that
    cannot run it.
    """
    assembly = assembly_of_scene(scene)
    for engine in engines:
        try:
            check_engine(engine, assembly, settings_of(scene, engine))
        except Refused as error:
            raise Refused(error.engine, error.why, scene.file) from None


def findings(scene: Scene) -> tuple[Finding, ...]:
    """Returns doubts about implausible parameters of the vehicle, and about wheel forces and prescribed motions."""
    doubts = (Finding("input", "doubt", scene.file, text) for text in assembly_of_scene(scene).doubts)
    return (*implausible_plane_values(scene.vehicle_parameters(), scene.vehicle.accept), *doubts)


def describe(scene: Scene) -> str:
    """Returns the plan of a pitch-plane scene as text: vehicle, states, effects, channels, assumptions, and what each
    engine builds.
    """
    assembly = assembly_of_scene(scene)
    lines = [scene.title, _plan_line("scene", f"{scene.file}, study {scene.study}")]
    motion = f"{MODE_TEXTS[assembly.mode]}, geometry {scene.vehicle.geometry}, {scene.run.duration:g} s"
    lines += [_plan_line("motion", motion)]
    lines += _vehicle_lines(scene, assembly) + effect_lines(scene)
    lines += [
        _plan_line("channels", ", ".join(_channel_lines(assembly))),
        *trust_line(assembly),
        *doubt_lines(assembly),
    ]
    lines += [*assumption_lines(assumptions(assembly)), "", *_engine_table(scene, assembly)]
    return "\n".join(lines)


def _plan_line(label: str, text: str) -> str:
    return f"  {label:<10} {text}"


def _vehicle_lines(scene: Scene, vehicle_assembly: Assembly) -> list[str]:
    """Lines of text on the parameter set, the bodies, the struts, the pitch springs and the initial state."""
    scene_vehicle, vehicle = scene.vehicle, vehicle_assembly.vehicle
    changed = ", ".join(f"{name} = {value:g}" for name, value in scene_vehicle.override.items())
    lines = [_plan_line("vehicle", scene_vehicle.parameters + (f", but {changed}" if changed else ""))]
    for body in vehicle.bodies:
        inertia = "" if body.pitch_inertia is None else f", {body.pitch_inertia:g} kg m^2"
        lines.append(_plan_line("  body", f"{body.name:<12} {body.mass:g} kg{inertia}"))
    for strut in vehicle.struts:
        ends = f"{strut.upper.body} - {strut.lower.body or 'ground'}"
        pushes = ", only pushes" if strut.pushes_only else ""
        text = f"{strut.name:<12} {strut.stiffness:g} N/m, {strut.damping:g} N s/m, {ends}{pushes}"
        lines.append(_plan_line("  strut", text))
    for spring in vehicle.pitch_springs:
        band = f", beyond {spring.dead_band:g} rad" if spring.dead_band else ""
        text = f"{spring.body:<12} {spring.stiffness:g} N m/rad, {spring.damping:g} N m s/rad, to the ground{band}"
        lines.append(_plan_line("  spring", text))
    values = zip(STATE_NAMES, vehicle_assembly.initial, strict=True)
    start = ", ".join(f"{name} {value:.4g}" for name, value in values if value)
    return [*lines, _plan_line("states", ", ".join(STATE_NAMES)), _plan_line("start", start or "all zero")]


def _channel_lines(vehicle_assembly: Assembly) -> list[str]:
    names = ["states", "f1", "f2", "f3", "f4", "suspension_moment"]
    names += ["zeta1", "zeta2"] if vehicle_assembly.mode == "road" else []
    names += ["enforced_force"] if vehicle_assembly.mode == "heave-pitch" else []
    names += ["inertia_term", "enforced_moment"] if vehicle_assembly.guided else []
    return names + [
        channel for name in vehicle_assembly.scene.effects for channel in effect_of(DEFAULT_SYSTEM, name).CHANNELS
    ]


def trust_line(vehicle_assembly: Assembly) -> list[str]:
    """Line of text on how long the pitch of a force-excited run can be trusted; none on a road or with prescribed
    pitch.
    """
    if vehicle_assembly.mode not in ("force", "force-body"):
        return []
    from models.systems.pitch_plane.trust import predict_trust

    limit = predict_trust(vehicle_assembly)
    if limit is None:
        return []
    if limit.until is None and vehicle_assembly.doubts:
        return [_plan_line("trust", f"only as far as the doubts about the wheel forces allow; {limit.unchecked_text}")]
    return [_plan_line("trust", str(limit))]


def doubt_lines(vehicle_assembly: Assembly) -> list[str]:
    """Lines of text with the doubts about a scene's inputs."""
    return [_plan_line("doubt", text) for text in vehicle_assembly.doubts]


TABLE_HEADINGS = ("engine", "integrator", "order", "step", "steps", "freedoms", "native items", "callbacks")


def _engine_table(scene: Scene, vehicle_assembly: Assembly) -> list[str]:
    """Lines of a text table on what each engine builds, or why it refuses the scene."""
    rows = [TABLE_HEADINGS, *(_engine_row(scene, vehicle_assembly, engine) for engine in CATALOGUE)]
    widths = [max(len(row[i]) for row in rows if len(row) > 2) for i in range(len(TABLE_HEADINGS))]
    padded = [[cell.ljust(width) for cell, width in zip(row, widths, strict=False)] for row in rows]
    note = ["  exudyn is handed M, D and K of the linear vehicle: no spring of its own takes part"]
    return ["  " + "  ".join(row).rstrip() for row in padded] + (note if scene.vehicle.geometry == "linear" else [])


def _engine_row(scene: Scene, vehicle_assembly: Assembly, engine: str) -> tuple[str, ...]:
    settings = settings_of(scene, engine)
    try:
        plan = build(engine, vehicle_assembly, settings).plan()
    except Refused as error:
        return engine, f"refused: {error.why}"
    order = CATALOGUE[engine][settings.integrator].order
    return (
        engine,
        settings.integrator,
        str(order),
        f"{settings.step:g} s",
        str(settings.steps),
        *(str(plan[key]) for key in ("degrees of freedom", "native items", "callbacks")),
    )
