"""From a scene to its contact, pressed, by the theory that it names."""

from typing import Literal

import numpy as np

from models.contact.hertz import Hertz, by_approach, by_axes, by_load
from models.contact.material import Pair
from models.contact.profile_files import read_profile
from models.contact.profiles import Profile
from models.contact.simplified_theory import NormalContact, press
from models.contact.standard_profiles import RAILS, WHEELS, built_in
from models.contact.theories import Contact, Exact, ExactOnEllipse, Fastsim, Linear, Motion, Simplified
from models.contact.undeformed_distance import quadratic
from models.contact.wheel_on_rail import Touch, Track, Wheelset, wheel_on_rail
from models.core.errors import InputError
from models.core.scene_effects import extended
from models.systems.contact.built import Built
from models.systems.contact.scene import ContactScene

BUILT_IN = {"wheel": WHEELS, "rail": RAILS}


def built_of(scene: ContactScene) -> Built:
    """What touches and how, with the scene's effects."""
    own = scene.contact
    assert own is not None
    kinds: tuple[Literal["wheel", "rail"], ...] = ("wheel", "rail") if scene.profiles is not None else ()
    profiles: dict[str, Profile] = {kind: _profile(scene, kind) for kind in kinds}
    return extended(Built(scene.pair, own.friction, own.load, own.approach, scene.falling_friction, profiles), scene)


def contact(scene: ContactScene) -> Contact:
    """The contact of a scene, pressed, by the theory that the scene names."""
    method, built = scene.method, built_of(scene)
    friction, pair = built.friction, built.pair
    if built.falling is not None and method.name != "fastsim":
        raise InputError(
            scene.file,
            "method.name",
            method.name,
            "has constant friction, and an effect of this scene makes it fall: use fastsim",
        )
    if scene.profiles is not None:
        places = touches(scene, built)
        pressed = press([touch.patch for touch in places], pair, load=built.load, approach=built.approach)
        return Simplified(pressed, friction) if method.name == "simplified" else Exact(pressed, friction, method.cells)
    hertz = hertz_of(scene)
    if method.name == "simplified":
        return Simplified(interpenetrating(hertz, pair), friction)
    if method.name == "fastsim":
        choices = method.model_dump(include={"march", "bound", "flexibilities"})
        return Fastsim(hertz, friction, pair, **choices, falling=built.falling)
    return (Linear if method.name == "linear" else ExactOnEllipse)(hertz, friction, pair)


def creepages(scene: ContactScene) -> list[Motion]:
    """The creepages of the scene, one or a sweep of them."""
    fixed = scene.creepage.model_dump()
    values = [{}] if scene.sweep is None else [{scene.sweep.of: float(value)} for value in scene.sweep.values()]
    return [tuple({**fixed, **value}.values()) for value in values]  # type: ignore[misc]


def interpenetrating(hertz: Hertz, pair: Pair) -> NormalContact:
    """An ellipse as the theory of 1983 finds it, with room for more than its area."""
    A, B = float(hertz.A), float(hertz.B)
    x, y = (float(np.sqrt(1.5 * hertz.approach / curvature)) for curvature in (A, B))
    return press(quadratic(A, B, x, y), pair, load=float(hertz.load))


def touches(scene: ContactScene, built: Built) -> list[Touch]:
    """Where the profiles of a scene touch."""
    p = scene.profiles
    assert p is not None
    track = Track(gauge=p.gauge, gauge_depth=p.gauge_depth, inclination=p.inclination)
    wheelset = Wheelset(radius=p.radius, back_to_back=p.back_to_back)
    return wheel_on_rail(
        built.profiles["wheel"],
        built.profiles["rail"],
        lateral_shift=p.lateral_shift,
        yaw=p.yaw,
        track=track,
        wheelset=wheelset,
    )


def _profile(scene: ContactScene, kind: Literal["wheel", "rail"]) -> Profile:
    """A built-in profile by its name, or the user's file."""
    assert scene.profiles is not None
    name = getattr(scene.profiles, kind)
    if name in BUILT_IN[kind]:
        return built_in(name)
    if "." not in name:
        raise InputError(scene.file, f"profiles.{kind}", name, "must be a file or built in", tuple(BUILT_IN[kind]))
    return read_profile(scene.path(name, f"profiles.{kind}"), kind, smoothing=scene.profiles.smoothing)


def hertz_of(scene: ContactScene) -> Hertz:
    """Hertz' contact from semi-axes, curvatures or radii, by load or approach."""
    built = built_of(scene)
    load, approach, pair = built.load, built.approach, built.pair
    if scene.ellipse is not None:
        return by_axes(scene.ellipse.a, scene.ellipse.b, pair, load=load, approach=approach)
    A, B = scene.radii.curvatures(scene.file) if scene.radii is not None else _given(scene)
    return by_load(A, B, load, pair) if load is not None else by_approach(A, B, approach, pair)


def _given(scene: ContactScene) -> tuple[float, float]:
    assert scene.curvatures is not None
    return scene.curvatures.A, scene.curvatures.B
