"""What a scene of a bicycle will compute: printed by ``twinrig show``, checked before any run."""

from models.core.assumptions import assumption_lines
from models.core.errors import InputError
from models.core.scene_effects import check_effects
from models.core.scene_effects import effect_lines as effect_lines
from models.systems.bicycle.run import REFERENCE_ENGINE, bicycle_assumptions
from models.systems.bicycle.scene import BicycleScene


def check(scene: BicycleScene, engines: tuple[str, ...]) -> None:
    """Check the effects and parameters of a bicycle scene before any file is written; raises InputError."""
    check_effects(scene)
    if set(engines) != {REFERENCE_ENGINE}:
        try:
            scene.bicycle_on_tyres()
        except InputError as error:
            raise InputError(error.file or scene.bicycle.parameters, error.place, error.value, error.allowed) from None
    scene.whipple.eigenvalues(scene.run.speed, scene.control)


def _stability_text(scene: BicycleScene) -> str:
    """Text that says whether a small lean dies out or grows at the run's speed, by the linear equations."""
    speed = scene.run.speed
    growth = float(scene.whipple.eigenvalues(speed, scene.control).real.max())
    if growth <= 0.0:
        return f"at {speed:g} m/s a small lean dies out, by the linear equations"
    return (
        f"unstable at {speed:g} m/s: a small lean grows e-fold in {1.0 / growth:.3g} s, and the bicycle may fall over"
    )


def describe(scene: BicycleScene) -> str:
    """Returns the plan of a bicycle scene as text: bicycle, stability, run, tyres, engines, effects, assumptions."""
    bicycle, run, speeds, tyres = scene.whipple, scene.run, scene.speeds, scene.tyres
    rear, front = scene.bicycle_on_tyres().loads()
    critical = {"weave": bicycle.weave_speed, "capsize": bicycle.capsize_speed}
    speed_texts = ", ".join(f"{name} {'none' if v is None else f'{v:.6g} m/s'}" for name, v in critical.items())
    rows = {
        "scene": f"{scene.file}, study {scene.study}",
        "bicycle": f"{scene.bicycle.parameters}: wheelbase {bicycle.wheelbase:g} m, trail {bicycle.trail:g} m, "
        f"steering axis {bicycle.tilt:.4g} rad",
        "loads": f"{rear:.4g} N rear, {front:.4g} N front",
        "stable": f"without control from the weave speed to the capsize speed: {speed_texts}",
        "speeds": f"{speeds.count} from {speeds.start:g} to {speeds.stop:g} m/s, linear equations",
        "run": f"from {run.speed:g} m/s upright with a lean rate of {run.lean_rate:g} rad/s, {run.duration:g} s",
        "upright": _stability_text(scene),
        "tyres": f"brushes of {tyres.cells} cells per strip, {tyres.stiffness:g} times as stiff as {tyres.cornering:g} "
        f"of the load per rad and {tyres.vertical:g} N/m",
        "engines": f"bodies and joints, tyres and control by one compiled kernel, Runge-Kutta 4, {run.step:g} s",
        "reference": "plain equations, ideal rolling, DOP853, where --engine reference asks for it",
    }
    lines = [f"  {head:<10} {text}" for head, text in rows.items()]
    return "\n".join([scene.title, *lines, *effect_lines(scene), *assumption_lines(bicycle_assumptions(scene))])
