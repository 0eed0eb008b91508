"""The plan of a contact scene: printed by ``twinrig show``, checked before any run."""

from contextlib import suppress

from models.contact.limits import LARGEST_AXIS_SHARE
from models.core.assumptions import Assumption, assumption_lines
from models.core.errors import InputError, RunFailed
from models.core.finding import Finding
from models.core.scene_effects import effect_lines as effect_lines
from models.systems.contact.scene import ContactScene

THEORY_TEXTS = {
    "linear": "Kalker's linear theory: no slip, exact for small creepage",
    "fastsim": "Kalker's simplified theory on an ellipse (1982)",
    "simplified": "Kalker's simplified theory for an undeformed distance (1983)",
    "exact": "half-spaces with Coulomb friction, the theory that the others approximate",
}


def check(scene: ContactScene, engines: tuple[str, ...]) -> None:
    """Raise InputError for bodies that are too unlike for every theory (``MaterialPair.require_likeness``)."""
    scene.pair.require_likeness(scene.file)


def findings(scene: ContactScene) -> tuple[Finding, ...]:
    """Returns a doubt for every radius of curvature that is not large compared with the contact."""
    if scene.radii is None or scene.contact is None:
        return ()
    from models.systems.contact.run import hertzian_contact

    area = hertzian_contact(scene)
    doubts = list[Finding]()
    for name, radius in scene.radii:
        axis = float(area.a if name.endswith("x") else area.b)
        if radius is not None and axis > LARGEST_AXIS_SHARE * abs(radius):
            text = (
                f"radii.{name}: {radius:.4g} m, where the contact is {axis:.4g} m long to either side; its theory "
                f"needs radii of at least {axis / LARGEST_AXIS_SHARE:.3g} m. Radii are in m, loads in N."
            )
            doubts.append(Finding("size", "doubt", f"radii.{name}", text, radius, "m"))
    return tuple(doubts)


def describe(scene: ContactScene) -> str:
    """Returns the plan of a contact scene as text: bodies, geometry, load, friction, creepage, theory, assumptions."""
    bodies = {
        name: f"E = {body.E / 1e9:g} GPa, nu = {body.nu:g}, G = {body.G / 1e9:.4g} GPa" for name, body in scene.bodies
    }
    heads = {
        "scene": f"{scene.file}, study {scene.study}",
        **bodies,
        scene.geometry: _values_text(getattr(scene, scene.geometry)),
    }
    if scene.contact is not None:
        heads["contact"] = _values_text(scene.contact)
    if scene.falling_friction is not None:
        law = "by the speed of slip s: floor + (1 - floor) exp(-decay s) of it is left"
        heads["friction"] = f"{law}; {_values_text(scene.falling_friction)}"
    if scene.contact is not None:
        heads["creepage"] = _values_text(scene.creepage)
    if scene.sweep is not None:
        heads["sweep"] = _values_text(scene.sweep)
    method = _values_text(scene.method, {"name", *scene.method.unread_keys()})
    heads["theory"] = THEORY_TEXTS[scene.method.name] + (f"; {method}" if method else "")
    lines = [scene.title, *(f"  {head:<10} {text}" for head, text in heads.items()), *effect_lines(scene)]
    return "\n".join([*lines, *assumption_lines(_contact_assumptions(scene))])


def _contact_assumptions(scene: ContactScene) -> list[Assumption]:
    """Assumptions of the scene's contact; none where its normal problem has no solution."""
    from models.systems.contact.assumptions import assumptions, table_assumptions

    with suppress(InputError, RunFailed):
        if scene.cases is not None:
            return table_assumptions(scene.cases_file())
        from models.systems.contact.run import solved_contact

        return assumptions(scene, solved_contact(scene))
    return []


def _values_text(scene_table: object, omitted_keys: frozenset[str] | set[str] = frozenset()) -> str:
    """Text of a scene table: its keys, values and units, without keys that have no value."""
    model = type(scene_table)
    parts = []
    for name, value in scene_table:  # type: ignore[attr-defined]
        extra = model.model_fields[name].json_schema_extra  # type: ignore[attr-defined]
        unit = f" {extra['unit']}".rstrip() if isinstance(extra, dict) else ""
        if value is not None and name not in omitted_keys:
            parts.append(f"{name} = {value:g}{unit}" if isinstance(value, float) else f"{name} = {value}")
    return ", ".join(parts)
