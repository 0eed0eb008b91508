"""Springs, mounts and bars of the engines' own under hub forces: counts, agreement, faults, what show says."""

from dataclasses import replace

import numpy as np
import pytest

from models.core.errors import InputError, Refused
from models.engines.cut_vehicle import build, native_share
from models.engines.native_parts import NO_CURVE, NO_FRAME, NO_TRAVEL, AxialTravel, divide_between_engine_and_callback
from models.multibody.cut_table import HubInputs
from models.systems.hub_forces import run as running
from models.systems.hub_forces.plan import describe
from models.systems.hub_forces.run import run
from models.systems.hub_forces.scene import build as scene_of
from models.systems.measured.sections import Sections
from models.vehicles.cut_vehicle import cut_at_hubs
from validation.faults.native import CAMPAIGN
from validation.spatial.cars import r19, rough_car, static_forces, twin
from validation.spatial.native_builds import (
    NATIVE_ENGINES,
    difference_from_equations,
    hub_model,
    native_acceleration_difference,
    random_states,
    trajectory_difference,
)


def turned():
    """The twin with springs fixed in the engine and in a wheel, their ends apart."""
    whole = twin()
    frames = {"left mount.x": "engine", "rear mount.z": "engine", "front left": "fl"}
    springs = tuple(
        replace(s, frame=frames[s.name], second_point=tuple(np.add(s.second_point, (0.1, -0.2, 0.3))))
        if s.name in frames
        else s
        for s in whole.springs
    )
    return cut_at_hubs(replace(whole, springs=springs), "body")


@pytest.mark.parametrize("engine", NATIVE_ENGINES)
def test_every_spring_mount_bar_and_joint_is_the_engines_own(engine):
    """Counted in the built model; curves and friction that stay shared are named with the reason."""
    share = native_share(engine, r19())
    assert len(share.elements) == 21 and share.joints == 19 and share.reasons == {}
    share, car = native_share(engine, rough_car()), rough_car()
    assert set(share.elements) == {element.name for element in car.elements}
    rough = {element.name for element in car.elements if element.friction}
    curved = {element.name for element in car.elements if element.travel_force or element.rate_force}
    assert set(share.reasons) == (rough if engine == "mujoco" else rough | curved)
    assert all("friction" in share.reasons[name] for name in rough)
    assert engine == "mujoco" or all(NO_CURVE in share.reasons[name] for name in curved)


@pytest.mark.parametrize("car", [r19(), rough_car(), turned()], ids=["shipped", "rough", "turned"])
def test_native_compiled_and_written_forces_agree(car):
    """Accelerations at random states to 1e-12 of each coordinate's largest: rounding of stiff bushes leaves 6e-14."""
    states = random_states(car, 6)
    assert difference_from_equations(car, states) < 1e-12
    for engine in NATIVE_ENGINES:
        assert native_acceleration_difference(engine, car, states) < 1e-12
        assert trajectory_difference(engine, car, 30) < 1e-12


def test_the_first_evaluation_reads_no_stale_law():
    """At rest on its static loads a native vehicle stands still: preloads and hub forces balance, m/s^2."""
    for engine in NATIVE_ENGINES:
        for car in (r19(), rough_car()):
            built = build(engine, car, static_forces(car, 3), 1e-3, 1e-3, "native")
            rest = np.zeros(car.size)
            assert np.abs(built.acceleration(0.0, rest, rest)).max() < 1e-9


def test_an_axis_fixed_in_what_does_not_carry_the_other_end_stays_shared():
    """A mount in the engine's axes, whose other end is on the chassis, which the engine does not carry."""
    division = divide_between_engine_and_callback(turned().tree, turned().elements, "mujoco")
    assert division.reasons == dict.fromkeys(("left mount.x", "rear mount.z", "front left"), NO_FRAME)
    assert sum(isinstance(part.travel, AxialTravel) for part in division.native) == 7  # of nine of mounts


def test_a_spring_that_nothing_strains_is_no_element():
    """A seat moves up and down alone: a spring across it has a travel of 0 in every build."""
    car = r19()
    across = replace(car, elements=(*car.elements[:-3], replace(car.elements[-3], axis=np.array([1.0, 0.0, 0.0]))))
    assert car.elements[-3].name == "right seat"
    assert divide_between_engine_and_callback(across.tree, across.elements, "mujoco").reasons == {
        "right seat": NO_TRAVEL
    }
    assert native_acceleration_difference("mujoco", across, random_states(across, 2)) < 1e-12


def test_guides_feel_the_couple_of_an_axis_that_their_body_keeps():
    """What guides the engine leaves its roll and pitch free, also where springs are fixed in the engine's axes."""
    car = turned()
    q, v = random_states(car, 1)[0]
    q[[i for i, place in enumerate(car.tree.coordinates()) if place == ("engine", "rx")]] = 0.0
    sections = Sections(car, "body", wanted=("engine guide",))
    built = hub_model("reference", car, "compiled")
    row = sections.read(built.numbers, np.concatenate((q, v))[None], 2)[0]
    felt = {answer.name: value for answer, value in zip(sections.answers, row, strict=True)}
    largest = max(abs(felt[f"engine guide {part}"]) for part in ("Fx", "Fy", "Mz"))
    assert max(abs(felt["engine guide Mx"]), abs(felt["engine guide My"])) < 1e-10 * largest


def test_every_planted_fault_is_caught_and_nothing_else():
    records = CAMPAIGN.measure()
    assert [row.reason for row in CAMPAIGN.rows(records) if row.status in ("failed", "not run")] == []


BARE = {"title": "native", "system": "hub-forces", "vehicle": {"file": "r19_free"}, "road": {}}


def scene(**tables):
    return scene_of(BARE | {"run": {"duration": 0.06}} | tables)


def test_a_scene_chooses_whose_springs_it_has(monkeypatch):
    """Native unless it says compiled; an enforced tilt is compiled whatever the run before it was."""
    routes, real = [], running.HubModel
    monkeypatch.setattr(running, "HubModel", lambda *given: routes.append(given[4]) or real(*given))
    own, other = (run(scene(run={"duration": 0.06, "forces": route}), "mujoco") for route in ("native", "compiled"))
    assert routes == ["native", "native", "compiled", "compiled"]  # the virtual measurement, and the run
    assert 0.0 < np.abs(own.detail.states - other.detail.states).max() < 1e-10
    routes.clear()
    run(scene(stabilise={"method": "prescribed", "smoothing": 60.0}), "mujoco")
    assert routes == ["native", "compiled"]
    with pytest.raises(InputError, match=r"run\.forces"):
        scene(run={"duration": 0.06, "forces": "native"}, stabilise={"method": "prescribed"})


def test_an_enforced_tilt_is_refused_where_forces_are_in_two_places():
    car, guide = r19(), np.zeros((3, 6))
    with pytest.raises(Refused, match="enforced tilt"):
        build("mujoco", car, HubInputs(static_forces(car, 3).hubs, guide=guide), 1e-3, 1e-3, "native")


def test_show_tells_what_is_native_and_what_is_shared():
    told = describe(scene())
    for engine in NATIVE_ENGINES:
        assert f"native     {engine}: 21 of 21 springs, mounts and bars, 19 joints" in told
    assert "shared     hub forces, tyres on the road" in told
    told = describe(scene(run={"duration": 0.06, "forces": "compiled"}))
    assert "native     bodies and joints" in told and "shared     springs, mounts and bars" in told
