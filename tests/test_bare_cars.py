"""A bare car beside one written for it alone, and the arrays that its forces and those of hubs must not make."""

import numpy as np
import pytest

from models.handling.numbers import Handling
from validation.absence import bare_cars, hand_built_handling, machinery


def test_the_written_car_moves_as_the_bare_one() -> None:
    ours, theirs = (job() for job in bare_cars.cars(20))
    assert np.abs(ours - theirs).max() < 1e-11  # sums in another order; states up to 44 rad/s
    assert np.abs(ours[-1] - ours[0]).max() > 0.1  # nothing stands still


def test_a_car_of_other_springs_is_another_one(monkeypatch: pytest.MonkeyPatch) -> None:
    numbers_of = hand_built_handling.numbers_of

    def softer(own: Handling) -> np.ndarray:
        numbers = numbers_of(own)
        numbers[hand_built_handling.HEAD + 5] *= 0.999  # strut of the first wheel
        return numbers

    monkeypatch.setattr(hand_built_handling, "numbers_of", softer)
    ours, theirs = (job() for job in bare_cars.cars(20))
    assert np.abs(ours - theirs).max() > 1e-7


def test_forces_of_cars_and_hubs_make_no_array() -> None:
    assert machinery.made_by_car() == 0
    assert [machinery.made_by_hubs(engine) for engine in ("reference", "mujoco")] == [0, 0]
