"""What results of a wheelset say of their error and of what they take for granted."""

import json

import numpy as np
import pytest

from models.core import told
from models.core.assumptions import broken_assumptions_of
from models.core.discretisation import CELLS_NOTE, error_estimates_of, error_lines
from models.core.errors import RunFailed
from models.rail.wheelset import CHOSEN_WHEELSET
from models.systems.wheelset import plan
from models.systems.wheelset import run as system
from models.systems.wheelset.run import cycles_of_engines, linearised_result, over_speeds, run
from models.systems.wheelset.scene import build
from models.systems.wheelset.stated_error import principal_series
from studies.command.asked import load_scene
from validation.stated_errors.systems.wheelset import samples

SPEED = 40.0
SCENE = {
    "title": "a wheelset",
    "system": "wheelset",
    "contact": {"cells": 7},
    "speeds": {"values": [SPEED]},
    "run": {"duration": 0.1, "displacement": 3e-3, "speeds": [SPEED]},
}
LINEAR = {"contact": {"law": "linear"}}
PUSHED = {"run": {"duration": 0.1, "displacement": 0.014, "step": 1e-4}}
SLIDES = {"run": {"duration": 0.05, "displacement": 6e-3, "yaw": 2e-3}}
TURNED = {"wheelset": {"override": {"stiffness_x": 2e4}}, "run": {"duration": 0.05, "yaw": 0.022}}
SHARP = {"wheelset": {"override": {"head_radius": 0.05, "load": 4e5}}, "run": {"duration": 0.02, "step": 1e-4}}
STRAIGHT, ON_PROFILES = {"run": {"duration": 0.05, "yaw": 2e-3}}, {"profiles": {}, "run": {"duration": 0.05}}
PLANTED = {
    "no slip": (LINEAR | SLIDES, {"contact": {"cells": 7}}, "fastsim"),
    "no flange climbs": (PUSHED, ON_PROFILES, "profiles"),
    "on the tread": (PUSHED, ON_PROFILES, "profiles"),
    "suspension": (TURNED, STRAIGHT, "stiffen"),
    "constant friction": (TURNED, STRAIGHT, "slip"),
    "elastic": (SHARP, {"wheelset": {}}, "load"),
}
"""By name of an assumption: what breaks it, the remedy, and a word that the remedy is told by."""


def scene(**changes):
    table = SCENE | changes
    table["run"] = {"speeds": [SPEED], **table["run"]}
    return build(table, "w.toml")


def names(result):
    return {one.name for one in broken_assumptions_of(result)}


@pytest.mark.parametrize("engine", ["reference", "mujoco"])
@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_breach_is_found_and_its_remedy_lifts_it(name, engine):
    breaks, cures, word = PLANTED[name]
    broke = run(scene(**breaks), engine)
    (one,) = (one for one in broken_assumptions_of(broke) if one.name == name)
    assert word in one.remedy and one.share > 0.0 and 0.0 <= one.first <= broke.times[-1]
    assert broke.data.attrs["status"].endswith("assumptions broken") and f"worst {one.worst:.4g}" in one.line()
    assert name not in names(run(scene(**(breaks | cures)), engine))


def test_a_creeping_wheelset_is_told_of_its_speed():
    slow = scene(run={"duration": 1e-4, "step": 1e-6, "speeds": [0.05], "displacement": 1e-3})
    assert "speed" in names(run(slow, "reference", 0.05)) and "speed" not in names(run(scene(), "reference"))


def test_a_soft_wheelset_is_no_half_space_and_one_of_steel_is(tmp_path):
    values = CHOSEN_WHEELSET.changed(load=12000.0).model_dump(exclude={"material", "profiles"})
    lines = "\n".join(f"{key} = {value!r}" for key, value in values.items())
    found = []
    for name, modulus in (("soft", 2e6), ("steel", 2.1e11)):
        (tmp_path / f"{name}.toml").write_text(f"{lines}\n[material]\nE = {modulus}\nnu = 0.28\n")
        own = scene(wheelset={"parameters": str(tmp_path / f"{name}.toml")}, run={"duration": 0.02})
        found.append(names(run(own, "reference")))
    assert "half-space" in found[0] and "half-space" not in found[1]


def test_without_friction_eigenvalues_say_so():
    smooth, rough = (
        linearised_result(scene(wheelset={"override": {"friction": friction}}), "reference") for friction in (0.0, 0.3)
    )
    assert names(smooth) == {"friction"} and names(rough) == set()


@pytest.mark.parametrize("engine", ["reference", "exudyn", "mujoco"])
def test_steps_and_cells_are_both_told_by_every_engine(engine):
    result = run(scene(), engine, error=True)
    of = {one.of for one in error_estimates_of(result).values()}
    assert of == {"", CELLS_NOTE} and len(error_lines(result)) == 2 and error_estimates_of(run(scene(), engine)) == {}


