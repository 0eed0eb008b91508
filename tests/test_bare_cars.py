"""A bare car beside one written for it alone, and the arrays that its forces and those of hubs must not make."""

from dataclasses import replace

import numpy as np
import pytest

from models.engines import free_vehicle_mujoco
from models.engines.free_vehicle_mujoco import FreeMujoco
from models.multibody.numbers import Handling
from models.systems.handling.run import driven_model
from validation.absence import bare_cars, hand_built_handling, machinery


def test_the_written_car_moves_as_the_bare_one() -> None:
    ours, theirs = (np.hstack(job()) for job in bare_cars.car_runs(20))
    assert np.abs(ours - theirs).max() < 1e-11  # sums in another order; states up to 44 rad/s
    assert np.abs(ours[-1] - ours[0]).max() > 0.1  # nothing stands still


def test_a_car_of_other_springs_is_another_one(monkeypatch: pytest.MonkeyPatch) -> None:
    numbers_of = hand_built_handling.parameter_table

    def softer(own: Handling) -> np.ndarray:
        numbers = numbers_of(own)
        numbers[hand_built_handling.GENERAL_NUMBERS + 5] *= 0.999  # strut of the first wheel
        return numbers

    monkeypatch.setattr(hand_built_handling, "parameter_table", softer)
    ours, theirs = (np.hstack(job()) for job in bare_cars.car_runs(20))
    assert np.abs(ours - theirs).max() > 1e-7


def test_bodies_that_are_one_in_mujoco_move_as_they_do_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    own, q, v = bare_cars.start_state()
    rng = np.random.default_rng(1)
    q, v = q + rng.normal(0.0, 0.05, len(q)), v + rng.normal(0.0, 0.2, len(v))
    one = FreeMujoco(driven_model(own))
    merged = free_vehicle_mujoco.mergeable_carriers(own.vehicle)
    assert {"carrier", "sway"} < set(merged) and len(merged) == 6  # and the four wheels, whose rotors ride on them
    monkeypatch.setattr(free_vehicle_mujoco, "mergeable_carriers", lambda vehicle: {})
    apart = FreeMujoco(driven_model(own))
    assert apart.model.nbody - one.model.nbody == 6
    np.testing.assert_allclose(one.acceleration(0.0, q, v), apart.acceleration(0.0, q, v), rtol=1e-10, atol=1e-10)


def test_a_wheel_with_inertia_of_its_own_does_not_spin_with_its_rotor() -> None:
    own, _, _ = bare_cars.start_state()
    heavy = tuple(
        replace(body, inertia=((1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 1.0))) if body.name == "fl" else body
        for body in own.vehicle.bodies
    )
    assert "fl" not in free_vehicle_mujoco.mergeable_carriers(replace(own.vehicle, bodies=heavy))


def test_forces_of_cars_and_hubs_make_no_array() -> None:
    assert machinery.arrays_added_by_car() == 0
    assert [machinery.arrays_added_by_hubs(engine) for engine in ("reference", "mujoco")] == [0, 0]
