"""A new effect of every system is one new file: listed, named, computed in every engine, counted, refused, left out."""

from dataclasses import dataclass
from functools import partial
from importlib import import_module

import numpy as np
import pytest

from models.advice.choice.variants import module_of_system
from models.advice.price import effects, effects_of_ride, effects_text
from models.advice.price.effects import QuantityChange, price_list
from models.advice.ride_choice.reduced import FullScene
from models.core.errors import InputError
from models.core.scene_effects import (
    effect_sentences,
    rebuilt_scene,
    scene_without,
    table_without_defaults,
    with_effects,
)
from models.core.systems import SYSTEMS, load
from models.multibody.numbers import Handling, Push
from models.ride.road_path import road_path
from models.systems.contact.cases_table import solve_table
from models.systems.contact.run import Built, solved_contact
from models.systems.contact.run import run as run_contact
from models.systems.contact.scene import build as build_contact
from models.systems.handling.energy import unaccounted_energy
from models.systems.handling.run import drive_run
from models.systems.ride.nonlinear import drive_over_road
from models.systems.ride.of_scene import excitation_of, linear_vehicle, vehicle_of
from models.systems.ride.omissions import effects_of
from models.systems.ride.reduced_scene import ReducedScene, refusal_reason
from models.systems.ride.reduced_scene import reduced_without as without_effects
from models.systems.ride.scene import build as build_ride
from models.vehicles.spatial_linear import wheels
from models.vehicles.vehicle_file import load_vehicle
from studies.command.asked import SCENES_FOLDER
from validation.absence.contact import BARE_SCENE as CONTACT
from validation.absence.of_systems import added_counts, bare_scene, counts_and_paths, declared_counts


@dataclass(frozen=True)
class New:
    """A file of an effect, the name of another that it excludes, and how far engines may part (relative)."""

    name: str
    excludes: str
    parameter: str
    value: float
    counts: str
    extend: str
    apart: float = 1e-12
    beside: tuple[str, ...] = ()

    @property
    def text(self):
        """What stands in the file."""
        return f'''"""New: {self.name}."""

from dataclasses import replace

import numpy as np

from models.core.strict import Strict, quantity

EXCLUDES = ("{self.excludes}",)
WHY = "which it would be twice"
COST = "what {self.name} costs"
EXAMPLE = {{"{self.parameter}": {self.value}}}
COUNTS = {self.counts}


class Parameters(Strict):
    {self.parameter}: float = quantity("", "of {self.name}")


def extend(built, p):
{self.extend}'''


NEW = {
    "ride": New(
        "tread",
        "second_corner",
        "length",
        0.1,
        '{"all": {"states": 4}}',
        """
    def lagged(road):
        m, lag = len(road.F), np.eye(len(road.F)) / p.length
        return replace(road, F=np.block([[road.F, np.zeros((m, m))], [lag, -lag]]),
                       G=np.vstack([road.G, 0.0 * road.G]),
                       heights=tuple(np.hstack([0.0 * H, H]) for H in road.heights))

    return replace(built, road=(*built.road, lagged))
""",
    ),
    "contact": New(
        "soft_bodies",
        "falling_friction",
        "share",
        0.5,
        "{}",
        """
    from models.contact.material import Material, MaterialPair

    soft = (Material(E=p.share * body.E, nu=body.nu) for body in (built.pair.wheel, built.pair.rail))
    return replace(built, pair=MaterialPair(*soft))
""",
        beside=("saturation",),
    ),
    "wheelset": New(
        "rubber",
        "profiles",
        "stiffness",
        1e7,
        '{"all": {"springs": 1}, "exudyn": {"spring-dampers": 2}, "mujoco": {"actuators": 2}}',
        """
    return built.changed(stiffness_x=p.stiffness)
""",
    ),
    "handling": New(
        "side_wind",
        "rough_road",
        "force",
        900.0,
        '{"all": {"pushes": 1}}',
        """
    from models.multibody.numbers import Push

    wind = Push("body", (0.3, 0.0, 0.8), (0.0, 1.0, 0.0), ((0.0, 0.0), (5e-3, p.force)))
    return replace(built, pushes=(*built.pushes, wind))
""",
    ),
    "hub-forces": New(
        "light_wheels",
        "turning_forces",
        "share",
        0.5,
        "{}",
        """
    wheels = {tyre.body for tyre in built.tyres}
    bodies = (replace(b, mass=p.share * b.mass) if b.name in wheels else b for b in built.bodies)
    return replace(built, bodies=tuple(bodies))
""",
    ),
    "measured": New(
        "slow_transducers",
        "own_clocks",
        "time",
        5e-3,
        "{}",
        """
    share = 1.0 - np.exp(-built.period / p.time)

    def lag(signal, samples):
        out = samples.copy()
        for i in range(1, len(out) if signal.quantity == "force" else 0):
            out[i] = out[i - 1] + share * (samples[i] - out[i - 1])
        return out

    return built.changed(lag)
""",
    ),
}
"""System -> a file for it. Where engines march by one tableau they part by rounding alone."""


