"""The plain nonlinear bicycle with ideal rolling: energy, contacts, its linearisation, what ends a run."""

import numpy as np
import pytest

from models.bicycle.four_bodies import LEAN, STEER
from models.bicycle.ideal_rolling import IdealBicycle
from models.bicycle.whipple import SteeringControl, load_bicycle
from models.core.errors import RunFailed

BENCHMARK, DELFT = load_bicycle("benchmark"), load_bicycle("steer_by_wire")


def heights(model, q):
    """(2,) m of both contacts above the ground."""
    return model.contacts(model.bodies.move(q, np.zeros(9)))[0]


def linearised(model, speed):
    """(4, 4) of (lean, steer to the right, and their rates), by central differences of 1e-5."""
    columns = []
    for state in np.eye(4):
        ends = []
        for sign in (1e-5, -1e-5):
            lean, steer, lean_rate, steer_rate = sign * state
            start = model.upright(speed, lean_rate, lean, -steer)
            start[10] = -steer_rate
            rates = model.rates(0.0, start)
            ends.append([rates[LEAN], -rates[STEER], rates[9], -rates[10]])
        columns.append(np.subtract(*ends) / 2e-5)
    return np.transpose(columns)


@pytest.mark.grounds("plain counterpart")
@pytest.mark.parametrize("bicycle", [BENCHMARK, DELFT], ids=["benchmark", "steer_by_wire"])
def test_its_linearisation_is_the_linear_model(bicycle):
    # differences over 1e-5 of accelerations of up to 1e2 leave 1e-9
    control = SteeringControl(gain=2.0, friction=0.1)
    matrix = linearised(IdealBicycle(bicycle, control), 3.0)
    assert np.abs(matrix - bicycle.state_matrix(3.0, control)).max() < 1e-7


def test_a_planted_fault_shows_in_the_linearisation():
    other = BENCHMARK.changed(trail=1.001 * BENCHMARK.trail)
    assert np.abs(linearised(IdealBicycle(other), 3.0) - BENCHMARK.state_matrix(3.0)).max() > 1e-3


def test_energy_and_contacts_are_kept():
    model = IdealBicycle(BENCHMARK)
    motion = model.run(model.upright(4.6, 0.5), 1.0, 21)
    assert np.abs(motion.energy / motion.energy[0] - 1.0).max() < 1e-9
    assert max(np.abs(heights(model, row)).max() for row in motion.positions) < 1e-10
    assert np.abs(motion.positions[:, LEAN]).max() > 0.1


def test_a_start_beyond_upright_has_both_wheels_on_the_ground():
    model = IdealBicycle(BENCHMARK)
    assert np.abs(heights(model, model.upright(4.6, lean_angle=0.4, steer_angle=0.5)[:9])).max() < 1e-14


def test_a_bicycle_at_standstill_falls_and_says_when():
    model = IdealBicycle(BENCHMARK)
    with pytest.raises(RunFailed, match="fallen over"):
        model.run(model.upright(0.0, 0.1), 3.0, 11)
