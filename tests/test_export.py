"""Exported files run alone: accelerations as those of the product without what is left out, all of which is named."""

import subprocess
import sys
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from models.engines.assembly import Settings
from models.engines.cut_vehicle import build as hub_model
from models.engines.export import ExportSubject, export_free_vehicle
from models.engines.exudyn_system import mass_and_force, set_start
from models.engines.free_vehicle_exudyn import FreeExudyn
from models.engines.free_vehicle_mujoco import compiled_model
from models.engines.mujoco_inertia import with_realisable_inertia
from models.engines.native_parts import divide_between_engine_and_callback
from models.engines.protocol import build
from models.engines.spatial_exudyn import SpatialExudyn
from models.engines.spatial_mujoco import SpatialMujoco
from models.multibody.cut_table import HubInputs
from models.systems.braking.of_scene import sprung_of
from models.systems.braking.scene import build as braking
from models.systems.handling.run import driven_model
from models.systems.hub_forces.export import export_cut_vehicle
from models.systems.pitch_plane.scene import assembly_of_scene
from models.systems.ride.of_scene import vehicle_of
from models.systems.wheelset.of_scene import equations_of
from models.vehicles.cut_vehicle import cut_at_hubs
from studies.command.asked import load_scene
from studies.command.export import exported_vehicle
from validation.spatial.cars import r19, rough_car, twin

STATES, SEED = 20, 5
ALONE = {
    "mujoco": """
import mujoco, numpy as np, sys
model = mujoco.MjModel.from_xml_path(sys.argv[1])
data = mujoco.MjData(model)
def accelerate(q, v):
    data.qpos[:], data.qvel[:] = q, v
    mujoco.mj_forward(model, data)
    return data.qacc.copy()
""",
    "exudyn": """
import importlib.util, numpy as np, sys
spec = importlib.util.spec_from_file_location("exported", sys.argv[1])
exported = importlib.util.module_from_spec(spec)
spec.loader.exec_module(exported)
system = exported.build()
def accelerate(q, v):
    return exported.accelerations(system, q, v)
""",
}
BOTH = """
states = np.load(sys.argv[2])
np.save(sys.argv[3], [accelerate(q, v) for q, v in states])
assert not {"models", "studies", "twinrig"} & set(sys.modules)
"""


def alone(text, engine, states, folder):
    """Accelerations (m, n) at states (m, 2, n) by an exported file in a process of its own."""
    file, given, answer = (folder / name for name in ("exported.file", "states.npy", "accelerations.npy"))
    file = file.with_suffix({"mujoco": ".xml", "exudyn": ".py"}[engine])
    file.write_text(text)
    np.save(given, states)
    command = [sys.executable, "-I", "-c", ALONE[engine] + BOTH, str(file), str(given), str(answer)]
    subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True)
    return np.load(answer)


def error(text, engine, product, size, folder):
    """Largest difference from a product's accelerations at random states, by each coordinate's largest one."""
    states = np.random.default_rng(SEED).uniform(-0.1, 0.1, (STATES, 2, size))
    wanted = np.array([product(q, v) for q, v in states])
    return float((np.abs(alone(text, engine, states, folder) - wanted) / np.abs(wanted).max(axis=0).clip(1e-3)).max())


def bare_mujoco(model):
    """Accelerations by a model of the product in which no callback acts."""
    data = mujoco.MjData(model)

    def accelerate(q, v):
        data.qpos[:], data.qvel[:] = q, v
        mujoco.mj_forward(model, data)
        return data.qacc.copy()

    return accelerate


def bare_exudyn(mbs):
    """Accelerations by a system of the product in which no function acts."""
    for i in range(mbs.systemData.NumberOfObjects()):
        for key, value in mbs.GetObject(i).items():
            if key.endswith("UserFunction") and value:
                mbs.SetObjectParameter(i, key, 0)

    def accelerate(q, v):
        set_start(mbs, q, v)
        return np.linalg.solve(*mass_and_force(mbs))

    return accelerate


def text_of(scene, engine):
    """Text of an exported file; what it leaves out stands in it."""
    answer = exported_vehicle(scene, engine)
    assert all(text.replace("--", "- -") in answer.text for text in answer.left_out)
    return answer.text