@pytest.mark.parametrize("system", NEW)
def test_a_new_effect_is_one_file(system, new_file):
    new, scene = NEW[system], bare_scene(system)
    before, table = counts_and_paths(system, scene), table_without_defaults(scene) | {"effects": {NEW[system].name: {}}}
    with pytest.raises(InputError, match="no such effect"):
        rebuilt_scene(table, scene)
    new_file(system, new.name, new.text)
    assert effect_sentences(system)[new.name] == f"New: {new.name}"
    assert added_counts(system, new.name, is_quick=True) == declared_counts(system, new.name, [next(iter(before))])
    own = with_effects(scene, new.name)
    assert f" {new.name}: what {new.name} costs" in import_module(SYSTEMS[system].plan).describe(own)
    _judged(before, counts_and_paths(system, own), new.apart)
    assert scene_without(own, new.name) == scene  # and the very path that it had before there was a file:
    assert all(
        before[engine] == found
        for engine, found in counts_and_paths(system, scene_without(own, new.name), is_quick=True).items()
    )
    with pytest.raises(InputError, match=rf"effects.{new.name}.{new.parameter} = -1"):
        rebuilt_scene(table | {"effects": {new.name: {new.parameter: -1.0}}}, scene)


def _judged(before, after, apart):
    """Every engine has another path than before, and all have the same one."""
    paths = {engine: np.frombuffer(path) for engine, (_, path) in after.items()}
    first = next(iter(paths.values()))
    for engine, path in paths.items():
        assert path.tobytes() != before[engine][1], "nothing of it is computed"
        assert np.abs(path - first).max() < apart * np.abs(first).max()


def test_a_push_from_outside_does_the_work_that_the_vehicle_gains():
    """Energy of the rigid bodies, written without an engine, less the power of all forces by Simpson's rule: a push of
    900 N over some 16 mm puts in 15 J, and 9e-8 J are left."""
    handling = Handling(load_vehicle("r19_free")).changed(
        pushes=(Push("body", (0.3, 0.0, 0.8), (0.0, 1.0, 0.0), ((0.0, 0.0), (0.05, 900.0), (0.3, 900.0), (0.4, 0.0))),)
    )
    drive = drive_run("mujoco", handling, 25.0, 0.5)
    assert np.abs(unaccounted_energy(drive)).max() < 1e-6
    assert drive.path[-1, 1] > 0.04  # m, to the left
    with pytest.raises(InputError, match="no such body"):
        handling.changed(pushes=(Push("sail", (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), ((0.0, 1.0),)),))


DAMPERS = New(
    "dampers",
    "curves",
    "damping",
    800.0,
    "{}",
    """
    from models.vehicles.spatial import SpringDamper

    more = (SpringDamper(f"{t.name} damper", "body", t.body, t.point, t.point, (0.0, 0.0, 1.0), 0.0, p.damping)
            for t in built.vehicle.tyres)
    return replace(built, vehicle=replace(built.vehicle, springs=(*built.vehicle.springs, *more)))
""",
)
HALF_CAR = {
    "title": "t",
    "system": "ride",
    "vehicle": {"file": "half_car"},
    "speeds": {"values": [20.0]},
    "road": {"cutoff": 20.0},
}
"""Its road has rates, as runs in time need where tyres are damped."""


