"""Controllers: phases at hand-made samples, estimates of speed, select low, and the five-phase limit cycle."""

import numpy as np
import pytest

from models.brake.brake import Brake
from models.brake.controller import SAMPLING_PERIOD, Sample
from models.brake.controllers import CONTROLLERS
from models.brake.controllers.acceleration_phases import AccelerationPhases
from models.brake.controllers.five_phase import FivePhase, phase_end_threshold, pressure_rate_of_phase
from models.brake.controllers.five_phase_cycle import WheelAtConstantSpeed, limit_cycle
from models.brake.controllers.per_wheel import SpeedEstimate
from models.brake.controllers.slip import SlipBangBang, SlipPI
from models.core.errors import InputError, RunFailed
from models.tyre.magic_formula import table_of_surface
from validation.braking.five_phase_exact import ExactWheel, last_control_cycle

PHASES = FivePhase(1, e1=20.0, e2=30.0, e3=20.0, e4=2.0, e5=60.0, falling=60.0, fast=40.0, slow=8.0)
LINE = Brake(push_out=0.0, release=0.0, rising=1500.0, falling=1500.0)


def given(wheels, speed=10.0, number=0, brake=True):
    return Sample(number, round(number * SAMPLING_PERIOD * 1e9), np.asarray(wheels, dtype=float), brake, 6.0, speed)


def test_bang_bang_has_hysteresis():
    controller = SlipBangBang(2, release=0.1, apply=0.05)
    said = [controller.sample(given([10.0 * (1.0 - s), 10.0])).valves.tolist() for s in (0.0, 0.07, 0.12, 0.07, 0.04)]
    assert said == [[1, 1], [1, 1], [-1, 1], [-1, 1], [1, 1]]


def test_select_low_gives_both_wheels_what_the_slower_needs():
    controller = SlipBangBang(4, select_low=(1,))
    assert controller.sample(given([10.0, 8.0, 8.0, 10.0])).valves.tolist() == [1, -1, -1, -1]


@pytest.mark.parametrize("name", sorted(set(CONTROLLERS) - {"none"}))
def test_slow_vehicle_is_braked_and_open_switch_releases(name):
    controller = CONTROLLERS[name](4)
    slow = controller.sample(given(np.zeros(4), speed=1.0))
    off = controller.sample(given(np.zeros(4), speed=10.0, brake=False))
    if slow.pressures is None:
        assert (slow.valves == 1).all() and (off.valves == -1).all()
    else:
        assert (slow.pressures == 6.0).all() and (off.pressures == 0.0).all()


def test_acceleration_phases_run_in_order():
    """A wheel that dives, recovers fast and settles: apply, hold, release, hold, apply, hold, a pulse."""
    controller = AccelerationPhases(1)
    falls = [0.0, -40.0, -40.0, -5.0, 10.0, 30.0, 10.0, 0.5]
    slips = [0.0, 0.01, 0.05, 0.06, 0.05, 0.02, 0.01, 0.0]
    logic = controller._loop._logics[0]
    said = [logic.decide(s, a, 10.0, 6.0) for s, a in zip(slips, falls, strict=True)]
    assert said == [1, 0, -1, 0, 0, 1, 0, 1]


def test_a_locked_wheel_is_released():
    """It neither falls nor rises: no threshold of acceleration would ever end its hold."""
    for controller in (AccelerationPhases(1), FivePhase(1)):
        logic = controller._loop._logics[0]
        said = [logic.decide(1.0, 0.0, 10.0, 6.0) for _ in range(5)]
        assert said[-1] == (-1 if isinstance(controller, AccelerationPhases) else 0.0)


def test_slip_pi_does_not_wind_up():
    controller = SlipPI(1)
    for _ in range(1000):
        most = controller.sample(given([10.0])).pressures[0]
    after = [controller.sample(given([7.0])).pressures[0] for _ in range(30)]
    assert most == 6.0 and after[-1] == 0.0


def test_estimate_does_not_go_down_with_wheels_that_lock_at_once():
    """Nothing is learnt yet: it falls by 6 m/s^2, where no vehicle exceeds 10."""
    estimate = SpeedEstimate(SAMPLING_PERIOD)
    found = [estimate.after([speed] * 4) for speed in np.maximum(15.0 - 60.0 * SAMPLING_PERIOD * np.arange(101), 0.0)]
    assert found[-1] == pytest.approx(15.0 - 6.0 * 100 * SAMPLING_PERIOD)


