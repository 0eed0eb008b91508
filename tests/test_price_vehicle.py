"""The work-precision problem of the passenger car that is free on the road."""

import numpy as np
import pytest

from models.advice.price import runner as cost
from models.engines.spatial_protocol import ALLOWED_INTEGRATORS
from validation.price.problems import free_vehicle
from validation.price.problems.free_vehicle import COMPARED_GRID, FULL_STEPS, FreeVehicle, track_heights


def test_the_road_is_smooth_and_has_the_slope_that_it_says():
    """Central differences at 1 mm: their error is (2 pi / 2 m)^2 1e-6 / 6, some 2e-6 of the slope."""
    place = np.linspace(-2.0, 12.0, 57)
    for track in (0, 1):
        apart = track_heights(place + 1e-3, track)[0] - track_heights(place - 1e-3, track)[0]
        assert apart / 2e-3 == pytest.approx(track_heights(place, track)[1], abs=2e-6)
    assert abs(track_heights(place, 0)[0] - track_heights(place, 1)[0]).max() > 0.01
    assert abs(track_heights(-1.5, 0)[0]) < 1e-5, "the rear axle begins on the plane"


def test_every_method_of_both_engines_is_tried():
    tried = {(engine, method.split()[0]) for engine, method in FULL_STEPS}
    assert {(engine, method) for engine, methods in ALLOWED_INTEGRATORS.items() for method in methods} <= tried
    for steps in FULL_STEPS.values():
        assert all(step < 1e-5 or abs(COMPARED_GRID / step - round(COMPARED_GRID / step)) < 1e-9 for step in steps)


@pytest.mark.full
def test_engines_come_to_the_equations_by_hand(monkeypatch):
    """RK4 at 5 ms, whose error is 0.2 N of some 970 N; at 2.5 ms a sixteenth of that."""
    monkeypatch.setattr(free_vehicle, "REFERENCE_SOLVERS", (("DOP853", 1e-8, "by hand"), ("LSODA", 1e-9, "engine")))
    problem = FreeVehicle(False)
    assert problem.uncertainty["wheel load"] < 1e-3
    errors = [
        cost.attempt(problem, problem.setting("mujoco", "RK4", step)).errors["wheel load"] for step in (5e-3, 2.5e-3)
    ]
    assert errors[0] / errors[1] == pytest.approx(16, rel=0.1)
    assert cost.attempt(problem, problem.setting("exudyn", "RK44", 5e-3)).errors["wheel load"] == pytest.approx(
        errors[0], rel=1e-6
    )
    assert cost.attempt(problem, problem.setting("exudyn", "DOPRI5", 1e-6)).status == "refused"