def test_a_new_effect_of_ride_is_in_every_linear_vehicle_and_in_both_engines(new_file):
    """Engines are linearised by differences, good to 1e-9; in time both march by one tableau."""
    new_file("ride", DAMPERS.name, DAMPERS.text)
    new_file("ride", "tread", NEW["ride"].text.replace("second_corner", "measured_road"))
    scene = build_ride(HALF_CAR)
    own = with_effects(scene, "dampers", "tread")
    vehicle, road = vehicle_of(own), excitation_of(own, wheels(vehicle_of(own)))
    by = {engine: linear_vehicle(vehicle, engine)(20.0).damping for engine in SYSTEMS["ride"].engines}
    bare_one = linear_vehicle(vehicle_of(scene))(20.0).damping
    for damping in by.values():
        assert damping - bare_one == pytest.approx(by["reference"] - bare_one, rel=1e-6, abs=1e-6)
    assert np.trace(by["reference"] - bare_one) > 4 * 800.0  # two dampers of two ends, and pitch
    runs = {
        engine: drive_over_road(engine, vehicle, road_path(road, 20.0, 2e-3), 0.1) for engine in ("exudyn", "mujoco")
    }
    rough = drive_over_road(
        "mujoco", vehicle_of(scene), road_path(excitation_of(scene, wheels(vehicle)), 20.0, 2e-3), 0.1
    )
    one, two = (run.run.positions for run in runs.values())
    assert np.abs(one - two).max() < 1e-12 * np.abs(one).max() < np.abs(two - rough.run.positions).max()


def test_new_effects_of_ride_are_priced_and_chosen_among(new_file, monkeypatch):
    """Exactly: each is left out of the equations themselves. What needs another one goes with it."""
    new_file("ride", DAMPERS.name, DAMPERS.text)
    new_file("ride", "tread", NEW["ride"].text.replace("COST", 'NEEDS = ("delay", "dampers")\nCOST', 1))
    scene = load(SCENES_FOLDER / "ride_choice.toml")
    held = ReducedScene.complete(own := with_effects(scene, "dampers", "tread"))
    there = {effect.name: effect for effect in effects_of(held)}
    assert {"dampers", "tread"} <= there.keys() and there["delay front to rear"].needs == ("tread",)
    assert "cannot be left out alone: leave out tread, too, for it needs it" in refusal_reason([there["dampers"]])
    whole = FullScene(held, 20.0)
    rest = whole.reduced(without_effects(held, [there["dampers"], there["tyre damping"], there["tread"]]))
    other = ReducedScene.complete(scene)
    known = FullScene(other, 20.0).reduced(without_effects(other, [there["tyre damping"]]))
    assert np.abs(rest.system.A - known.system.A).max() < 1e-12 * np.abs(known.system.A).max()
    monkeypatch.setattr(effects_of_ride, "TIMED_STEPS", 20)
    monkeypatch.setattr(effects_of_ride, "absent_effects", lambda scene: ("gravity_and_preload", "drag", "weighting"))
    prices = {price.name: price for price in price_list(own).prices}
    assert prices["tread"].counts[1]["states"] - prices["tread"].counts[0]["states"] == 4 and prices["dampers"].why
    assert prices["tread"].changes[0].relative > 0.01 and prices["tread"].changes[0].unit == "m/s^2"
    assert prices["tread"].there and not (more := prices["gravity_and_preload"]).there
    assert 0.0 < next(c for c in more.changes if c.name == "pitch acceleration").relative < 0.1
    assert "name it in the scene" in prices["drag"].why and prices["weighting"].gone == ("body centre Wk",)


RAIN = New(
    "rain",
    "spin",
    "share",
    0.5,
    "{}",
    """
    return replace(built, friction=p.share * built.friction)
""",
)


@pytest.mark.parametrize("theory", ["fastsim", "simplified", "exact"])
def test_a_new_law_of_friction_is_in_every_theory(theory, new_file):
    new_file("contact", RAIN.name, RAIN.text)
    table = CONTACT | {"contact": {"load": 8e4, "friction": 0.2}, "method": {"name": theory}}
    own, known = (
        build_contact(table | {"effects": {"rain": {"share": 0.5}}}),
        build_contact(table | {"contact": {"load": 8e4, "friction": 0.1}}),
    )
    one, other = (solved_contact(scene).roll((5e-3, 1e-3, 0.0), 9) for scene in (own, known))
    assert (one.fx, one.fy) == (other.fx, other.fy) != (0.0, 0.0)