@pytest.mark.full
def test_a_truth_on_ten_times_the_cells_is_within_what_is_told():
    ratios = np.array([sample.ratio for sample in samples(8, 4)])
    assert (ratios < 3.0).mean() > 0.85 and (ratios > 0.1).mean() > 0.85


@pytest.mark.parametrize("steps", [1, 2, 3])
@pytest.mark.parametrize("law", [{"law": "linear"}, {"cells": 21}])
def test_a_path_of_few_steps_is_compared_at_its_own_times(steps, law):
    """Twice the step outlasts a path of one: its end beside this one's was taken for an error, its start for none."""
    table = {"contact": law, "run": {"duration": round(steps * 5e-4, 9), "displacement": 3e-3}}
    told = error_estimates_of(run(scene(**table), "mujoco", error=True))["y"].error
    finer = scene(**{**table, "run": {**table["run"], "step": 1.25e-4}})
    fine, finer = (principal_series(run(each, "mujoco").detail).channels["y"] for each in (scene(**table), finer))
    true = float(np.sqrt(np.mean((fine - finer[::4]) ** 2)))
    assert true / 3.0 < told < 100.0 * true  # of cells: the order of kinks is taken for that of the first steps


@pytest.mark.parametrize("law", [{"law": "linear"}, {"cells": 11}])
def test_a_wheelset_that_stays_in_the_middle_is_an_answer(law):
    """Its motion is rounding, and cells by which rounding differs are not too few."""
    centred = run(scene(contact=law, run={"duration": 0.02, "displacement": 0.0}), "mujoco", error=True)
    told = {name: each for name, each in error_estimates_of(centred).items() if name.startswith("y")}
    assert np.abs(centred["y"]).max() < 1e-12 and told and not any(each.warned for each in told.values())


def test_an_estimate_that_leaves_the_cells_out_would_be_caught():
    """Planted fault: steps alone tell less than a tenth of what a path on few cells errs by."""
    result = run(scene(), "reference", error=True)
    true = run(scene(contact={"cells": 70}), "reference")
    gap = principal_series(result.detail).channels["y"] - principal_series(true.detail).channels["y"]
    error = float(np.sqrt(np.mean(gap**2)))
    assert error_estimates_of(result)["y"].error < 0.1 * error < error_estimates_of(result)["y of cells"].error


@pytest.mark.full
def test_cells_that_are_no_answer_are_refused_with_those_to_use():
    """Above the critical speed a path on five cells swings at a time of its own."""
    unstable = {"wheelset": {"override": {"stiffness_x": 2e5}}}
    long = {"run": {"duration": 6.0, "displacement": 1e-3, "speeds": [80.0]}}
    with pytest.raises(RunFailed, match=r"the cells are too few, this is no answer: .* use at least") as refused:
        run(scene(**unstable, **long, contact={"cells": 5}), "reference", 80.0, error=True)
    worst = max(error_estimates_of(refused.value.partial).values(), key=lambda one: one.share)
    cured = run(scene(**unstable, **long, contact={"cells": int(worst.step)}), "reference", 80.0, error=True)
    assert max(one.share for one in error_estimates_of(cured).values()) < 0.5


def test_joined_paths_keep_what_each_says():
    paths = {"reference": {SPEED: run(scene(**PUSHED), "reference", error=True)}}
    whole = over_speeds(paths)
    assert names(whole) == names(paths["reference"][SPEED]) and "reference, 40 m/s, y of cells" in error_estimates_of(
        whole
    )
    json.dumps(told.errors_and_assumptions({"whole": whole}), allow_nan=False)


def test_a_limit_cycle_tells_its_error_and_what_it_takes_for_granted():
    hunts = scene(wheelset={"override": {"conicity": 0.15, "stiffness_x": 8e5}}, contact={"cells": 5})
    found, failed = cycles_of_engines(hunts, ("reference",), 67.0, estimate_error=True)
    said = error_estimates_of(found["reference"])
    assert (
        not failed
        and {"amplitude", "frequency", "amplitude of cells"} <= said.keys()
        and names(found["reference"]) == set()
    )
    finer, _ = cycles_of_engines(
        hunts.model_copy(update={"contact": hunts.contact.model_copy(update={"cells": 40})}), ("reference",), 67.0
    )
    true = abs(finer["reference"].detail.amplitude - found["reference"].detail.amplitude)
    assert true < 3.0 * said["amplitude of cells"].error


@pytest.mark.parametrize("name", ["wheelset", "choice_wheelset"])
def test_shipped_scenes_break_nothing_and_are_listed(name):
    shipped = load_scene(name, ["run.duration=1.0"])
    assert all(names(run(shipped, "reference", speed)) == set() for speed in system.path_speeds(shipped))
    assert "assumes    both wheels stay on their rails" in plan.describe(shipped)