@pytest.mark.parametrize("geometry", ["exact", "linear"])
@pytest.mark.parametrize("engine", ["mujoco", "exudyn"])
def test_the_pitch_plane_alone_moves_as_in_the_product(engine, geometry, tmp_path):
    scene = load_scene("six_runs", [f"vehicle.geometry={geometry}", "vehicle.override.k1=1.9e5"])
    answer = exported_vehicle(scene, engine)
    assert answer.left_out == ("road under the tyres, flat here",)
    settings = Settings({"mujoco": "RK4", "exudyn": "RK44"}[engine], 1e-3, 1.0)
    product = build(engine, replace(assembly_of_scene(scene), mode="free", input=None), settings)
    states = np.random.default_rng(SEED).uniform(-0.1, 0.1, (STATES, 2, 4))
    wanted = np.array([product.acceleration(0.0, *state) for state in states])
    places = [0, 1, 2, 3]
    if engine == "exudyn":
        exec_names: dict = {}
        exec(answer.text.partition("def build")[0].partition("import numpy as np")[2], exec_names)
        places = list(exec_names["COORDINATES"].values())
    wide = np.zeros((STATES, 2, max(places) + 1))
    wide[:, :, places] = states
    found = alone(answer.text, engine, wide, tmp_path)[:, places]
    assert np.abs(found - wanted).max() < 1e-10 * np.abs(wanted).max()


CARS = {"shipped": r19, "twin": lambda: cut_at_hubs(twin(), "body"), "rough": rough_car}


@pytest.mark.parametrize("car", CARS)
@pytest.mark.parametrize("engine", ["mujoco", "exudyn"])
def test_a_cut_car_alone_moves_as_in_the_product(engine, car, tmp_path):
    """The product has all its forces here, with hub forces of 0 and what no element has set to 0."""
    whole = CARS[car]()
    answer = export_cut_vehicle(engine, whole, ExportSubject("car", "car.toml", ""), [])
    tree = whole.tree
    if engine == "mujoco":
        tree, lowered = with_realisable_inertia(tree)
        assert lowered == [text for text in answer.left_out if "inertia" in text]
    smooth = tuple(
        part.element for part in divide_between_engine_and_callback(whole.tree, whole.elements, engine).native
    )
    hub_inputs = HubInputs(np.zeros((3, 6 * len(whole.hubs))))
    product = hub_model(engine, replace(whole, tree=tree, elements=smooth), hub_inputs, 1e-3, 1e-3, "native")
    assert product.division.shared == ()
    assert error(answer.text, engine, lambda q, v: product.acceleration(0.0, q, v), whole.size, tmp_path) < 1e-10


def test_parts_that_are_left_out_of_a_cut_car_are_named():
    for engine in ("mujoco", "exudyn"):
        car = rough_car()
        reasons = divide_between_engine_and_callback(car.tree, car.elements, engine).reasons
        answer = export_cut_vehicle(engine, rough_car(), ExportSubject("car", "car.toml", ""), ["stabiliser"])
        assert reasons
        assert all(any(name in text and why in text for text in answer.left_out) for name, why in reasons.items())
        assert answer.left_out.count("stabiliser") == 1 and "stabiliser" in answer.text


def braking_scene():
    """A car on its suspension that stops on a wet road."""
    return braking(
        {
            "title": "car",
            "system": "braking",
            "vehicle": {"file": "r19_free", "spin_inertia": 1.7},
            "road": {"stretches": [{"left": "wet"}]},
            "brakes": {"front": {"gradient": 300.0}, "rear": {"gradient": 100.0}, "supply": 2.0},
            "procedures": {"straight": {"speed": 3.0}},
        },
        "scene.toml",
    )


def car_on_springs(system):
    """What an engine builds of a steered, or of a braked vehicle, and the scene."""
    if system == "handling":
        scene = load_scene("handling", None)
        return driven_model(scene.handling(next(iter(scene.manoeuvres)))), scene
    scene = braking_scene()
    return driven_model(sprung_of(scene).handling), scene


