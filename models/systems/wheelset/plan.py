"""The plan of a wheelset's scene: printed by ``twinrig show``, checked before any run."""

from models.core.assumptions import assumption_lines
from models.core.errors import InputError
from models.core.scene_effects import effect_lines as effect_lines
from models.rail.linear import critical_speed_or_reason, klingel_wavelength
from models.rail.wheelset import Wheelset
from models.systems.wheelset.assumptions import assumptions, linear_motion_assumptions
from models.systems.wheelset.conicity import check as check_conicity
from models.systems.wheelset.of_scene import equations_of, path_speeds, wheelset_of
from models.systems.wheelset.scene import ConicityTable, WheelsetScene

LAW_TEXTS = {"linear": "Kalker's linear theory, without bound", "fastsim": "FASTSIM, {} cells along each strip"}


def check(scene: WheelsetScene, engines: tuple[str, ...]) -> None:
    """Raise InputError, before any file is written, for conicity inputs that are no tables or profiles, for wheelsets
    that cannot rest on the rails, and for time steps that are too long.
    """
    check_conicity(scene)
    for speed in path_speeds(scene):
        equations = equations_of(scene, "reference", speed)
        try:
            equations.run(equations.rest, scene.run.step, scene.run.step)
        except InputError as error:
            raise InputError(scene.file, "run.step", scene.run.step, f"{error.allowed} at {speed:g} m/s") from None


def describe(scene: WheelsetScene) -> str:
    """Returns the plan of a wheelset scene as text: wheelset, contact, suspension, speeds, and what each engine
    builds.
    """
    wheelset = wheelset_of(scene)
    changed = ", ".join(f"{name} = {value:g}" for name, value in scene.wheelset.override.items())
    ellipse, run, speeds = wheelset.ellipse, scene.run, scene.speeds.all()
    critical, why = critical_speed_or_reason(wheelset)
    lines = {
        "scene": f"{scene.file}, study {scene.study}",
        "wheelset": scene.wheelset.parameters + (f", but {changed}" if changed else ""),
        "": f"{wheelset.mass:g} kg, {wheelset.load:g} N on both rails, 5 freedoms: lateral, vertical, roll, yaw, spin",
        "wheels": _wheels_text(wheelset),
        "contact": f"{LAW_TEXTS[scene.contact.law].format(scene.contact.cells)}; at rest a = {1e3 * ellipse.a:.3g} "
        f"mm, b = {1e3 * ellipse.b:.3g} mm; friction {wheelset.friction:g}",
        "flange": "that of the profile"
        if wheelset.profiles
        else f"after {1e3 * wheelset.flange_clearance:g} mm, {wheelset.flange_stiffness:g} N/m",
        "held by": _suspension_text(wheelset),
        "Klingel": f"wavelength {klingel_wavelength(wheelset):.5g} m",
        "critical": f"{critical:.5g} m/s by the linear theory of two motions"
        if critical
        else f"none: the wheelset {why}",
        "speeds": f"{len(speeds)} from {speeds.min():g} to {speeds.max():g} m/s",
        "paths": f"at {' and '.join(f'{speed:g}' for speed in path_speeds(scene))} m/s, {run.duration:g} s in "
        f"steps of {run.step:g} s, from {1e3 * run.displacement:g} mm and {run.yaw:g} rad",
    }
    if scene.conicity is not None:
        lines["conicity"] = _conicity_text(scene.conicity)
    lines_of_text = [f"  {head:<10} {text}" for head, text in lines.items()]
    return "\n".join([scene.title, *lines_of_text, *effect_lines(scene), *_assumption_lines(scene), "", *ENGINES])


def _assumption_lines(scene: WheelsetScene) -> list[str]:
    """Lines on the assumptions of paths and of eigenvalues."""
    equations = equations_of(scene, "reference", path_speeds(scene)[0])
    return assumption_lines([*assumptions(equations), *linear_motion_assumptions(equations.wheelset)])


def _wheels_text(wheelset: Wheelset) -> str:
    w, p = wheelset, wheelset.profiles
    cones = f"cones of conicity {w.conicity:g}, radius {w.radius:g} m, on heads of radius {w.head_radius:g} m"
    if p is None:
        return cones
    rails = f"{p.rail} inclined by {p.inclination:g} rad, gauge {p.gauge:g} m"
    return f"{p.wheel} of radius {w.radius:g} m on {rails}; closed forms for {cones}"


def _conicity_text(conicity_table: ConicityTable) -> str:
    amplitudes = ", ".join(f"{1e3 * amplitude:g}" for amplitude in conicity_table.amplitudes)
    source_text = f"of {conicity_table.table}" if conicity_table.table else "of these wheels"
    return f"{source_text}, at amplitudes of {amplitudes} mm, by EN 15302 and by the first harmonic"


def _suspension_text(wheelset: Wheelset) -> str:
    """Text on the suspension: spring stiffness and damping of one side along each axis."""
    w = wheelset
    sizes = ((axis, getattr(w, f"stiffness_{axis}"), getattr(w, f"damping_{axis}")) for axis in "xyz")
    parts = [f"{axis} {spring:g} N/m and {damper:g} N s/m" for axis, spring, damper in sizes if spring or damper]
    return f"on each side, {w.half_spacing:g} m from the middle: {', '.join(parts)}" if parts else "nothing: it is free"


ENGINES = (
    "  reference  the equations written out, compiled, RK4",
    "  exudyn     a kinematic tree of 5 links, native springs and dampers, both rails by one user function, RK44",
    "  mujoco     one body of 5 joints, springs and dampers as actuators, both rails by one native callback, RK4",
)
"""Lines of text on how the reference, Exudyn and MuJoCo each build the wheelset."""
