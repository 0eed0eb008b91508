"""The compiled wheelset held to its plain counterpart: contacts, rates, joint forces, march; rest on profiles."""

import numpy as np
import pytest

from models.rail import equations as eq
from models.rail.equations import WheelsetEquations
from models.rail.joint_forces import JOINTS, joint_force_table, joints_from_states, set_joint_forces
from models.rail.laid_profiles import CrossSections
from models.rail.wheelset import CHOSEN_WHEELSET
from validation.wheelset.plain_wheelset import PlainWheelset

pytestmark = pytest.mark.grounds("plain counterpart")
ENDS = np.array([0.009, 6e-5, 4e-4, 0.02, 3.0, 0.2, 0.05, 0.5, 0.5, 1.5])
"""Largest displacements and rates of the states: both flanges, wheels in the air, sliding."""
CELLS = 7


def states(wheelset, speed, count, seed=11):
    """States (count, 10) about rolling without slip."""
    random = np.random.default_rng(seed).uniform(-1.0, 1.0, (count, 10)) * ENDS
    random[:, eq.Z] += 5e-5
    random[:, eq.ROLL] -= wheelset.roll_per_displacement * random[:, eq.Y]
    random[:, eq.SPIN] -= speed / wheelset.radius
    return random


def both(speed, law, lean=0.0, wheelset=CHOSEN_WHEELSET):
    return WheelsetEquations(wheelset, speed, law, CELLS, lean), PlainWheelset(wheelset, speed, law, CELLS, lean)


@pytest.mark.parametrize(
    ("speed", "law", "lean"),
    [
        (40.0, "linear", 0.0),
        (0.04, "linear", 0.02),
        (-30.0, "linear", 0.0),
        (40.0, "fastsim", 0.02),
        (-0.03, "fastsim", 0),
    ],
)
def test_rates_and_contacts_are_those_of_plain_vectors(speed, law, lean):
    compiled, plain = both(speed, law, lean)
    drawn = states(CHOSEN_WHEELSET, speed, 12)
    rates, contacts = compiled.at(drawn)
    expected = np.array([plain.rates(state) for state in drawn])
    # the penetration is a difference of metres: 1e-16 m of 1e-4 m, to the power 3/2; FASTSIM has its corners
    assert rates == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())
    patches = [[each.contact_quantities for each in plain.patches(state)] for state in drawn]
    for name in patches[0][0]:
        wanted = np.array([[each[name] for each in pair] for pair in patches])
        assert contacts[name] == pytest.approx(wanted, abs=1e-9 * np.abs(wanted).max()), name
    assert (contacts["load"] == 0.0).any() and (contacts["flange_force"] != 0.0).any()


def test_joint_forces_of_the_engines_are_the_rails_by_virtual_work():
    compiled, plain = both(25.0, "fastsim")
    numbers = joint_force_table(25.0, compiled.rails)
    for state in states(CHOSEN_WHEELSET, 25.0, 6):
        block = np.concatenate((np.full(JOINTS, 7.0), joints_from_states(state), numbers))
        set_joint_forces(block.ctypes.data, 0.0, JOINTS)
        expected = plain.rail_forces_on_coordinates(state)
        assert block[:JOINTS] == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


def test_a_march_is_the_classical_runge_kutta_method_of_the_plain_rates():
    compiled, plain = both(40.0, "linear")
    start = compiled.displaced_state(4e-3)
    path = compiled.run(start, 0.012, 4e-4, 3).states
    assert path == pytest.approx(plain.run(start, 4e-4, 30)[::3], abs=1e-11)


def test_profiles_carry_the_load_at_the_height_where_the_springs_bear_no_more():
    """In the middle of the track, without rates: the vertical parts of the normal forces are the load."""
    compiled = WheelsetEquations(CHOSEN_WHEELSET.changed(profiles=CrossSections()), 40.0, "linear")
    state = np.zeros(eq.STATE_COUNT)
    state[eq.Z], state[eq.SPIN] = compiled.body.rest_height, -40.0 / CHOSEN_WHEELSET.radius
    contacts = compiled.at(state[None])[1][0]
    assert contacts["load"] @ np.cos(contacts["angle"]) == pytest.approx(CHOSEN_WHEELSET.load, rel=1e-9)
