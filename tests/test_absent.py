"""An effect that a scene does not name is not imported, compiled, called, stored or paid for."""

import os
import shutil
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import models
from models.core.scene_effects import effect_names_of, effect_of
from models.core.systems import DEFAULT_SYSTEM
from models.systems.pitch_plane.scene import assembly_of_scene
from validation.absence import ride
from validation.absence.hand_built import mujoco_model
from validation.absence.probes import (
    belongs_to_effects,
    counted_march,
    installed_callbacks,
    march_with_least_memory,
    probe,
    registered_callbacks,
    user_functions,
)
from validation.cases import absent, effect_prices
from validation.cases.absent import (
    EFFECT_NAMES,
    ENGINE_NAMES,
    FORCE_EFFECT,
    component_count_changes,
    declared_count_changes,
    engine_model,
    required_effects,
    scene_with_effects,
)
from validation.cases.effect_prices import hand_built_run

BARE = {"title": "bare", "run": {"duration": 0.02, "step": 0.001}, "start": {"pitch": 0.1}}
FORCED = {**BARE, "effects": FORCE_EFFECT}
ROAD = effect_of(DEFAULT_SYSTEM, "road").EXAMPLE
EFFECT_FILES = "systems/pitch_plane/effects"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with wheel forces and a pitch."""
    folder = tmp_path_factory.mktemp("files")
    absent.write_input_files(folder)
    return folder


@pytest.fixture(scope="module")
def bare():
    """A scene without effects in a process of its own."""
    return probe(BARE)


@pytest.fixture(scope="module")
def forced(folder):
    """A scene with wheel forces alone in a process of its own."""
    return probe(FORCED, str(folder))


def test_a_bare_scene_imports_no_effect(bare):
    assert [name for name in bare["modules"] if belongs_to_effects(name)] == []


def test_a_scene_imports_its_own_effect_alone(forced):
    """Positive control: the modules that must be absent above do appear, but only those of the one effect."""
    found = {name for name in forced["modules"] if belongs_to_effects(name)}
    assert found == {"models.systems.pitch_plane.effects.wheel_forces", "models.core.time_series", "models.core.tables"}


def test_only_the_kernel_of_the_scene_is_compiled(bare, forced):
    assert [len(found["marches"]) for found in (bare, forced)] == [1, 1]
    assert bare["marches"] != forced["marches"]
    assert bare["derivatives"] == forced["derivatives"] == []


@pytest.mark.parametrize("engine", ENGINE_NAMES)
def test_no_python_and_no_memory_within_a_march(engine, folder):
    """100 times as many steps enter no more Python functions and take no more memory, but for the result.

    2,000 bytes over 1,980 steps: less than one byte a step is a wrapper's own doing, not the loop's.
    """
    for _ in range(2):  # wrappers cache on their first calls
        counted_march(engine, engine_model(scene_with_effects({}, 20, folder), engine))
    short, long = (
        march_with_least_memory(engine, partial(engine_model, scene_with_effects({}, steps, folder), engine))
        for steps in (20, 2000)
    )
    assert long.frames == short.frames <= 50
    assert abs(long.peak_bytes - short.peak_bytes) < 2000
    assert short.callbacks == long.callbacks == 0


def test_the_watch_sees_callbacks_where_there_are_some(folder):
    """Positive control: four Python callbacks at each of RK44's four stages, and one compiled one in MuJoCo."""
    road = {"road": ROAD}
    assert counted_march("exudyn", engine_model(scene_with_effects(road, 50, folder), "exudyn")).frames >= 50 * 4 * 4
    assert counted_march("mujoco", engine_model(scene_with_effects(road, 50, folder), "mujoco")).callbacks == 1
    assert installed_callbacks() == 0


def test_no_callback_before_during_and_after(folder):
    assert installed_callbacks() == 0
    assert counted_march("mujoco", engine_model(scene_with_effects({}, 50, folder), "mujoco")).callbacks == 0
    assert installed_callbacks() == 0
    assert user_functions(engine_model(scene_with_effects({}, 50, folder), "exudyn")) == 0


def test_user_functions_are_counted(folder):
    """Positive control, over Exudyn's own items: two loads per wheel on a road; two offsets of the constraint."""
    assert user_functions(engine_model(scene_with_effects({"road": ROAD}, 50, folder), "exudyn")) == 4
    guided = {
        **required_effects("prescribed_pitch"),
        "prescribed_pitch": effect_of(DEFAULT_SYSTEM, "prescribed_pitch").EXAMPLE,
    }
    built = engine_model(scene_with_effects(guided, 50, folder, has_prescribed_pitch=True), "exudyn")
    assert user_functions(built) == built.plan()["callbacks"] == 4
    built = engine_model(scene_with_effects(FORCE_EFFECT, 50, folder), "exudyn")
    assert user_functions(built) == built.plan()["callbacks"] == 3  # the step's own among them


@pytest.mark.parametrize(("engine", "most"), [("exudyn", 4), ("mujoco", 1)])
def test_callbacks_are_seen_while_a_run_lasts(engine, most, folder):
    """Positive control of the rows of other systems: those of a road, however the run comes about."""
    with registered_callbacks(engine) as callbacks:
        engine_model(scene_with_effects({}, 20, folder), engine).run()
        assert max(callbacks, default=0) == 0
        engine_model(scene_with_effects({"road": ROAD}, 20, folder), engine).run()
    assert max(callbacks) == most and installed_callbacks() == 0


