"""What a scene of any system does not name is not there, and what it names adds what its file says and no more."""

from dataclasses import replace

import pytest

from models.core.errors import InputError
from models.core.scene_effects import (
    absent_effects,
    check_effects,
    effect_names_of,
    effect_of,
    effect_sentences,
    named_effects,
    rebuilt_scene,
    scene_without,
    table_without_defaults,
    with_effects,
)
from models.core.systems import DEFAULT_SYSTEM, SYSTEMS, load
from models.systems.braking.effects import TABLE
from models.systems.braking.scene import build
from models.systems.pitch_plane.scene import build as build_half_car
from studies.command.asked import SCENES_FOLDER, plan_module_of
from validation.absence.of_systems import (
    absence_module_of,
    addable_effects,
    added_counts,
    bare_scene,
    counts_and_paths,
    declared_counts,
)

CHEAP = [(system, name) for system in ("contact", "braking") for name in addable_effects(system)]
"""Effects whose counts are compared here; the full case ``absent`` (tests/test_cases.py) has those of every system."""


@pytest.mark.parametrize(("system", "effect"), CHEAP)
def test_an_effect_adds_what_its_file_says(system, effect):
    found = added_counts(system, effect, is_quick=True)
    assert found and found == declared_counts(system, effect, found)


def test_a_bare_scene_names_nothing():
    for system in ("contact", "braking", "handling"):
        assert named_effects(bare_scene(system)) == () and absent_effects(bare_scene(system)) == effect_names_of(system)


def test_the_counts_see_an_effect_that_says_nothing_of_itself(monkeypatch):
    """Positive control of the comparison: a file that declares too little is found out."""
    monkeypatch.setitem(TABLE, "load_transfer", replace(TABLE["load_transfer"], counts={}))
    found = added_counts("braking", "load_transfer", is_quick=True)
    assert found == {"reference": {"moving loads": 4}} != declared_counts("braking", "load_transfer", found)


@pytest.mark.parametrize("name", ["braking", "contact_profiles", "handling", "hub_forces", "recording", "wheelset"])
def test_a_scene_is_the_same_from_its_own_table_and_can_do_without_what_it_names(name):
    scene = load(SCENES_FOLDER / f"{name}.toml")
    assert rebuilt_scene(table_without_defaults(scene), scene) == scene
    for effect in named_effects(scene):
        try:
            assert effect not in named_effects(scene_without(scene, effect))
        except InputError as error:  # what cannot be left out says why and what to do
            assert error.file == scene.file and ":" in error.allowed


def test_what_needs_another_leaves_before_it():
    full = with_effects(bare_scene("braking"), "pressure_dynamics", "valve_delay", "port", "teeth")
    assert named_effects(scene_without(full, "pressure_dynamics", "valve_delay", "teeth", "port")) == ()


def test_effects_that_cannot_be_together_are_told_with_the_remedy():
    on_springs = {
        **absence_module_of("braking").BARE_SCENE,
        "vehicle": {"file": "r19_free", "spin_inertia": 1.7},
        "load_transfer": {},
    }
    with pytest.raises(
        InputError,
        match=r"load_transfer: cannot stand beside 'suspension', whose springs carry the "
        r"loads: drop one of them; 'suspension' is named by vehicle.file",
    ):
        build(on_springs, "s.toml")
    with pytest.raises(InputError, match="falling_friction: needs the effect 'saturation': name it too"):
        scene_without(with_effects(bare_scene("contact"), "saturation", "falling_friction"), "saturation")
    with pytest.raises(InputError, match=r"effects.trailer: has another place in a scene: trailer"):
        build({**absence_module_of("braking").BARE_SCENE, "effects": {"trailer": {}}}, "s.toml")


def test_a_remedy_that_would_break_another_law_says_so():
    effects = {"road": {"source": "study", "speed": 20.0}, "force_noise": {"deviation": 8.0}}
    scene = build_half_car({"title": "t", "run": {"duration": 1.0, "step": 1e-3}, "effects": effects}, "s")
    with pytest.raises(
        InputError,
        match=r"force_noise: needs the effect 'wheel_forces': name it too in place of "
        "'road', beside which it cannot stand",
    ):
        check_effects(scene)


def test_what_cannot_be_put_in_is_refused():
    with pytest.raises(InputError, match="'delay' cannot be in this scene"):
        with_effects(load(SCENES_FOLDER / "ride_nonlinear.toml"), "delay")
    with pytest.raises(InputError, match="there are no usual values"):
        with_effects(bare_scene("braking"), "measured_pressures")


@pytest.mark.parametrize("system", [name for name, own in SYSTEMS.items() if own.effects])
def test_every_effect_of_every_system_can_be_listed_and_judged(system):
    assert all(effect_sentences(system).values())
    for name in effect_names_of(system):
        module = effect_of(system, name)
        assert {*module.NEEDS, *module.EXCLUDES} <= {*effect_names_of(system)} - {name} and module.COST
        assert {*module.COUNTS} <= {"all", *SYSTEMS[system].engines}
        assert hasattr(module, "extend") != hasattr(module, "leave_out")
        assert system == DEFAULT_SYSTEM or not module.COUNTS or name in addable_effects(system), (
            "nobody checks what it declares"
        )


def test_a_plan_lists_effects_and_what_is_absent():
    scene = load(SCENES_FOLDER / "contact_ellipse.toml")
    told = plan_module_of(scene).describe(scene)
    assert "effect     saturation: " in told
    assert "absent     any_shape, falling_friction, half_space, profiles (not" in told


def test_a_path_is_the_same_whatever_ran_before():
    scene = bare_scene("contact")
    before = counts_and_paths("contact", scene)
    counts_and_paths("contact", with_effects(scene, "saturation", "falling_friction"))
    assert counts_and_paths("contact", scene) == before
