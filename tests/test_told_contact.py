"""What results of contacts and of held wheelsets say of their error and of what they take for granted."""

from dataclasses import replace

import numpy as np
import pytest

from models.core.assumptions import broken_assumptions_of
from models.core.discretisation import CELLS_NOTE, error_estimates_of, error_lines, finite_rms
from models.core.errors import RunFailed
from models.systems.contact import plan
from models.systems.contact.run import run
from models.systems.contact.scene import build
from models.systems.wheel_rail import plan as held_plan
from models.systems.wheel_rail import run as wheel_rail
from models.systems.wheel_rail.scene import build as held
from studies.command.asked import SCENES_FOLDER, load_scene
from validation.stated_errors.systems.contact import samples

SCENE = {
    "title": "a contact",
    "system": "contact",
    "radii": {"wheel_x": 0.46, "rail_y": 0.3},
    "contact": {"load": 8e4, "friction": 0.3},
    "creepage": {"xi_x": 8e-4},
}
LINEAR = {"method": {"name": "linear"}}
FALLING = {"falling_friction": {"floor": 0.4, "decay": 0.6, "speed": 20.0}}
ELLIPSE = {"radii": None, "ellipse": {"a": 12e-3, "b": 1e-3}}
PROFILES = {"radii": None, "profiles": {}, "method": {"name": "simplified", "cells": 9}}
USUAL, HEAVY, LIGHT = ({"contact": {"load": load, "friction": 0.3}} for load in (8e4, 2e6, 2e4))
SOFT = {"bodies": {"wheel": {"E": 1e7, "nu": 0.4}, "rail": {"E": 1e7, "nu": 0.4}}}
UNLIKE = {"bodies": {"wheel": {"E": 2.1e11, "nu": 0.28}, "rail": {"E": 2.0e11, "nu": 0.28}}}
PLANTED = {
    "no slip": (LINEAR | {"creepage": {"xi_x": 4e-3}}, {"method": {"name": "fastsim"}}, "fastsim"),
    "constant friction": ({"creepage": {"xi_y": 0.06}}, FALLING, "falling_friction"),
    "small creepage": ({"creepage": {"xi_x": 0.2}} | FALLING, {"creepage": {"xi_x": 1e-3}}, "lower the creepage"),
    "axes alike": (ELLIPSE | LIGHT, {"method": {"name": "exact", "cells": 9}}, "exact"),
    "half-space": (SOFT, {"bodies": {}}, "lower the load"),
    "elastic": (HEAVY, USUAL, "lower the load"),
    "bodies alike": (UNLIKE | {"contact": {"load": 8e4, "friction": 0.1}}, {"bodies": {}}, "same material"),
}
"""By name of an assumption: what breaks it, the remedy, and words that name that."""
STEEL = {"title": "a held wheelset", "system": "wheel-rail", "cases": {"A": {"yaw": 2.4, "friction": 0.3}}}


def names(result):
    return {one.name for one in broken_assumptions_of(result)}


def scene(**changes):
    return build({key: value for key, value in (SCENE | changes).items() if value is not None}, "c.toml")


@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_breach_is_found_and_its_remedy_lifts_it(name):
    breaks, cures, words = PLANTED[name]
    broke = run(scene(**breaks), error=False)
    (one,) = (one for one in broken_assumptions_of(broke) if one.name == name)
    assert words in one.remedy and one.share == 1.0 and broke.data.attrs["status"].endswith("assumptions broken")
    assert name not in names(run(scene(**(breaks | cures)), error=False))


def test_patches_that_grow_together_are_told():
    """Near the flange's root both patches of the wheel join under a heavy load."""
    heavy = PROFILES | {"contact": {"load": 2e5, "friction": 0.3}}
    found = [names(run(scene(**heavy | {"profiles": {"lateral_shift": shift}}), error=False)) for shift in (0.0, 0.005)]
    assert "patches apart" not in found[0] and "patches apart" in found[1]


def test_rows_of_a_table_are_judged(tmp_path):
    head = "a [mm],b [mm],load [kN],friction [-],xi_x [%],xi_y [%],spin [1/m]\n"
    (tmp_path / "c.csv").write_text(head + "5,5,80,0.3,0.05,0,0\n5,5,80,0.3,20,0,0\n12,1,900,0.3,0.1,0,0\n")
    table = {"title": "t", "system": "contact", "cases": {"file": "c.csv"}, "method": {"cells": 21}}
    answered = run(build(table, "t.toml", tmp_path), answers=tmp_path / "out.csv")
    assert names(answered) == {"axes alike", "elastic", "small creepage", "constant friction"}
    assert (
        all(0.0 < one.share < 0.5 for one in broken_assumptions_of(answered))
        and error_estimates_of(answered)["force"].of == CELLS_NOTE
    )
    run(build(table, "t.toml", tmp_path), answers=tmp_path / "bare.csv", error=False)
    assert "error" not in (tmp_path / "bare.csv").read_text().splitlines()[0]


