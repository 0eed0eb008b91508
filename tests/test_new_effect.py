"""A new effect is one new file: found, listed, named in a scene, computed in every engine, counted by what it says."""

from importlib import import_module

import numpy as np
import pytest

from models.core.errors import InputError
from models.core.scene_effects import (
    effect_names_of,
    extended_by_effects,
    rebuilt_scene,
    table_without_defaults,
    with_effects,
)
from models.core.systems import DEFAULT_SYSTEM, SYSTEMS
from models.systems.pitch_plane.plan import describe
from models.systems.pitch_plane.run import run as simulate
from studies.command_line import list_scenes
from validation.absence.of_systems import added_counts, bare_scene, declared_counts
from validation.cases import absent

ANCHOR = '''"""A rope that draws the chassis level."""

from dataclasses import replace

from models.core.strict import Strict, quantity
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
from models.core.strict import Strict, quantity

COST = "two exponentials per wheel and sample"
EXAMPLE = {"time": 0.2}
COUNTS = {"all": {"time constants": 8}}


class Parameters(Strict):
    time: float = quantity("s", "of filling and emptying")


def extend(vehicle, p):
    slow = np.full(vehicle.plane.wheels, p.time)
    return replace(vehicle, chambers=vehicle.chambers._replace(fill_time=slow, empty_time=slow))
'''


def test_a_new_effect_of_the_pitch_plane(new_file, tmp_path, capsys):
    new_file(DEFAULT_SYSTEM, "anchor", ANCHOR)
    assert "anchor" in effect_names_of(DEFAULT_SYSTEM)
    list_scenes()
    assert "A rope that draws the chassis level" in capsys.readouterr().out
    scene = with_effects(absent.scene_with_effects({}, 20, tmp_path), "anchor")
    assert "effect     anchor: one native spring" in describe(scene) and "rope" in describe(scene)
    runs = {engine: simulate(scene, engine) for engine in absent.ENGINE_NAMES}
    for engine, run in runs.items():
        assert absent.component_count_changes("anchor", engine, tmp_path) == absent.declared_count_changes(
            "anchor", engine
        )
        assert np.abs(run.states - runs["reference"].states).max() < 1e-12  # one tableau in three engines
    assert np.abs(runs["reference"]["rope"]).max() > 1e3  # 2e4 N m/rad at 0.1 rad


def test_a_new_effect_of_another_system(new_file, capsys):
    new_file("braking", "slow_chambers", SLOW)
    list_scenes()
    assert "Chambers that are clogged" in capsys.readouterr().out
    found = added_counts("braking", "slow_chambers", is_quick=True)
    assert found == declared_counts("braking", "slow_chambers", ["reference"])
    scene = with_effects(bare_scene("braking"), "slow_chambers")
    assert "effect     slow_chambers" in import_module(SYSTEMS["braking"].plan).describe(scene)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("x = (", r"is no effect of braking that can be imported: .* was never closed"),
        ("import nothing_there", "can be imported: No module named 'nothing_there'"),
        ('"""Half a file."""', "has no COST and no Parameters and no extend"),
        (SLOW.partition("    slow = ")[0] + "    pass", "extend: returns nothing"),
        (SLOW.partition("    slow = ")[0] + "    return vehicle.none", "extend: line 18 stops with Attrib"),
        (SLOW.replace("COST", "NEEDS = ('storm',)\nCOST"), "storm.py: is no effect of braking"),
    ],
)
def test_a_file_that_is_no_effect_is_told_by_name(text, told, new_file, capsys):
    new_file("braking", "slow_chambers", text)
    list_scenes()
    assert "slow_chambers" in capsys.readouterr().out
    table = {**table_without_defaults(bare_scene("braking")), "effects": {"slow_chambers": {"time": 0.2}}}
    with pytest.raises(InputError, match=told) as found:
        scene = rebuilt_scene(table, bare_scene("braking"))
        extended_by_effects("what a system built", scene)
    assert ".py" in found.value.file


def test_the_file_is_all_that_made_it():
    """Control of the fixture: nothing of both is left."""
    assert "anchor" not in effect_names_of(DEFAULT_SYSTEM) and "slow_chambers" not in effect_names_of("braking")
