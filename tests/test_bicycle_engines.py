"""The bicycle on tyres in both engines: its limit, its ledger, faults, and scenes that cannot be."""

import numpy as np
import pytest

from models.bicycle.four_bodies import FRONT
from models.bicycle.rolling_tyres import BicycleTyre, RollingBicycle
from models.bicycle.whipple import SteeringControl, load_bicycle
from models.core.errors import InputError, RunFailed
from models.multibody.forces import OF_TYRES, RADIUS
from models.systems.bicycle.plan import check
from models.systems.bicycle.run import engine_eigenvalues, run
from models.systems.bicycle.scene import build

BENCHMARK = load_bicycle("benchmark")
SHORT = {"title": "short", "system": "bicycle", "run": {"duration": 0.2}}


@pytest.mark.parametrize("engine", ["exudyn", "mujoco"])
def test_stiff_tyres_tend_to_ideal_rolling_with_order_one(engine):
    stiff = [RollingBicycle(BENCHMARK, BicycleTyre(stiffness=s), SteeringControl(friction=0.1)) for s in (16.0, 64.0)]
    wanted = BENCHMARK.eigenvalues(5.0, SteeringControl(friction=0.1))
    gaps = [np.abs(engine_eigenvalues(engine, rolling, 5.0) - wanted).max() for rolling in stiff]
    assert np.log(gaps[0] / gaps[1]) / np.log(4.0) == pytest.approx(1.0, abs=0.02)
    stiff[1].numbers[int(stiff[1].numbers[OF_TYRES]) + RADIUS] *= 1.01  # a planted fault: the rear wheel
    assert np.abs(engine_eigenvalues(engine, stiff[1], 5.0) - wanted).max() > 1.2 * gaps[1]


@pytest.mark.parametrize("engine", ["exudyn", "mujoco"])
def test_the_ledger_closes(engine):
    ride = run(build(SHORT), engine).detail
    assert ride.unaccounted() < 1e-11
    assert ride.work[-1] < 0.0 and np.abs(ride.rates[:, FRONT]).min() > 10.0


def test_engines_agree_and_both_are_near_ideal_rolling():
    one, other, ideal = (run(build(SHORT), engine) for engine in ("exudyn", "mujoco", "reference"))
    assert np.abs(one["lean"] - other["lean"]).max() < 1e-12
    assert 1e-6 < np.abs(one["lean"] - ideal["lean"]).max() < 5e-3


def test_the_control_takes_part_in_the_ledger_and_the_encoder_tells_its_share():
    control = {"gain": 2.0, "dry_friction": 0.2, "encoder_gain": 0.8}
    result = run(build({**SHORT, "control": control}), "mujoco")
    assert result.detail.unaccounted() < 1e-9
    assert result["encoder"] == pytest.approx(0.8 * result["steer"])


def test_a_bicycle_at_standstill_falls_over():
    with pytest.raises(RunFailed, match="fallen over"):
        run(build({**SHORT, "run": {"speed": 0.0, "duration": 1.5, "step": 1e-4}}), "mujoco")


def test_steps_that_are_too_long_at_standstill_are_no_answer():
    with pytest.raises(RunFailed, match="unaccounted for: shorten"):
        run(build({**SHORT, "run": {"speed": 0.0, "duration": 0.7, "step": 1e-3}}), "mujoco")


def test_wheels_without_inertia_are_for_linear_equations():
    wheel = BENCHMARK.front_wheel.model_copy(update={"Iyy": 0.0})
    with pytest.raises(InputError, match=r"front_wheel\.Iyy = 0.0: must be above 0 in engines"):
        RollingBicycle(BENCHMARK.changed(front_wheel=wheel))


def test_a_rider_before_the_front_wheel_is_refused():
    body = BENCHMARK.body.model_copy(update={"x": 2.0})
    with pytest.raises(InputError, match=r"rear wheel = .*carries no weight"):
        RollingBicycle(BENCHMARK.changed(body=body))


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({"run": {"step": 3e-4, "duration": 0.1}}, "must divide run.duration"),
        ({"run": {"speed": 500.0}}, "run.speed = 500.0: must be from -100 to 100 m/s"),
        ({"speeds": {"start": 5.0, "stop": 1.0}}, "must be above speeds.start"),
        ({"control": {"torque_gain": 0.9}}, "needs the effect 'feedback'"),
        ({"bicycle": {"parameters": "penny"}}, "must be a TOML file"),
    ],
)
def test_a_scene_that_cannot_be_is_refused(table, said):
    with pytest.raises(InputError) as refused:
        check(build({**SHORT, **table}, "mine.toml"), ("mujoco",))
    assert said in str(refused.value)