@pytest.mark.parametrize("name", ["contact_ellipse", "contact_profiles"])
def test_shipped_scenes_break_nothing_and_are_listed(name):
    shipped = load_scene(name, ["method.cells=15"])
    assert names(run(shipped, error=False)) == set()
    assert "  assumes    the steel does not flow (at most 2700 MPa)" in plan.describe(shipped)
    assert (SCENES_FOLDER / f"{name}.toml").exists()


def test_the_error_of_cells_is_that_against_ten_times_as_many():
    ratios = np.array([sample.ratio for sample in samples(12, 8)])
    assert (ratios < 3.0).mean() > 0.9 and (ratios > 0.1).mean() > 0.8


def test_an_estimate_by_a_grid_that_is_hardly_coarser_would_be_caught(monkeypatch):
    """Planted fault: a grid with one cell less tells next to nothing."""
    monkeypatch.setattr("models.contact.accuracy.coarser_cells", lambda cells: cells - 1)
    ratios = np.array([sample.ratio for sample in samples(12, 8)])
    assert (ratios > 3.0).mean() > 0.1


def test_errors_of_cells_and_of_theory_are_both_told_and_neither_when_not_asked():
    swept = scene(creepage={}, sweep={"of": "xi_x", "start": 0.0, "stop": 4e-3, "count": 5})
    told = run(swept)
    first, second = error_lines(told)
    assert first.startswith("error at most") and second.startswith("error of the theory at most")
    assert error_estimates_of(run(swept, error=False)) == {} and "error_of_cells" not in run(swept, error=False).data
    assert error_lines(run(scene(**LINEAR)))[0] == "error not estimated: the linear theory has no cells"


def test_cells_that_are_too_few_are_warned_of_with_those_to_use():
    coarse = run(scene(method={"cells": 5}))
    (worst, *_), line = error_estimates_of(coarse).values(), error_lines(coarse)[0]
    assert "WARNING, use at least" in line and line.endswith(CELLS_NOTE)
    finer = run(scene(method={"cells": int(worst.step)}))
    assert error_estimates_of(finer)["force"].share < 0.3 * worst.share and "WARNING" not in error_lines(finer)[0]


def test_a_flange_of_a_held_wheelset_yields_under_its_load_and_not_under_less():
    on_flange = {"cases": {"A": {}}, "positions": {"start": 0.010, "stop": 0.010, "count": 1}}
    usual, less = (wheel_rail.run(held(STEEL | on_flange | {"wheelset": {"load": load}})) for load in (1e4, 3e3))
    assert names(usual) == {"elastic"} and names(less) == set()


def test_a_held_wheelset_that_slips_fast_is_told():
    fast = held(STEEL | {"positions": {"start": 0.006, "stop": 0.006, "count": 1}, "wheelset": {"speed": 150.0}})
    (one,) = broken_assumptions_of(result := wheel_rail.run(fast))
    assert one.name == "constant friction" and "lower wheelset.speed" in one.remedy
    assert "assumes    friction is the same however fast the wheels slip" in held_plan.describe(fast)
    assert error_estimates_of(result) == {}


@pytest.mark.full
def test_the_error_of_a_held_wheelset_is_that_against_four_times_the_cells():
    some = held(STEEL | {"positions": {"start": 0.002, "stop": 0.008, "count": 3}, "method": {"cells": 15}})
    told = error_estimates_of(run_ := wheel_rail.run(some, error=True))
    finer = replace(some.contact(some.cases["A"]), cell_factor=0.25 * 31 / 15)
    placed = run_.detail.placements
    gaps = [wheel_rail.wheel_sums(one) - wheel_rail.wheel_sums(finer.at(one.shift, one.yaw)) for one in placed]
    for k, name in enumerate(wheel_rail.WHEEL_QUANTITIES):
        assert finite_rms(np.array(gaps)[:, :, k]) < 3.0 * told[name].error


def test_an_error_beyond_all_measure_is_refused_with_the_cells_to_use(monkeypatch):
    """Planted: a theory whose coarser grid has nothing in common with the finer one."""
    monkeypatch.setattr("models.contact.accuracy.LIKELY_ERROR_SHARE", 50.0)
    with pytest.raises(RunFailed, match=r"the cells are too few, this is no answer: .* use at least \d+ cells"):
        run(scene(method={"cells": 5}))
