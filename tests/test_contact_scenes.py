"""Contact scenes: what is read, shown, refused, and that both ways to name one contact are the same contact."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from models.core.errors import InputError
from models.systems.contact.run import hertzian_contact, solved_contact
from models.systems.contact.scene import build

ELLIPSE = """
title = "a contact"
system = "contact"
[ellipse]
a = 5e-3
b = 4e-3
[contact]
load = 8e4
friction = 0.3
[creepage]
xi_x = 1e-3
"""
TABLE = {
    "title": "a contact",
    "system": "contact",
    "ellipse": {"a": 5e-3, "b": 4e-3},
    "contact": {"load": 8e4, "friction": 0.3},
}
pytestmark = pytest.mark.usefixtures("empty_folder")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("ellipse.a=-1e-3", ("ellipse.a = -0.001", "above 0", "semi-axis along x", "in m")),
        ("ellipse.c=1e-3", ("ellipse.c", "unknown key", "a, b")),
        ("curvatures.A=1.0", ("curvatures.B", "is missing")),
        ("contact.load=-1", ("contact.load = -1", "above 0", "in N")),
        ("contact.load=1e12", ("c.toml", "contact.load = 1000000000000.0", "at most 1e+10 N")),
        ("contact.friction=30", ("contact.friction = 30", "at most 10")),
        ("creepage.spin=-1e12", ("creepage.spin", "1e+09 1/m")),
        ("contact.approach=1e-4", ("contact.load = 80000.0", "either the load in N or contact.approach in m")),
        ("contact.frction=0.3", ("unknown key", "did you mean 'friction'?")),
        ("bodies.wheel.E=2.1e5", ("bodies.wheel", "E = 210000.0", "Young's modulus", "Pa")),
        ("creepage.xi_x=fast", ("creepage.xi_x = 'fast'", "must be a number", "longitudinal creepage")),
        ("sweep.of=xi", ("sweep.of", "xi_x or xi_y or spin", "also wrong: sweep.start, sweep.stop")),
        ("method.name=fastsm", ("method.name", "did you mean 'fastsim'?")),
        ("method.cells=4", ("method.cells = 4", "5 or more")),
        ("cases.file=x.csv", ("ellipse, cases",)),
        ("study=six_runs", ("study = 'six_runs'", "system 'pitch-plane'", "'contact'")),
        ("study=contact_table", ("needs the table [cases]",)),
        ("options.points=3", ("options.points = 3", "unknown key")),
        ("system=contcat", ("no such system", "did you mean 'contact'?")),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_mistake_is_one_message_and_touches_nothing(twinrig, change, words, capsys):
    Path("c.toml").write_text(ELLIPSE)
    assert twinrig("run", "c.toml", "--set", change) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and all(word in said for word in words), said
    assert [path.name for path in Path().iterdir()] == ["c.toml"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("profiles.lateral_shift=0.05", "profiles.lateral_shift = 0.05: must be a shift in m from -0.03 to 0.03"),
        ("profiles.lateral_shift=0.005", "method.name = 'exact': does not take patches"),
        ("contact.load=1e-9", "method.name = 'exact': finds no grid that holds the area of a load of 1e-09 N"),
    ],
)
def test_profiles_that_cannot_be_pressed_name_the_scene_and_its_key(twinrig, change, words, capsys):
    assert twinrig("run", "contact_profiles", "--set", change, "--set", "method.cells=15") == 2
    assert f"twinrig: contact_profiles.toml with --set: {words}" in capsys.readouterr().err


def refused(**tables):
    with pytest.raises(InputError) as found:
        build({**TABLE, **tables}, "c.toml")
    return str(found.value)


def test_keys_that_do_not_belong_together():
    assert "has no meaning for exact" in refused(method={"name": "exact", "march": "plain"})
    assert "which is" not in refused(method={"name": "linear", "cells": 5})
    sweep = {"of": "xi_x", "start": 0.0, "stop": 1e-2}
    assert "is swept: drop this key" in refused(creepage={"xi_x": 0.0}, sweep=sweep)
    assert "both be above 0" in refused(sweep={"of": "spin", "start": 0.0, "stop": 1.0, "spacing": "logarithmic"})
    assert "conform along y" in refused(ellipse=None, radii={"wheel_x": 0.46, "wheel_y": -0.3, "rail_y": 0.3})
    assert "found none" in refused(ellipse=None)
    assert "in the file of cases" in refused(ellipse=None, cases={"file": "x.csv"})
    assert "needs an ellipse" in refused(ellipse=None, profiles={})
    assert "no meaning for built-in profiles" in refused(ellipse=None, profiles={"smoothing": 0.01})
    assert "profiles.gauge = 1435.0: must be from 0.1 to 3 m" in refused(ellipse=None, profiles={"gauge": 1435.0})
    assert "profiles.inclination = 2.3" in refused(ellipse=None, profiles={"inclination": 2.3})


def test_engines_are_refused_only_if_named(twinrig, capsys):
    Path("c.toml").write_text(ELLIPSE)
    assert twinrig("run", "c.toml", "--engine", "mujoco") == 2
    assert "--engine = 'mujoco': has no meaning for contact" in capsys.readouterr().err


def test_show_names_units_and_only_what_the_theory_reads(twinrig, capsys):
    Path("c.toml").write_text(ELLIPSE)
    assert twinrig("show", "c.toml", "--set", "method.name=exact") == 0
    said = capsys.readouterr().out
    assert all(word in said for word in ("a = 0.005 m", "load = 80000 N", "G = 82.03 GPa", "cells = 21", "half-spaces"))
    assert "march" not in said and not Path("results").exists()


@pytest.mark.parametrize("command", ["run", "show"])
@pytest.mark.parametrize("scene", ["c.toml", "manchester"])
def test_too_unlike_materials_are_refused_before_anything_is_written(command, scene, twinrig, capsys):
    Path("c.toml").write_text(ELLIPSE)
    assert twinrig(command, scene, "--set", "bodies.wheel={E=1e9, nu=0.1}") == 2
    said = capsys.readouterr().err
    assert f"{scene.removesuffix('.toml')}.toml with --set: bodies: materials too unlike" in said
    assert not Path("results").exists()


def test_unlike_materials_may_be_pressed_without_friction(twinrig, capsys):
    cases = "cases={pressed={yaw=0.0, friction=0.0}}"
    assert twinrig("show", "manchester", "--set", "bodies.wheel={E=1e9, nu=0.1}", "--set", cases) == 0


def test_radii_curvatures_ellipse_and_approach_name_the_same_contact():
    """To rounding of some roots: 1e-12."""
    own = {key: value for key, value in TABLE.items() if key != "ellipse"}
    one = hertzian_contact(build({**own, "radii": {"wheel_x": 0.46, "rail_y": 0.3}}))
    same = [
        hertzian_contact(build({**own, "curvatures": {"A": 1 / 0.92, "B": 1 / 0.6}})),
        hertzian_contact(build({**own, "ellipse": {"a": float(one.a), "b": float(one.b)}})),
        hertzian_contact(
            build(
                {
                    **own,
                    "ellipse": {"a": float(one.a), "b": float(one.b)},
                    "contact": {"approach": float(one.approach), "friction": 0.3},
                }
            )
        ),
    ]
    for other in same:
        for name in ("a", "b", "p0", "approach", "load", "A", "B"):
            assert getattr(other, name) == pytest.approx(getattr(one, name), rel=1e-12), name


FALLING = {"floor": 0.4, "decay": 0.6, "speed": 20.0}
KERNELS = "models.contact.fastsim_falling"


def test_falling_friction_is_computed_only_where_a_scene_names_it(monkeypatch):
    """In full sliding without spin it is known: mu N (0.4 + 0.6 exp(-0.6 * 20 * 0.1)), in the fields as well."""
    monkeypatch.delitem(sys.modules, KERNELS, raising=False)
    constant = solved_contact(build(TABLE)).roll((0.1, 0.0, 0.0), 21, with_fields=True)
    assert KERNELS not in sys.modules and constant.fx == pytest.approx(-0.3 * 8e4)
    found = solved_contact(build({**TABLE, "falling_friction": FALLING})).roll((0.1, 0.0, 0.0), 21, with_fields=True)
    assert KERNELS in sys.modules
    assert found.fx == pytest.approx(-0.3 * 8e4 * (0.4 + 0.6 * np.exp(-1.2)), rel=1e-9)
    (field,) = found.fields
    assert (field.px * field.dx * field.dy).sum() == pytest.approx(found.fx, rel=1e-9)


def test_falling_friction_is_refused_where_it_would_not_be_read():
    remedy = "method.name: cannot stand beside 'falling_friction', which FASTSIM alone computes: drop one of them"
    assert remedy in refused(falling_friction=FALLING, method={"name": "exact"})
    assert "second-order" in refused(falling_friction=FALLING, method={"march": "plain"})
    with pytest.raises(InputError) as of_cases:
        build({"title": "t", "system": "contact", "cases": {"file": "x.csv"}, "falling_friction": FALLING}, "c.toml")
    assert "constant friction" in str(of_cases.value)
    assert "floor" in refused(falling_friction={"decay": 0.6, "speed": 20.0})


def test_falling_friction_is_shown_if_it_is_there(twinrig, capsys):
    Path("c.toml").write_text(ELLIPSE)
    assert twinrig("show", "c.toml") == 0 and "speed of slip" not in capsys.readouterr().out
    assert twinrig("show", "c.toml", "--set", "falling_friction={floor=0.4, decay=0.6, speed=20}") == 0
    assert "floor = 0.4, decay = 0.6 s/m, speed = 20 m/s" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["fastsim", "simplified", "exact", "linear"])
def test_every_theory_opposes_the_creepage_and_gives_what_it_dissipates(name):
    """Small lateral creepage: all theories within 12 % of the linear one (the 1983 theory is the worst)."""
    body = solved_contact(build({**TABLE, "method": {"name": name}}))
    motion = (0.0, 5e-5, 0.0)
    found = body.roll(motion, 15, with_fields=True)
    linear = solved_contact(build({**TABLE, "method": {"name": "linear"}})).roll(motion, 15)
    assert found.fy == pytest.approx(linear.fy, rel=0.12) and found.fy < 0
    assert found.dissipation == pytest.approx(-found.fy * 5e-5, rel=1e-9)
    assert body.pressing.load == pytest.approx(8e4, rel=1e-9)
    for f in found.fields:
        area = f.dx * f.dy
        assert (f.px * area)[f.inside].sum() == pytest.approx(found.fx, abs=1e-6)
        assert (f.py * area)[f.inside].sum() == pytest.approx(found.fy, rel=1e-6)
        assert (f.pressure * area)[f.inside].sum() == pytest.approx(8e4, rel=1e-6)
        bound = 0.3 * f.pressure * (1 + 1e-9)
        assert (np.hypot(f.px, f.py) <= bound + 1e-3).all()
    assert json.dumps(found.fx)
