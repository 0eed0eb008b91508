"""The work-precision problem of an inertial unit, short: twenty seconds of its ten minutes."""

import numpy as np
import pytest

from models.advice.price import runner as cost
from validation.price.problems import inertial_unit
from validation.price.problems.inertial_unit import FULL_RATES, QUICK_RATES, InertialUnit, car_attitude, gyro


@pytest.fixture(scope="module")
def short():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(inertial_unit, "DURATION", 20.0)
        yield InertialUnit(True)


def test_the_closed_form_is_what_its_own_rates_turn(short):
    """Two families: Cardan angles, and a Magnus method that reads the rates alone."""
    assert short.uncertainty["attitude"] < 1e-12
    off = np.abs(gyro(np.array([0.3])) - gyro(np.array([0.3 + 1e-6])))
    assert off.max() > 1e-8, "a rate that a wrong formula could keep constant would show nothing"
    assert np.linalg.norm(car_attitude(np.array([0.0, 7.0])), axis=1) == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize(
    ("engine", "method", "order"),
    [
        ("reference", "held rates", 1),
        ("reference", "mean rates", 2),
        ("reference", "cubic rates", 4),
        ("exudyn", "RK44", 2),
        ("exudyn", "ExplicitEuler", 1),
        ("exudyn", "GeneralizedAlpha 0.9", 2),
        ("exudyn", "VelocityVerlet", 2),
        ("mujoco", "Euler", 1),
        ("mujoco", "RK4", 2),
    ],
)
def test_every_way_has_its_order(short, engine, method, order):
    coarse, fine = (cost.attempt(short, short.setting(engine, method, h)).errors["attitude"] for h in (0.02, 0.01))
    assert coarse / fine == pytest.approx(2**order, rel=0.08)


def test_adaptive_steps_are_refused_and_the_quick_share_is_one(short):
    assert cost.attempt(short, short.setting("exudyn", "DOPRI5", 0.01)).status == "refused"
    assert all(set(rates) <= set(FULL_RATES[curve]) for curve, rates in QUICK_RATES.items())
    assert short.setting("mujoco", "Euler", 2e-3).default == "MuJoCo"