def test_estimate_is_the_fastest_rolling_wheel_and_learns_the_slope():
    """All wheels dip together every 0.3 s on a vehicle that slows by 2 m/s^2: within 2 % from the third dip on."""
    estimate, worst = SpeedEstimate(SAMPLING_PERIOD), 0.0
    for n in range(600):
        time = n * SAMPLING_PERIOD
        speed = 15.0 - 2.0 * time
        dip = 1.0 - 0.3 * max(np.sin(2.0 * np.pi * time / 0.3), 0.0)
        found = estimate.after([speed * dip] * 4)
        worst = max(worst, abs(found / speed - 1.0)) if time > 0.9 else worst
    assert worst < 0.02


@pytest.mark.parametrize(
    ("name", "parameters", "word"),
    [
        ("slip_bang_bang", {"release": 0.0}, "release"),
        ("slip_bang_bang", {"apply": 0.5}, "apply"),
        ("slip_bang_bang", {"select_low": (2,)}, "axles"),
        ("five_phase", {"e2": 1.0}, "above e1"),
        ("slip_pi", {"reset": -1.0}, "reset"),
        ("acceleration_phases", {"falls": 1.0}, "falls"),
        ("slip_pi", {"gain": 1e9}, "gain = 1000000000.0: must be above 0, at most 10000"),
        ("slip_pi", {"target": 0.1 + 0.2j}, "target = .*must be a number"),
        ("five_phase", {"e5": np.nan}, "e5"),
        ("slip_pi", {"mix": -1.0}, "mix = -1.0: must be 0 or more"),
        ("five_phase", {"deep": 1.5}, "at most 1"),
        ("acceleration_phases", {"rises": -2.0}, "rises"),
        ("acceleration_phases", {"pulse": 2.5}, "whole number"),
        ("slip_bang_bang", {"apply": "0.05"}, "must be a number"),
        ("five_phase", {"fast": True}, "must be a number"),
        ("five_phase", {"falling": np.inf}, "falling"),
        ("slip_pi", {"cut_off": 1e6}, "at most 100"),
    ],
)
def test_parameters_that_cannot_be_used(name, parameters, word):
    with pytest.raises(InputError, match=word):
        CONTROLLERS[name](4, **parameters)


def frozen(**changes):
    return WheelAtConstantSpeed(
        **{
            "speed": 11.11,
            "load": 16.8e3,
            "radius": 0.5,
            "inertia": 13.35,
            "brake": LINE,
            "tyre": table_of_surface("dry"),
            **changes,
        }
    )


def exact(wheel, controller=PHASES):
    phases = [(1500.0 * pressure_rate_of_phase(k, controller), *phase_end_threshold(k, controller)) for k in range(6)]
    forces = wheel.load * wheel.tyre.mu_x[0, 0]
    return last_control_cycle(
        ExactWheel(wheel.speed, wheel.radius, wheel.inertia, wheel.tyre.slips, forces), phases, 12
    )


@pytest.mark.grounds("closed form")
def test_limit_cycle_is_that_of_the_closed_form():
    own = limit_cycle(frozen(), PHASES, 1e-4)
    period, utilisation = exact(frozen())
    assert own.period == pytest.approx(period, rel=1e-5)  # 6e-7 found; a step of 0.1 ms, order two
    assert own.utilisation == pytest.approx(utilisation, rel=1e-5)
    other = exact(frozen(inertia=13.35 * 1.001))  # a wheel 0.1 % off is told by the bound that is promised
    assert abs(other[0] / own.period - 1.0) > 1e-4


def test_hysteresis_lengthens_the_cycle_and_a_wheel_that_locks_is_told():
    """Every turn of the pressure first crosses the loop, at rates that are known: the cycle becomes longer."""
    loop = Brake(push_out=0.75, release=0.71, rising=1500.0, falling=1500.0)
    assert limit_cycle(frozen(brake=loop), PHASES, 1e-4).period > limit_cycle(frozen(), PHASES, 1e-4).period
    hasty = FivePhase(1, e1=0.1, e2=30.0, e3=20.0, e4=2.0, e5=200.0, falling=60.0, fast=40.0, slow=8.0)
    with pytest.raises(RunFailed, match="phase"):
        limit_cycle(frozen(tyre=table_of_surface("ice")), hasty, 1e-4)
