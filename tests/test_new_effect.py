"""A new effect is one new file: found, listed, named in a scene, computed in every engine, counted by what it says."""

import sys
from importlib import import_module

import numpy as np
import pytest

from models.errors import InputError
from models.plan import describe
from models.rail.of_scene import wheelset_of
from models.scene_effects import beside, names_of, own_table, rebuilt, without
from models.simulate import simulate
from models.systems import DEFAULT, SYSTEMS, load
from studies.asked import SCENES
from studies.command_line import list_scenes
from validation.absence.of_systems import added, bare, declared
from validation.cases import absent

ANCHOR = '''"""A rope that draws the chassis level."""

from dataclasses import replace

from models.strict import Strict, quantity
from models.vehicles.description import PitchSpring

COST = "one native spring, and one product after the run"
EXAMPLE = {"stiffness": 2e4}
COUNTS = {"exudyn": {"native items": 1}, "mujoco": {"native items": 1}, "all": {"channels": 1}}
CHANNELS = ("rope",)


class Parameters(Strict):
    stiffness: float = quantity("N m/rad", "of the rope")


def extend(assembly, p):
    springs = (*assembly.vehicle.pitch_springs, PitchSpring("chassis", p.stiffness, 0.0, 0.0))

    def rope(assembly, times, states):
        return {"rope": ("N m", "moment of the rope", -p.stiffness * states[:, 3])}

    vehicle = replace(assembly.vehicle, pitch_springs=springs)
    return replace(assembly, vehicle=vehicle, outputs=(*assembly.outputs, rope))
'''
SLOW = '''"""Chambers that are clogged."""

import numpy as np

from dataclasses import replace
from models.strict import Strict, quantity

COST = "two exponentials per wheel and sample"
EXAMPLE = {"time": 0.2}
COUNTS = {"all": {"time constants": 8}}


class Parameters(Strict):
    time: float = quantity("s", "of filling and emptying")


def extend(vehicle, p):
    slow = np.full(vehicle.plane.wheels, p.time)
    return replace(vehicle, chambers=vehicle.chambers._replace(fill=slow, empty=slow))
'''

TEMPLATE = '''"""{said}."""

from dataclasses import replace

from models.strict import Strict, quantity

EXCLUDES = {excludes}
COST = "one number more"
EXAMPLE = {{"share": 0.5}}


class Parameters(Strict):
    share: float = quantity("1", "of what there was")


def extend(built, p):
    {how}
'''
OTHERS = {
    "wheelset": ("worn_dampers", "('profiles',)", "return built.changed(damping_x=p.share * built.damping_x)",
                 lambda scene: wheelset_of(scene).damping_x),
    "handling": ("wet_road", "()",
                 "return replace(built, tyres=replace(built.tyres, friction=p.share * built.tyres.friction))",
                 lambda scene: scene.handling(next(iter(scene.manoeuvres))).tyres.friction),
    "hub-forces": ("light_bodies", "()",
                   "return replace(built, bodies=tuple(replace(b, mass=p.share * b.mass) for b in built.bodies))",
                   lambda scene: sum(body.mass for body in scene.cut_vehicle().tree.bodies)),
}  # fmt: skip
"""System -> name of a new effect that halves a number, what it excludes, how it does so, and that number of a scene."""


@pytest.fixture
def new_file(tmp_path, monkeypatch):
    """Put a file among the effects of a system, in a folder of its own."""

    def put(system, name, text):
        package = SYSTEMS[system].effects
        (tmp_path / f"{name}.py").write_text(text)
        monkeypatch.setattr(import_module(package), "__path__", [*import_module(package).__path__, str(tmp_path)])
        monkeypatch.setitem(sys.modules, f"{package}.{name}", None)  # to be taken away again
        del sys.modules[f"{package}.{name}"]

    return put


def test_a_new_effect_of_the_pitch_plane(new_file, tmp_path, capsys):
    new_file(DEFAULT, "anchor", ANCHOR)
    assert "anchor" in names_of(DEFAULT)
    list_scenes()
    assert "A rope that draws the chassis level" in capsys.readouterr().out
    scene = beside(absent.scene({}, 20, tmp_path), "anchor")
    assert "effect     anchor: one native spring" in describe(scene) and "rope" in describe(scene)
    runs = {engine: simulate(scene, engine) for engine in absent.ENGINES}
    for engine, run in runs.items():
        assert absent.change("anchor", engine, tmp_path) == absent.declared("anchor", engine)
        assert np.abs(run.states - runs["reference"].states).max() < 1e-12  # one tableau in three engines
    assert np.abs(runs["reference"]["rope"]).max() > 1e3  # 2e4 N m/rad at 0.1 rad


def test_a_new_effect_of_another_system(new_file, capsys):
    new_file("braking", "slow_chambers", SLOW)
    list_scenes()
    assert "Chambers that are clogged" in capsys.readouterr().out
    found = added("braking", "slow_chambers", quick=True)
    assert found == declared("braking", "slow_chambers", ["reference"])
    scene = beside(bare("braking"), "slow_chambers")
    assert "effect     slow_chambers" in import_module(SYSTEMS["braking"].plan).describe(scene)


@pytest.mark.parametrize("system", OTHERS)
def test_a_new_effect_of_systems_that_extend_what_they_build(system, new_file):
    name, excludes, how, number = OTHERS[system]
    scene = load(SCENES / f"{system.replace('-', '_')}.toml")
    with pytest.raises(InputError, match="no such effect"):
        rebuilt(own_table(scene) | {"effects": {name: {"share": 0.5}}}, scene)
    new_file(system, name, TEMPLATE.format(said="Half of it", excludes=excludes, how=how))
    own = beside(scene, name)
    assert number(own) == pytest.approx(0.5 * number(scene), rel=1e-12)
    assert f"{name}: one number more" in import_module(SYSTEMS[system].plan).describe(own)
    assert without(own, name) == scene and own.table()["effects"] == {name: {"share": 0.5}}
    with pytest.raises(InputError, match=f"effects.{name}.share"):
        rebuilt(own_table(scene) | {"effects": {name: {"share": -1.0}}}, scene)


def test_a_new_effect_can_exclude_one_of_a_table_of_its_own_system(new_file):
    _, excludes, how, _ = OTHERS["wheelset"]
    new_file("wheelset", "worn_dampers", TEMPLATE.format(said="Half of it", excludes=excludes, how=how))
    with pytest.raises(InputError, match=r"effects\.worn_dampers: cannot stand beside 'profiles'"):
        beside(load(SCENES / "wheelset.toml", ["profiles={}"]), "worn_dampers")


def test_the_file_is_all_that_made_it():
    """Control of the fixture: nothing of both is left."""
    assert "anchor" not in names_of(DEFAULT) and "slow_chambers" not in names_of("braking")
