"""A wheelset on profiles: contact against the exact table, engines against the equations, power and energy."""

import math

import numpy as np
import pytest

from models.core.errors import InputError
from models.engines.wheelset import ExudynWheelset, MujocoWheelset
from models.rail import equations as eq
from models.rail import wheel_forces as wf
from models.rail.energy import energy_ledger
from models.rail.equations import WheelsetEquations
from models.rail.laid_profiles import CrossSections
from models.rail.linear import klingel_wavelength
from models.rail.profile_contact import TOUCH_RECORD, WheelPose, normal_force_and_axes
from models.rail.profile_statics import static_equilibrium, steering_cones
from models.rail.wheelset import CHOSEN_WHEELSET
from validation.contact.manchester_references import SCENE, placement_at

ON_PROFILES = CHOSEN_WHEELSET.changed(profiles=CrossSections())
FREE = ON_PROFILES.changed(**{f"{kind}_{axis}": 0.0 for kind in ("stiffness", "damping") for axis in "xyz"})
LIVELY = np.array([4e-3, 4e-5, 1e-4, 3e-3, 3.0, 0.05, 0.02, 0.05, 0.05, 0.5])
FLANGE = math.radians(-45.0)


def against_table(shifts):
    """Forces within 2 % and places within 0.3 mm of the exact contact, wheel by wheel."""
    for shift in shifts:
        one = placement_at("A-1", shift)
        found = static_equilibrium(ON_PROFILES.changed(load=2e4), shift)
        loads, places = found.loads.reshape(2, -1), found.touches["y"].reshape(2, -1)
        for k, wheel, side in ((0, one.right, 1), (1, one.left, -1)):
            whole = sum(place.normal for place in wheel)
            assert loads[k].sum() == pytest.approx(whole, rel=0.02)  # 1.5 % at the flange, else 0.2 %
            y = side * (places[k] + shift) @ loads[k] / loads[k].sum()
            assert y == pytest.approx(sum(place.normal * place.y for place in wheel) / whole, abs=3e-4)
            assert np.count_nonzero(loads[k] > 0.0) == len(wheel)


def test_two_patches_as_in_the_table():
    against_table([5e-3])
    parts = static_equilibrium(ON_PROFILES.changed(load=2e4), 5e-3).loads[:2]
    assert 100.0 < parts.min() < 200.0  # 150 N; without the other patch's depression 500 N


@pytest.mark.full
def test_manchester_places_and_forces():
    against_table(SCENE.positions.values().tolist())


def test_lateral_force_is_the_slope_of_the_energy():
    """What it takes to hold the smooth wheelset sideways, by the normals and by the energy of load and contacts."""

    def energy(shift):
        one = static_equilibrium(ON_PROFILES, shift)
        depth = np.maximum(one.touches["depth"], 0.0)
        return 0.4 * one.loads @ depth - ON_PROFILES.load * one.z

    h = 5e-5
    for shift in (3e-3, 6e-3, 9e-3):
        one, before, after = (static_equilibrium(ON_PROFILES, shift + part * h) for part in (0.0, -1.0, 1.0))
        assert one.loads @ one.touches["n_z"] == pytest.approx(ON_PROFILES.load, rel=1e-8)
        across, down = -one.loads * one.touches["n_y"], -one.loads * one.touches["n_z"]
        moment = (one.touches["y"] * down - one.touches["z"] * across).sum()
        work = -across.sum() - moment * (after.roll - before.roll) / (2.0 * h)
        # The elastic energy of means is not quite one: 0.9 % seen at 3 mm, 2.0 % at 6 mm, of 4 and of 27 kN.
        assert work == pytest.approx((energy(shift + h) - energy(shift - h)) / (2.0 * h), rel=0.03)


def test_mirror():
    equations, draw = WheelsetEquations(ON_PROFILES, 50.0), np.random.default_rng(3)
    mirror = np.array([-1, 1, -1, -1, 1, -1, 1, -1, -1, 1])
    for state in equations.rest + LIVELY * draw.normal(size=(20, eq.STATE_COUNT)):
        one, two = equations.rates(state), mirror * equations.rates(mirror * state)
        assert np.abs(one - two).max() <= 1e-13 * np.abs(one).max()


@pytest.mark.parametrize("engine", [MujocoWheelset, ExudynWheelset])
def test_accelerations_are_those_of_the_equations(engine):
    written, built = WheelsetEquations(ON_PROFILES, 50.0), engine(ON_PROFILES, 50.0)
    states = written.rest + LIVELY * np.random.default_rng(4).normal(size=(60, eq.STATE_COUNT))
    states[::3, [eq.Y, eq.Z, eq.ROLL]] += [6.5e-3, -6e-4, -1e-3]
    contact, out, seen = written.empty_contacts(), np.empty(eq.STATE_COUNT), []
    for state in states:
        eq.fill_rates(state, *written.parameters, out, contact)
        seen.append(contact.copy())
        expected = out[[eq.Y_RATE, eq.Z_RATE, eq.ROLL_RATE, eq.YAW_RATE, eq.SPIN]]
        found = built.rates(state)[[eq.Y_RATE, eq.Z_RATE, eq.ROLL_RATE, eq.YAW_RATE, eq.SPIN]]
        assert np.abs(found - expected).max() <= 1e-11 * np.abs(expected).max()
    seen = np.array(seen)
    assert (seen["angle"] < FLANGE).any()
    assert ((seen["load"][:, :2] > 0.0).all(axis=1)).any()


