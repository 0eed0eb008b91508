"""A braked quarter vehicle: the quick case passes, and what it judges by can see what it is there to see."""

import numpy as np
import pytest

from models.brake.quarter import QuarterPath, QuarterStop, QuarterVehicle
from models.brake.relaxation import compiled_lagging_samples
from models.brake.samples import compiled_plane_samples
from models.core.errors import InputError
from models.tyre.tyre_table import TyreTable, stacked_tables
from validation.braking.quarter_stops import LITERAL, exact_distance, stopping_distance
from validation.cases import braking_stop as case


def test_all_rows_pass(tmp_path):
    rows, data = case.measure(True, tmp_path)
    assert [row.reason for row in rows if row.status in ("failed", "not run")] == []
    assert len(case.tables(data)[0].rows) == 16


def test_the_literal_scheme_would_fail():
    tyre, _ = case.friction_table("dry")
    torque = case.steady_torque(case.FRONT_WHEEL, tyre, 0.06)[1]
    error = (
        stopping_distance(LITERAL, case.FRONT_WHEEL, tyre, torque, 22.22, case.PAPER_STEP)[0]
        / exact_distance(case.FRONT_WHEEL, tyre, torque, 22.22)
        - 1
    )
    assert 0.05 < error < 0.08  # 6.4 %: force of the start of the step on the vehicle


def test_the_exact_way_of_a_wheel_that_locks_at_once_is_that_of_sliding():
    tyre, _ = case.friction_table("ice")
    slide = 11.11**2 / (2.0 * case.GRAVITY * float(tyre.mu_x[0, 0, -1]))
    assert exact_distance(case.FRONT_WHEEL, tyre, 1e7, 11.11) == pytest.approx(
        slide, rel=1e-4
    )  # it locks within a millisecond


@pytest.mark.parametrize(
    ("row", "part", "value", "said"),
    [
        (2, "turning", -1e-9, "turns backwards"),
        (1, "turning", 20.1, "turns faster than it rolls"),
        (3, "speed", 1e-4, "creeps"),
        (3, "position", 5.001, "creeps"),
        (1, "speed", np.nan, "no number"),
    ],
)
def test_each_rule_of_a_stop_is_seen_to_break(row, part, value, said):
    path = QuarterPath(
        time=np.array([0.0, 0.5, 1.0, 1.5]),
        position=np.array([0.0, 4.0, 5.0, 5.0]),
        speed=np.array([10.0, 5.0, 0.0, 0.0]),
        turning=np.array([20.0, 9.0, 0.0, 0.0]),
        locked=np.zeros(4),
    )
    assert case.broken_plausibility_rules(QuarterStop(path, 2), 0.5, True) == []
    getattr(path, part)[row] = value
    assert said in case.broken_plausibility_rules(QuarterStop(path, 2), 0.5, True)


def test_a_torque_that_drives_is_refused():
    with pytest.raises(InputError, match="brake opposes"):
        case.stop_of_quarter_vehicle(
            case.FRONT_WHEEL,
            case.friction_table("ice")[1],
            case.UNIFORM_ROAD,
            np.array([0.0, -1.0]),
            case.PAPER_STEP,
            10.0,
        )


def test_compiled_samples_are_kept_on_disk_for_other_processes():
    """Numba knows a function by the cells of its closure too, and those of compiled functions differ by process."""
    assert (
        compiled_plane_samples.march.py_func.__closure__ is None is compiled_lagging_samples.march.py_func.__closure__
    )
    assert compiled_plane_samples.march.py_func.__qualname__ != compiled_lagging_samples.march.py_func.__qualname__


def test_a_brake_that_holds_a_small_wheel_just_at_the_friction_of_a_locked_one():
    """Its slip tends to 1, and by rounding must not go beyond; the stop is then that of a locked wheel."""
    rising = TyreTable([0.0], [0.0, 0.1, 1.0], [1e4], [[[0.0, 0.2, 0.9]]], [[1.0, 1.0, 1.0]], [[0.0]])
    quarter, tables = QuarterVehicle(mass=300.0, radius=0.3, spin_inertia=1e-4), stacked_tables([rising])
    locking = 0.9 * quarter.mass * case.GRAVITY * quarter.radius
    for step in (1e-3, 1.3e-2):
        stop = case.stop_of_quarter_vehicle(
            quarter, tables, case.UNIFORM_ROAD, np.full(int(2.2 / step), locking), step, 17.3
        )
        assert stop.step_of_rest > 0 and stop.distance == pytest.approx(17.3**2 / (2.0 * 0.9 * case.GRAVITY), rel=1e-3)
