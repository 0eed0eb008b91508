"""The plan of a scene of a wheelset at prescribed lateral displacements: printed by ``twinrig show``, checked before
any run.
"""

from models.core.assumptions import assumption_lines
from models.systems.wheel_rail.assumptions import assumptions
from models.systems.wheel_rail.scene import WheelRailScene


def check(scene: WheelRailScene, engines: tuple[str, ...]) -> None:
    """Raise InputError, before any file is written, for profile files that contain no profile, and for bodies that are
    too unlike for a theory of friction (``MaterialPair.require_likeness``).
    """
    for case in scene.cases.values():
        material_pair = scene.contact(case).material_pair
        if case.friction:
            material_pair.require_likeness(scene.file)


def describe(scene: WheelRailScene) -> str:
    """Returns the plan of the scene as text: profiles, track, wheelset, positions, cases, assumptions."""
    p, w, positions = scene.profiles, scene.wheelset, scene.positions
    lines = {
        "scene": f"{scene.file}, study {scene.study}",
        "wheel": f"{p.wheel}, radius {1e3 * w.radius:g} mm, backs {1e3 * p.back_to_back:g} mm apart, taping line "
        f"{1e3 * p.taping:g} mm from a back",
        "rail": f"{p.rail}, turned by {p.inclination:g} rad, gauge {1e3 * p.gauge:g} mm at "
        f"{1e3 * p.gauge_depth:g} mm below the top",
        "wheelset": f"{w.load / 1e3:g} kN on each wheel, {w.speed:g} m/s",
        "positions": f"{positions.count} from {1e3 * positions.start:g} to {1e3 * positions.stop:g} mm to the right",
    }
    cases = ((name, case_text(case.yaw, case.friction)) for name, case in scene.cases.items())
    lines_of_text = [f"  {head:<10} {text}" for head, text in (*lines.items(), *cases)]
    rolling = max(case.friction for case in scene.cases.values())
    return "\n".join([scene.title, *lines_of_text, *assumption_lines(assumptions(scene, rolling))])


def case_text(yaw_per_metre: float, friction: float) -> str:
    """Text on a case: its yaw, and whether the wheelset rolls with friction or is only pressed on the rails.

    yaw_per_metre : mrad per mm of lateral displacement; friction : coefficient.
    """
    yaw_text = f"yaw {yaw_per_metre:g} mrad for each mm" if yaw_per_metre else "no yaw"
    return f"{yaw_text}, " + (f"rolling with friction {friction:g}" if friction else "pressed without friction")
