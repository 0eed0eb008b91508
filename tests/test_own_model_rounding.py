"""Each coordinate is judged by its own size, and rounding is no difference."""

from dataclasses import replace

import numpy as np
import pytest

from models.own_model import certificate as certifying
from models.own_model.builds import SOFT_BUILD, StateMotion, equations_of_build
from models.own_model.certificate import (
    agreement_of_build,
    certificate,
    comparison_states,
    motion_at,
    reference_of_file,
)
from models.own_model.explain import compare_models
from models.own_model.file import read_model_file
from models.own_model.rounding import _with_solver_rounding
from validation.own_model.files import GEARED


def _read(folder, text, name="a.xml"):
    path = folder / name
    path.write_text(text)
    return read_model_file(path)


def _beside(stiffness: float) -> str:
    """A slide of 1 kg, and beside it a hinge that accelerates 1e9 times as much."""
    return f"""<mujoco><worldbody><body><joint name="x" type="slide" axis="1 0 0" stiffness="{stiffness!r}"/>
    <inertial pos="0 0 0" mass="1" diaginertia=".1 .1 .1"/></body><body pos="0 1 0"><joint name="t" axis="0 0 1"
    stiffness="1000"/><inertial pos="0 0 0" mass="1e-4" diaginertia="1e-9 1e-9 1e-9"/></body>
    </worldbody></mujoco>"""


@pytest.mark.parametrize("stiffness", [20.0, 10.0 * (1.0 + 1e-9)])
def test_no_coordinate_hides_behind_one_that_accelerates_more(tmp_path, monkeypatch, stiffness):
    """Of two files, and of a build that lacks what the other file has; rounding of the light hinge does no harm."""
    first, second = (_read(tmp_path, _beside(k), f"{k}.xml").twin for k in (10.0, stiffness))
    comparison = compare_models(first, second, 3)
    (difference,) = comparison.influential
    assert (
        not comparison.alike
        and difference.owner == "joint 'x'"
        and comparison.acceleration_agreement.worst == "joint 'x'"
    )
    assert all(row.alike for row in certificate(first, 20))
    honest = equations_of_build
    monkeypatch.setattr(certifying, "equations_of_build", lambda twin, build: honest(second, build))
    assert not any(row.alike for row in certificate(first, 20))


@pytest.mark.parametrize("kind", ["ball", "free"])
def test_rounding_is_no_difference(tmp_path, kind):
    """Where weights are borne, accelerations are near 0, axes mix, the world is far away, and bodies differ in mass by
    1e9: every build is alike, and 1e-6 of a small mass is seen all the same."""
    joints = {"ball": '<joint name="b" type="ball" pos="0 0 .1"/>', "free": '<freejoint name="b"/>'}[kind]
    text = f"""<mujoco><worldbody><body pos="40 -70 30"><joint name="y" type="slide" axis="0 1 0" damping="3"/>
    <inertial pos="0 0 0" mass="900" diaginertia="1 1 1"/><body euler="0 90 0"><joint name="spin" axis="0 0 1"/>
    <inertial pos="0 0 0" mass="20" diaginertia="1 1 .4"/><body pos=".2 0 0"><joint name="t" axis="0 1 0"
    stiffness="1"/><inertial pos="0 0 .01" mass="1e-6" diaginertia="1e-9 1e-9 1e-9"/></body></body></body>
    <body pos="3 40 -20">{joints}<inertial pos=".1 0 .2" mass="3" diaginertia=".1 .2 .25"/></body>
    </worldbody></mujoco>"""
    first = _read(tmp_path, text).twin
    assert all(row.alike for row in certificate(first, 30))
    second = _read(tmp_path, text.replace('mass="1e-6"', 'mass="1.000001e-6"'), "b.xml").twin
    comparison = compare_models(first, second, 5)
    assert not comparison.alike and [each.kind for each in comparison.influential] == ["mass"]


@pytest.mark.parametrize("safe", ["enable", "disable"])
def test_rounding_of_a_stiff_constraint_is_no_difference(tmp_path, safe):
    """Far stiffer than its step bears: what rounding of places makes is 1e-10 of an acceleration and more. By default
    MuJoCo holds its time constant at two steps of the file, and so does a build, which has other steps."""
    flag = f'<option timestep=".02"><flag refsafe="{safe}"/></option>'
    stiff = GEARED.replace("<worldbody>", f"{flag}<worldbody>").replace("polycoef", 'solref=".001 1" polycoef')
    twin = _read(tmp_path, stiff).twin
    assert all(row.alike for row in certificate(twin, 20))
    apart = 1.0 + 1e-3
    state = [(q * apart, v) for q, v in comparison_states(twin, 5)]
    assert agreement_of_build(
        "", reference_of_file(twin, state, SOFT_BUILD), motion_at(equations_of_build(twin, SOFT_BUILD), state)
    ).alike


@pytest.mark.parametrize("anchor", ["0 0 0", "0 .1 0"])
def test_rounding_of_what_constraints_stop_is_no_difference(tmp_path, anchor):
    """A free body that is welded to the ground: its accelerations are 0, and rounding of those of gravity."""
    mass = '<inertial pos=".1 0 .3" mass="1" diaginertia=".1 .08 .05"/>'
    text = f"""<mujoco><worldbody><body name="a"><joint name="a" axis="0 1 0"/>{mass}</body><body name="b" pos="0 1 0">
    <freejoint name="f"/>{mass}</body></worldbody><equality><weld body1="b" anchor="{anchor}"/>
    </equality></mujoco>"""
    twin = _read(tmp_path, text).twin
    assert all(row.alike for row in certificate(twin, 20))
    heavier = replace(twin.driven, gravity=(1.0 + 1e-8) * twin.driven.gravity)
    assert not any(row.alike for row in certificate(replace(twin, driven=heavier), 5))


def test_forces_that_cancel_on_an_axis_leave_rounding_that_is_no_difference(tmp_path):
    """Pendulums without weight: what pulls them towards their axles has no moment, whatever their numbers are."""
    mass = '<inertial pos="0 .02 .1" mass="3" diaginertia=".1 .2 .25"/>'
    text = f"""<mujoco><option gravity="0 0 0"/><worldbody><body><joint name="a" axis="0 1 0"/>{mass}</body>
    <body pos="0 1 0"><joint name="b" axis="1 2 3" damping="1e-6"/>{mass}</body></worldbody></mujoco>"""
    twin = _read(tmp_path, text).twin
    assert all(row.alike for row in certificate(twin, 100))
    other = _read(tmp_path, text.replace('"1e-6"', '"1.000001e-6"'), "b.xml").twin
    assert [each.owner for each in compare_models(twin, other, 5).influential] == ["joint 'b'"]


def test_solving_rounds_a_light_coordinate_only_where_the_mass_matrix_couples_it():
    """The second coordinate accelerates a million times as much; by hand |M^-1| |M| |a|."""
    none, acceleration = np.zeros(2), np.array([1.0, 1e6])
    for off, expected in ((0.0, acceleration), (0.5, np.array([[5.0, 4.0], [4.0, 5.0]]) / 3.0 @ acceleration)):
        moved = StateMotion(np.array([[1.0, off], [off, 1.0]]), none, acceleration)
        solved = _with_solver_rounding(StateMotion(np.zeros((2, 2)), none, none), moved)
        assert solved.acceleration == pytest.approx(expected, rel=1e-12)
