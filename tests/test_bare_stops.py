"""A bare stop is that of a truck written for it alone, and asking a steady controller in every sample changes none."""

import numpy as np
import pytest

from models.brake.controller import Command, NoAntiLock
from models.brake.port.ask import CheckedController
from models.systems.braking.procedures import vehicle_and_start_state
from validation.absence.braking import STOP
from validation.absence.hand_built_braking import ratio_of_stops
from validation.absence.of_systems import bare_scene


def test_a_steady_controller_is_asked_once_and_drives_as_one_that_is_asked_in_every_sample():
    scene = bare_scene("braking")
    vehicle, start = vehicle_and_start_state(scene, STOP)
    once, always = (vehicle.run(own, start) for own in (NoAntiLock(4), CheckedController(NoAntiLock(4))))
    assert len(once.times) == len(always.times) > 200
    for name in ("times", "states", "turning", "pressures", "torques", "reports"):
        assert np.array_equal(getattr(once, name), getattr(always, name))


def test_a_controller_derived_from_a_steady_one_is_asked_in_every_sample():
    class Releasing(NoAntiLock):
        def sample(self, given):
            return Command(valves=np.full(self.wheels, 1 if given.number < 10 else -1))

    vehicle, start = vehicle_and_start_state(bare_scene("braking"), STOP)
    always, given = (vehicle.run(own, start, 1.0) for own in (NoAntiLock(4), Releasing(4)))
    assert given.torques[-1].max() < always.torques[-1].min()


@pytest.mark.full
def test_the_stop_written_by_hand_is_the_bare_one():
    gap, _ = ratio_of_stops(3.0, 1)
    assert gap < 1e-11  # rounding