def test_paths_over_a_second_with_flange_contact():
    kinds = (WheelsetEquations, MujocoWheelset, ExudynWheelset)
    built = [kind(ON_PROFILES, 40.0, cells=7) for kind in kinds]
    start = built[0].displaced_state(6e-3)
    start[eq.Y_RATE] = 0.1
    reference, mujoco, exudyn = (one.run(start, 1.0, 2.5e-4) for one in built)
    right = reference.contacts[:, :2]
    assert right["angle"].min() < math.radians(-38.0)  # in the flange's throat
    assert (right["load"] > 0.0).all(axis=1).any()
    assert right["load"].max() > 9e4
    for path in (mujoco, exudyn):
        # 4e-11 seen; with 230 kN on the flange's face of 70 degrees rounding grows to 1e-9 and more.
        assert np.abs(path.states - reference.states).max() < 1e-10
    for path in (reference, mujoco, exudyn):
        assert (path.contacts["power"] <= 0.0).all() and (path.contacts["damping_power"] <= 0.0).all()


def worst(wheelset, speed, law, shift, step, duration):
    equations = WheelsetEquations(wheelset, speed, law, 7)
    found = energy_ledger(equations, equations.run(equations.displaced_state(shift), duration, step))
    return float(np.abs(found.residual).max()), found


@pytest.mark.parametrize("wheelset", [CHOSEN_WHEELSET, ON_PROFILES], ids=["cones", "profiles"])
def test_ledger_closes_to_the_order_of_rk4(wheelset):
    (one, _), (two, found) = (worst(wheelset, 40.0, "linear", 2e-3, step, 0.1) for step in (4e-4, 2e-4))
    assert math.log2(one / two) > 3.7  # 4.02 on cones; steps of 1e-4 leave 3e-9 J, half of it rounding
    assert two < 1e-4 * np.ptp(found.creep)


def test_ledger_with_friction_and_flange():
    """FASTSIM's kinks do not keep the ledger open; Hertz' first touch takes half an order: 3.3 seen."""
    (one, _), (two, found) = (worst(ON_PROFILES, 50.0, "fastsim", 5e-3, step, 0.4) for step in (4e-4, 2e-4))
    assert two < one / 2.0**3
    assert two < 2e-5 * (found.creep + found.contact_damping)[-1]
    assert np.ptp(found.contacts) > 20.0  # J: the flange is pressed


def test_standstill_reversal_and_lift_off():
    equations = WheelsetEquations(ON_PROFILES, 50.0)
    _, *given = equations.parameters
    state, contact = equations.displaced_state(5e-3), equations.empty_contacts()
    state[eq.SPIN] = 0.0
    found = []
    for speed in (-1e-9, 0.0, 1e-9):
        out = np.empty(eq.STATE_COUNT)
        eq.fill_rates(state, speed, *given, out, contact)
        found.append(out)
    assert np.isfinite(found).all()
    np.testing.assert_allclose(found, np.broadcast_to(found[1], (3, eq.STATE_COUNT)), rtol=1e-6, atol=2e-3)
    state[eq.Z] -= 1e-2
    rates = equations.rates(state)
    assert np.isfinite(rates).all()
    assert rates[eq.SPIN] == 0.0  # nothing touches
    path = WheelsetEquations(ON_PROFILES, 40.0, cells=7).run(
        equations.rest - 2e-4 * np.eye(eq.STATE_COUNT)[eq.Z], 0.05, 2e-4
    )
    assert (path.contacts["load"][0] == 0.0).all()
    assert (path.contacts["load"][-1, [1, 3]] > 0.0).all()


def test_load_passes_between_patches_without_a_jump():
    rails = wf.rails_of(ON_PROFILES)
    modulus = float(rails.wheels["modulus"][0])
    loads = []
    for shift in np.arange(4.6e-3, 5.2e-3, 1e-6):
        touches = np.zeros(4, TOUCH_RECORD)
        wf.contact_points(WheelPose(shift, -1.1e-4, -3.6e-4, 0.0), rails, touches)
        loads.append(
            [normal_force_and_axes(touch.depth, touch.along, touch.across, modulus)[0] for touch in touches[:2]]
        )
    loads = np.array(loads)
    assert (loads > 0.0).any(axis=0).all()
    assert loads[0, 0] == 0.0
    assert np.abs(np.diff(loads, axis=0)).max() < 0.01 * loads.sum(axis=1).max()


def test_wave_is_that_of_the_cones_that_steer_alike():
    cones = steering_cones(ON_PROFILES, 3e-3)
    equations = WheelsetEquations(FREE, 10.0, "linear")
    path = equations.run(equations.displaced_state(3e-3), 1.8, 4e-4)
    y = path.states[:, eq.Y]
    crossing = path.times[1:][(y[1:] < 0.0) != (y[:-1] < 0.0)]
    # The first harmonic leaves out the others, and the amplitude falls: 3.5 % seen, where the profiles bear 0.16.
    assert 10.0 * 2.0 * np.diff(crossing)[1] == pytest.approx(klingel_wavelength(cones), rel=0.06)
    assert 0.15 < cones.equivalent_conicity < 0.2


def test_what_is_no_profile_is_refused():
    with pytest.raises(InputError, match="built in"):
        static_equilibrium(CHOSEN_WHEELSET.changed(profiles=CrossSections(wheel="S1003")), 0.0)
    with pytest.raises(InputError, match="cones"):
        static_equilibrium(CHOSEN_WHEELSET, 0.0)