def test_a_bare_scene_has_the_states_of_the_vehicle_and_no_others(folder):
    own = scene_with_effects({}, 20, folder)
    ours, found = engine_model(own, "exudyn"), engine_model(own, "mujoco").model
    system = ours.built.mbs.systemData
    assert (found.nq, found.nv, found.na, found.nuserdata, found.nsensor, found.neq) == (4, 4, 0, 0, 0, 0)
    assert (found.nnumeric, found.nu) == (0, 2)  # no input table; the two struts of the suspension
    plane = 3  # Exudyn's point masses and rigid body have their horizontal coordinate as well
    assert (system.ODE2Size(), system.ODE1Size(), system.AEsize()) == (4 + plane, 0, 0)
    assembly = assembly_of_scene(own)
    assert (assembly.input, assembly.outputs, assembly.vehicle.pitch_springs) == (None, (), ())


@pytest.mark.parametrize("engine", ENGINE_NAMES)
@pytest.mark.parametrize("effect", EFFECT_NAMES)
def test_an_effect_changes_the_counts_by_what_it_declares(effect, engine, folder):
    assert component_count_changes(effect, engine, folder) == declared_count_changes(effect, engine)


@pytest.mark.parametrize("kept", [(), ("wheel_forces",)], ids=["bare", "forced"])
def test_the_same_numbers_with_the_other_effects_files_removed(kept, bare, forced, folder, tmp_path):
    """Bit for bit, in all engines, from a copy of the package without what the scene does not name."""
    copy = tmp_path / "models"
    shutil.copytree(Path(models.__file__).parent, copy)
    shutil.rmtree(copy / "road")
    for name in {*effect_names_of(DEFAULT_SYSTEM)} - {*kept}:
        (copy / EFFECT_FILES / f"{name}.py").unlink()
    for name in ("mujoco_callback", "mujoco_layout"):
        (copy / "engines" / f"{name}.py").unlink()
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    found = probe(FORCED if kept else BARE, str(folder), cwd=tmp_path, env=environment)
    assert found["states"] == (forced if kept else bare)["states"]
    assert len(bytes.fromhex(found["states"]["mujoco"])) == 21 * 8 * 8


def test_the_copy_is_what_runs_without_the_files(folder, tmp_path):
    """Positive control of the test above: a scene that names a removed effect is refused by the copy."""
    copy = tmp_path / "models"
    shutil.copytree(Path(models.__file__).parent, copy)
    (copy / EFFECT_FILES / "wheel_forces.py").unlink()
    with pytest.raises(Exception) as caught:
        probe(FORCED, str(folder), cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(tmp_path)})
    assert "no such effect" in caught.value.stderr


@pytest.mark.parametrize("engine", ["exudyn", "mujoco"])
def test_the_machinery_adds_nothing_to_a_hand_built_model(engine, folder):
    """The same items in the same order give the same bits; what it costs is measured by the validation."""
    own = scene_with_effects({}, 500, folder)
    ours, theirs = engine_model(own, engine).run().states, hand_built_run(engine, own)()
    assert np.array_equal(ours, theirs)
    assert abs(ours[-1] - ours[0]).max() > 0.01


def test_mujoco_compiles_the_same_model_from_the_description_and_by_hand(folder):
    """Every array of bodies, joints, sites and actuators: places, masses, inertias, frames, what is left out."""
    own = scene_with_effects({}, 20, folder)
    ours, theirs = engine_model(own, "mujoco").model, mujoco_model(own.vehicle_parameters(), absent.TIME_STEP)
    kinds = ("body_", "dof_", "jnt_", "site_", "actuator_", "tendon_", "eq_", "geom_", "qpos")
    fields = [name for name in dir(ours) if name.startswith(kinds) and isinstance(getattr(ours, name), np.ndarray)]
    assert len(fields) > 100
    different = [name for name in fields if not np.array_equal(getattr(ours, name), getattr(theirs, name))]
    assert different == []


def test_the_price_list_reads_as_a_table():
    spread = {"median": 1.25, "mad": 0.1, "min": 1.0}
    entry = {
        "effect": "road",
        "engine": "exudyn",
        "adds": "+4 callbacks",
        "step": 2.5,
        "us": spread,
        "ratio": (1.5, 1.4, 1.6),
    }
    (table,) = effect_prices.tables({"price": [entry]})
    assert table.rows == (("road", "exudyn", "+4 callbacks", "2.50", "+1.25 +/- 0.10", "1.50 (1.40 to 1.60)"),)
    assert len(table.headings) == len(table.rows[0])


def test_a_ride_has_no_more_than_it_names():
    assert [(row.id, row.reason) for row in ride.rows() if row.status in ("failed", "not run")] == []


@pytest.mark.full
def test_a_ride_by_an_engine_imports_that_one_alone():
    """Positive control of the modules that must be absent above."""
    assert ride.imported_modules("mujoco") == ["mujoco", "numba", "models.engines"]