@pytest.mark.parametrize("system", ["handling", "braking"])
@pytest.mark.parametrize("engine", ["mujoco", "exudyn"])
def test_a_car_on_its_carrier_alone_moves_as_in_the_product(engine, system, tmp_path):
    driven, scene = car_on_springs(system)
    text, size = text_of(scene, engine), driven.size
    if engine == "exudyn":
        product = bare_exudyn(FreeExudyn(driven).mbs)
    else:
        product = bare_mujoco(compiled_model(replace(driven, vehicle=with_realisable_inertia(driven.vehicle)[0])))
    assert error(text, engine, product, size, tmp_path) < 1e-10
    named = exported_vehicle(scene, engine).left_out
    parts = [*driven.vehicle.springs, *driven.vehicle.bars, *driven.vehicle.tyres]
    assert all(any(repr(part.name) in text for text in named) for part in parts)


def test_a_rotor_keeps_its_motion_with_a_tensor_that_mujoco_takes(tmp_path):
    """Beside Exudyn's, which has the tensors of the vehicle: rotors that are heavy about their axle alone."""
    driven, _ = car_on_springs("handling")
    tensor = ((300.0, 0.0, -10.0), (0.0, 1400.0, 0.0), (-10.0, 0.0, 1600.0))
    bodies = tuple(replace(body, inertia=tensor) if body.name == "body" else body for body in driven.vehicle.bodies)
    driven = replace(driven, vehicle=replace(driven.vehicle, bodies=bodies))
    answer = export_free_vehicle("mujoco", driven, ExportSubject("", "", ""), [])
    assert answer.left_out == ()
    assert error(answer.text, "mujoco", bare_exudyn(FreeExudyn(driven).mbs), driven.size, tmp_path) < 1e-9


@pytest.mark.parametrize("scene", ["ride", "ride_choice", "ride_nonlinear"])
@pytest.mark.parametrize("engine", ["mujoco", "exudyn"])
def test_a_vehicle_of_the_ride_alone_moves_as_in_the_product(engine, scene, tmp_path):
    scene = load_scene(scene, None)
    text, vehicle = text_of(scene, engine), vehicle_of(scene)
    if engine == "mujoco":
        product = bare_mujoco(SpatialMujoco(with_realisable_inertia(vehicle)[0], None, 20.0, None).model)
    else:
        product = bare_exudyn(SpatialExudyn(vehicle, None, 20.0, None).mbs)
    assert error(text, engine, product, len(vehicle.coordinates()), tmp_path) < 1e-10


@pytest.mark.parametrize("engine", ["mujoco", "exudyn"])
def test_a_wheelset_alone_moves_as_in_the_product(engine, tmp_path):
    scene = load_scene("wheelset", None)
    text, product = text_of(scene, engine), equations_of(scene, engine, 20.0)
    bare = bare_mujoco(product.model.model) if engine == "mujoco" else bare_exudyn(product.model.mbs)
    assert error(text, engine, bare, 5, tmp_path) < 1e-10


def test_what_cannot_be_exported_is_told(twinrig, capsys, tmp_path):
    def told(*arguments):
        assert twinrig("export", *arguments) == 2
        return capsys.readouterr().err

    assert "did you mean 'mujoco'?" in told("ride", "--engine", "mujoko")
    assert "no vehicle that an engine builds (allowed: braking" in told("contact_table", "--engine", "mujoco")
    assert "vehicle.file, a vehicle on its suspension" in told("braking", "--engine", "exudyn")
    assert "must end in .xml for mujoco" in told("ride", "--engine", "mujoco", "--out", "ride.txt")
    assert "a folder that does not exist" in told("ride", "--engine", "mujoco", "--out", "nowhere/ride.xml")
    assert twinrig("export", "six_runs", "--engine", "mujoco") == 0
    said = capsys.readouterr().out
    assert "has 3 bodies, 4 joints, 2 actuators" in said and "road under the tyres, flat here" in said
    before = (tmp_path / "six_runs_mujoco.xml").read_bytes()
    assert "nothing is overwritten" in told("six_runs", "--engine", "mujoco")
    assert (tmp_path / "six_runs_mujoco.xml").read_bytes() == before
