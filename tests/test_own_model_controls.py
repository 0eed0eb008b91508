"""Controls from a CSV: held between its rows in every build as MuJoCo holds them in the file's own model."""

import numpy as np
import pytest

from models.core.errors import InputError
from models.own_model import path as marching
from models.own_model.control_table import PathSection, constant_sections, read_controls, with_constant_controls
from models.own_model.file import read_model_file
from models.own_model.path import FILE_BUILD_NAME, compare_paths
from models.own_model.states import random_states
from validation.own_model.files import CART

DRIVEN = CART.replace('<mujoco model="cart">', '<mujoco model="cart"><compiler autolimits="true"/>').replace(
    "</worldbody>",
    """</worldbody>
<tendon><fixed name="both"><joint joint="x" coef="2"/><joint joint="tilt" coef="-1"/></fixed></tendon>
<actuator><motor name="push" joint="x" gear="2"/><position name="hold" joint="tilt" kp="3" kv=".1" ctrlrange=".1 1"/>
<general name="soft" tendon="both" gaintype="affine" gainprm="1 .4 -.2" biastype="none" biasprm="7 7 7"/>
<velocity joint="x" kv=".3"/></actuator>""",
)
"""Actuators with a fixed and an affine gain, with and without a bias, one with a range that has no 0, one unnamed."""
TABLE = """time [ms],soft [N],push [N],hold [rad],actuator 3 [m/s]
0,1,0,.2,0
100,-3,.5,1,1
350,0,-4,.1,-2
700,2,1,.9,0
1500,9,9,.9,9
"""


@pytest.fixture
def twin(tmp_path):
    (tmp_path / "cart.xml").write_text(DRIVEN)
    (tmp_path / "controls.csv").write_text(TABLE)
    return read_model_file(tmp_path / "cart.xml").twin


def test_every_build_has_the_path_of_the_file_under_its_controls(twin, tmp_path):
    """The file's own model takes the controls themselves, the builds have them in the bias of their actuators."""
    table = read_controls(tmp_path / "controls.csv", twin.model)
    report = compare_paths(twin, control_table=table)
    assert report.alike and not report.failed and report.comparison_horizon == 1.0
    assert report.distances[FILE_BUILD_NAME] < 1e-12
    assert report.energy < 1e-5  # Simpson's rule over odd numbers of steps of 2 ms; 6e-8 at 1 ms
    assert "under controls.csv" in report.lines()[0]
    assert report.distances != compare_paths(twin).distances


@pytest.mark.parametrize("fault", ["late", "constant", "small"])
def test_controls_of_another_build_are_told(twin, tmp_path, monkeypatch, fault):
    """The faults: controls that come a step late, none at all, or 1e-6 off, in the builds and not in the file."""
    table = read_controls(tmp_path / "controls.csv", twin.model)

    def wrong(legs, *words):
        factors = {"late": 1.0, "constant": 0.0, "small": 1.0 + 1e-6}
        changed = [leg._replace(twin=with_constant_controls(twin, factors[fault] * leg.controls)) for leg in legs]
        first, *rest = changed
        late = [
            first._replace(step_count=first.step_count + 1),
            *rest[:-1],
            rest[-1]._replace(step_count=rest[-1].step_count - 1),
        ]
        return honest(late if fault == "late" else changed, *words)

    honest = marching.path_of_build
    monkeypatch.setattr(marching, "path_of_build", wrong)
    report = compare_paths(twin, control_table=table)
    assert not report.alike and report.distances[FILE_BUILD_NAME] > 1e-8


def test_the_ledger_sees_other_controls(twin, tmp_path):
    """The fault: work of the constant controls of the file."""
    legs = read_controls(tmp_path / "controls.csv", twin.model).path_sections(twin, 500, 0.002)
    path = marching.path_of_build(legs, "plain", tuple(rows[0] for rows in random_states(twin, 1)), 0.002)
    assert (
        marching._energy_imbalance(legs, path, 0.002)
        < 1e-5
        < 1e-2
        < marching._energy_imbalance(constant_sections(twin, 500), path, 0.002)
    )


def test_rows_become_legs_that_fill_the_path(twin, tmp_path):
    legs = read_controls(tmp_path / "controls.csv", twin.model).path_sections(twin, 500, 0.002)
    assert [leg.step_count for leg in legs] == [50, 125, 175, 150] and all(isinstance(leg, PathSection) for leg in legs)
    assert np.array_equal(legs[1].controls, [0.5, 1.0, -3.0, 1.0])  # in the order of the actuators


@pytest.mark.parametrize(
    "old,new,said",
    [
        ("time [ms]", "time [h]", "unit"),
        ("push [N]", "pusch [N]", "did you mean 'push'"),
        ("push [N]", "push [kg]", "kg"),
        ("0,1,0,.2,0", "10,1,0,.2,0", "the first row must be of time 0"),
        ("350,0", "50,0", "line 4"),
        (".1,-2", "nan,-2", "nan"),
        ("-4,.1", "-4,1.5", "row 3, column 'hold' = 1.5: its range is from 0.1 to 1"),
        (",actuator 3 [m/s]", "", "actuator 3"),
    ],
)
def test_a_mistake_names_its_place(twin, tmp_path, old, new, said):
    path = tmp_path / "controls.csv"
    path.write_text(TABLE.replace(old, new, 1))
    with pytest.raises(InputError) as told:
        read_controls(path, twin.model)
    assert said in str(told.value) and "controls.csv" in str(told.value)


def test_a_row_between_two_steps_is_refused(twin, tmp_path):
    path = tmp_path / "controls.csv"
    path.write_text(TABLE.replace("350", "351"))
    with pytest.raises(InputError, match=r"row 3.*0\.351.*multiples of the step, 0\.002 s"):
        compare_paths(twin, control_table=read_controls(path, twin.model))


@pytest.mark.parametrize("name", ["time", "actuator 3"])
def test_columns_of_one_name_are_refused(tmp_path, name):
    (tmp_path / "cart.xml").write_text(DRIVEN.replace('name="push"', f'name="{name}"'))
    with pytest.raises(InputError, match="rename the model's actuators"):
        read_controls(tmp_path / "controls.csv", read_model_file(tmp_path / "cart.xml").twin.model)


def test_a_model_without_actuators_has_no_controls(tmp_path):
    (tmp_path / "cart.xml").write_text(CART)
    with pytest.raises(InputError, match="no actuators"):
        read_controls(tmp_path / "controls.csv", read_model_file(tmp_path / "cart.xml").twin.model)