def test_a_new_law_of_friction_holds_for_every_row_of_a_table(new_file, tmp_path):
    new_file("contact", RAIN.name, RAIN.text)
    head = "a [m],b [m],load [N],friction [-],xi_x [-],xi_y [-],spin [1/m]\n"
    for name, friction in (("wet", (0.2, 0.6)), ("dry", (0.1, 0.3))):
        rows = (f"5e-3,4e-3,8e4,{mu},5e-3,1e-3,0.1\n" for mu in friction)
        (tmp_path / f"{name}.csv").write_text(head + "".join(rows))
    scene = build_contact(
        {"title": "t", "system": "contact", "cases": {"file": "wet.csv"}, "effects": {"rain": {"share": 0.5}}},
        scene_folder=tmp_path,
    )
    run_contact(scene, answers=tmp_path / "a.csv")
    solve_table(tmp_path / "dry.csv", tmp_path / "b.csv", partial(Built, scene.pair), scene.method)
    assert (tmp_path / "a.csv").read_text() == (tmp_path / "b.csv").read_text()


def test_a_new_profile_and_a_law_that_no_theory_of_the_scene_knows(new_file):
    """A rail that is rounder by a parabola carries on a smaller area."""
    new_file(
        "contact",
        "ground",
        New(
            "ground",
            "falling_friction",
            "depth",
            1e-4,
            "{}",
            """
    rail = built.profiles["rail"]
    own = replace(rail, z=rail.z + p.depth * (rail.y / 0.02) ** 2)
    return replace(built, profiles={**built.profiles, "rail": own})
""",
        ).text,
    )
    scene = build_contact(CONTACT | {"ellipse": None, "profiles": {}, "method": {"name": "simplified"}})
    assert solved_contact(with_effects(scene, "ground")).pressing.area < solved_contact(scene).pressing.area
    new_file(
        "contact",
        "worn_in",
        New(
            "worn_in",
            "falling_friction",
            "floor",
            0.4,
            "{}",
            """
    from models.contact.material import FallingFriction

    return replace(built, falling=FallingFriction(floor=p.floor, decay=0.6, speed=20.0))
""",
        ).text,
    )
    with pytest.raises(InputError, match=r"'simplified': has constant friction, .*: use fastsim"):
        solved_contact(with_effects(scene, "worn_in"))


@pytest.mark.parametrize("system", [name for name in NEW if name != "measured"])
def test_a_new_effect_cannot_stand_beside_what_it_excludes(system, new_file):
    new = NEW[system]
    new_file(system, new.name, new.text)
    with pytest.raises(InputError, match=f"cannot stand beside '{new.excludes}', which it would be twice: drop one"):
        with_effects(bare_scene(system), *new.beside, new.excludes, new.name)


@pytest.mark.parametrize("system", [name for name, own in SYSTEMS.items() if not own.effects])
def test_a_system_without_effects_says_where_there_are_some(system):
    with pytest.raises(InputError, match=r"effects: has no place in a scene of this system, .* put it into a scene of"):
        import_module(SYSTEMS[system].scene).build({"title": "t", "system": system, "effects": {"mine": {}}})


@pytest.mark.parametrize("system", [name for name in NEW if name != "ride"])
def test_a_new_effect_changes_what_a_price_list_compares(system, new_file):
    """Of the runs that it times, at the usual values of both."""
    new_file(system, NEW[system].name, NEW[system].text)
    scene = bare_scene(system)
    runs = module_of_system(scene)
    less, more = (
        runs.computed_quantities(one, runs.DEFAULT_ENGINE) for one in (scene, with_effects(scene, NEW[system].name))
    )
    assert any(
        np.any(more.quantities[name].case_values[0] != own.case_values[0]) for name, own in less.quantities.items()
    )


def test_a_new_effect_has_a_price_there_and_absent(new_file, monkeypatch):
    monkeypatch.setattr(effects, "TIMING_ROUNDS", 3)
    new_file("contact", NEW["contact"].name, NEW["contact"].text)
    for scene in (bare_scene("contact"), with_effects(bare_scene("contact"), "soft_bodies")):
        price = next(price for price in price_list(scene).prices if price.name == "soft_bodies")
        assert (price.why, price.there) == ("", bool(scene.effects)) and np.isfinite(price.micros[0])
        assert 0.1 < price.changes[0].relative < 1.1  # half the modulus halves the forces on a given ellipse


def test_a_large_number_of_a_price_has_no_exponent():
    changed = effects_text._changed_quantity_text(QuantityChange("slip [1]", "N", 10_712.0, 2.904, 0.121))
    assert (
        changed == "slip by 10,700 N (290 % +- 12 %)"
        and effects_text._microseconds_text((4139.0, 96.0)) == "4,140 +- 100 us"
    )
    assert (
        effects_text._changed_quantity_text(QuantityChange("slip", "1", 0.0123, np.inf))
        == "slip by 0.0123 (from nothing)"
    )
