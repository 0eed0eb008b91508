"""A vehicle cut at its wheels: engines, closed forms of its drift, the filter, scenes and their faults."""

from dataclasses import replace

import numpy as np
import pytest

from models.core.discretisation import WARNED_SHARE, error_estimates_of
from models.core.errors import InputError, Refused, RunFailed
from models.core.result import load_result
from models.engines.cut_vehicle import build
from models.multibody.cut_table import HubInputs
from models.road.iso8608 import iso8608_road
from models.systems.hub_forces.comparison import compare_stabilisers
from models.systems.hub_forces.measurement import (
    HubForces,
    MeasuredAngles,
    recorded_measurement,
    road_under_wheels,
    true_run,
)
from models.systems.hub_forces.run import inputs_with_angles, run
from models.systems.hub_forces.scene import build as scene_of
from models.systems.hub_forces.tilt_filter import StatedDeviations, estimate_tilt, inputs_with_moments
from models.vehicles.cut_vehicle import PITCH, ROLL, cut_at_hubs, rigid_vehicle
from models.vehicles.spatial_linear import linearise
from studies.hub_forces import save_measurement_and_runs
from validation.cases import hub_forces as case
from validation.spatial.cars import r19, static_forces, twin

ALL = {"title": "t", "system": "hub-forces", "study": "hub_forces", "vehicle": {"file": "r19_free"}, "road": {}}


def test_the_quick_share_passes(tmp_path):
    rows, _ = case.measure(True, tmp_path)
    assert [row.id for row in rows if row.status in ("failed", "not run")] == []


def test_without_symmetry_the_engines_agree_too():
    # 1e-10: a wrong product of inertia or arm would show at 1e-2
    assert all(row.status == "passed" for row in case._acceleration_rows("twin", cut_at_hubs(twin(), "body")))


@pytest.mark.grounds("plain counterpart")
def test_small_motion_on_tyres_is_that_of_the_linear_vehicle():
    car = r19()
    linear, n = linearise(replace(car.uncut, gravity=0.0), 20.0), car.size
    places = {place: i for i, place in enumerate(car.uncut.coordinates())}
    order = [places["body", f] for f in ("x", "y", "z", "rz", "ry", "rx")]
    order += [places[place] for place in car.tree.coordinates()[6:]]
    bare = replace(
        car,
        tree=replace(car.tree, gravity=0.0),
        loads=0 * car.loads,
        elements=tuple(replace(element, preload=0.0) for element in car.elements),
    )
    model = build("reference", bare, HubInputs(np.zeros((3, 8)), speed=20.0), 1e-3, 1e-3)
    small = 1e-6 * np.random.default_rng(1).uniform(-1, 1, (2, n))
    found = model.acceleration(0.0, *small)
    q, v = np.zeros((2, n))
    q[order], v[order] = small
    expected = np.linalg.solve(linear.mass, -linear.damping @ v - linear.stiffness @ q)[order]
    assert np.abs(found - expected).max() < 1e-5 * np.abs(expected).max()  # second order in 1e-6


@pytest.fixture(scope="module")
def measured():
    car, step = r19(), 2e-3
    hub_inputs = road_under_wheels(car, *(iso8608_road("C", seed) for seed in (1, 2)), 20.0, step, 500)
    true = true_run("mujoco", car, hub_inputs, "hub", step, 1.0)
    return car, true, *recorded_measurement(true, "hub", 1)


@pytest.mark.grounds("closed form")
def test_enforced_angles_are_met_and_the_moment_is_what_was_left_out(measured):
    car, true, forces, angles = measured
    less = replace(forces, samples=forces.samples - np.eye(24)[3] * 200.0)  # 200 N m about x at one hub
    hub_input_sets = [
        inputs_with_angles(own.hub_inputs(2e-3, 500), angles.samples[:, :2], 2e-3, 2e-3) for own in (forces, less)
    ]
    whole, run = (build("mujoco", car, hub_inputs, 2e-3, 1.0).run() for hub_inputs in hub_input_sets)
    assert np.abs(run.states[:, [ROLL, PITCH]] - true.states[:, [ROLL, PITCH]]).max() < 1e-6
    # 0.5 %: the heading, which is free, takes a little through the product of inertia
    assert (run.moments - whole.moments)[:, 0] == pytest.approx(np.full(501, 200.0), rel=5e-3)
    assert np.abs(run.moments - whole.moments)[:, 1].max() < 2.0


def test_the_filter_holds_both_angles_and_refuses_what_contradicts(measured):
    car, true, forces, angles = measured
    deviations = StatedDeviations(np.tile([8.0] * 3 + [1.0] * 3, 4), (1.75e-3, 5e-3), 1.0)
    tilt = estimate_tilt(car, forces, angles.with_noise((1.75e-3, 5e-3), 3), deviations)
    assert np.abs(tilt.states[50:, :2] - angles.samples[50:, :2]).max() < 3e-3
    shifted = replace(forces, samples=forces.samples + np.eye(24)[3] * 400.0)  # 1.4 rad/s^2 of roll that was not
    free, drawn = (
        build("mujoco", car, d, 2e-3, 1.0).run()
        for d in (
            shifted.hub_inputs(2e-3, 500),
            inputs_with_moments(shifted.hub_inputs(2e-3, 500), car, tilt, 2e-3, 2.0),
        )
    )
    off = [np.abs(run.states[-1, ROLL] - true.states[-1, ROLL]) for run in (free, drawn)]
    assert off[0] > 0.3 and off[1] < 0.02
    with pytest.raises(InputError, match="contradicts the hub forces"):
        estimate_tilt(car, replace(forces, samples=-forces.samples), angles, deviations)


@pytest.mark.grounds("closed form")
def test_the_laws_of_the_rigid_vehicle():
    car = rigid_vehicle(r19())
    # two equal forces up, left and right, do not roll; one alone does by its arm
    both = np.zeros((2, 24))
    both[0, [2, 8]], both[1, 2] = 100.0, 100.0
    assert car.moments(both)[:, 0] == pytest.approx([0.0, 100.0 * 0.69342])
    times = np.array([1.0, 2.0])
    variance = car.angle_variance(np.ones(24), 1e-3, times)
    assert variance[1] / variance[0] == pytest.approx([8.0] * 3)  # t^3


@pytest.mark.grounds("closed form")
def test_noise_is_the_same_in_any_frame_and_differs_from_path_to_path():
    still = HubForces(np.zeros((5000, 24)), 1e-3, "hub")
    one, two = (still.with_noise(np.full(24, 3.0), 7, path).samples for path in (0, 1))
    assert one.std() == pytest.approx(3.0, rel=0.006)  # 120,000 samples: 0.2 %
    assert abs(np.mean(one * two)) < 0.1
    # 200,000 samples of each kind: 0.16 %
    angles = MeasuredAngles(np.zeros((100_000, 4)), 1e-3).with_noise((1.0, 10.0), 7).samples
    assert [angles[:, :2].std(), angles[:, 2:].std()] == pytest.approx([1.0, 10.0], rel=0.005)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"vehicle": {"file": "r19_free", "chassis": "fl"}}, "fl"),
        ({"vehicle": {"file": "r19_free", "chassis": "bodi"}}, "no such body"),
        ({"vehicle": {"file": "quarter_car", "chassis": "body"}}, "what is left of a vehicle without tyres"),
        ({"forces": {"file": "f.csv"}}, "give either the table road"),
        ({"forces": {"frame": "wheel"}}, "frame"),
        ({"forces": {"sampling_rate": 300.0}}, "multiple of run.step"),
        ({"run": {"step": 7e-3}}, "must divide run.duration"),
        ({"run": {"step": 0.05, "duration": 1.0}, "forces": {"sampling_rate": 20.0}}, "step of 0.05 s"),
        ({"forces": {"frame": "inertial"}, "stabilise": {"bandwidth": 0.3}}, "topple the vehicle"),
    ],
)
def test_one_clear_message(change, told):
    from models.systems.hub_forces.plan import check

    with pytest.raises(InputError, match=told):
        check(scene_of({**ALL, **change}, "s.toml"), ("mujoco",))


def test_inputs_of_a_wrong_length_are_refused_and_a_vehicle_that_tumbles_is_told():
    car = r19()
    with pytest.raises(Refused, match="rows"):
        build("mujoco", car, static_forces(car, 7), 1e-3, 1.0)
    start = np.zeros(38)
    start[19 + PITCH] = 3.0
    with pytest.raises(RunFailed, match="pitches by more than"):
        build("mujoco", car, static_forces(car, 1201), 1e-3, 0.6).run(*np.split(start, 2))


def test_steps_that_the_road_is_too_fast_for_are_told():
    """Steps of 20 ms at 60 m/s pass three waves of the road: refused with the step to use, which is taken; at 20 m/s
    steps of 2.5 ms are told to be right."""

    def table(speed: float, step: float, rate: float) -> dict:
        forces, run = {"sampling_rate": rate}, {"duration": 1.0, "step": step}
        return {**ALL, "road": {"speed": speed}, "run": run, "forces": forces}

    with pytest.raises(RunFailed, match=r"this is no answer: .* use at most") as refusal:
        run(scene_of(table(60.0, 0.02, 50.0), "s.toml"), "mujoco", error=True)
    advised = min(each.step for each in error_estimates_of(refusal.value.partial).values())
    for own in (table(60.0, 0.02 / np.ceil(0.02 / advised), 50.0), table(20.0, 2.5e-3, 200.0)):
        told = run(scene_of(own, "s.toml"), "mujoco", error=True)
        assert max(each.share for each in error_estimates_of(told).values()) < WARNED_SHARE


def test_a_file_of_ones_own(tmp_path, measured):
    scene = scene_of({**ALL, "run": {"duration": 0.5}}, "s.toml")
    comparison = compare_stabilisers(scene, ("mujoco",))
    save_measurement_and_runs(comparison, tmp_path)
    own = {**ALL, "run": {"duration": 0.5}, "forces": {"file": "hub_forces.csv"}, "angles": {"file": "angles.csv"}}
    del own["road"]
    again = compare_stabilisers(scene_of(own, "s.toml", tmp_path), ("mujoco",))
    assert np.array_equal(again.runs["filter"].detail.states, comparison.runs["filter"].detail.states)
    saved = load_result(tmp_path / "runs.nc")
    assert list(saved.data["run"].values) == ["true", *comparison.runs] and saved.data.attrs["system"] == "hub-forces"
    assert np.array_equal(saved.data["roll"].sel(run="filter").values, comparison.runs["filter"]["roll"])
    header, *rows = (tmp_path / "hub_forces.csv").read_text().splitlines()
    (tmp_path / "hub_forces.csv").write_text("\n".join([header.replace("fl_fx [N]", "fl_fx [lbf]"), *rows]) + "\n")
    with pytest.raises(InputError, match="lbf"):
        scene_of(own, "s.toml", tmp_path).measured(r19())


@pytest.mark.parametrize("unit, factor, said", [("s", 1e3, "in milliseconds, not"), ("ms", 1.0, "in seconds, not")])
def test_files_with_times_of_another_unit_are_refused_with_the_remedy(tmp_path, unit, factor, said):
    """The smoothing of angles was refused, or the duration of the run."""
    heads = [f"{hub}_{f}{axis} [N{' m' * (f == 'm')}]" for hub in r19().hubs for f in "fm" for axis in "xyz"]
    angles = ["roll [rad]", "pitch [rad]", "roll_rate [rad/s]", "pitch_rate [rad/s]"]
    for name, columns in (("forces", heads), ("angles", angles)):
        rows = [",".join([f"{factor * 1e-3 * i:g}", *["0"] * len(columns)]) for i in range(2000)]
        (tmp_path / f"{name}.csv").write_text("\n".join([",".join([f"time [{unit}]", *columns]), *rows, ""]))
    table = ALL | {"forces": {"file": "forces.csv"}, "angles": {"file": "angles.csv"}, "run": {"duration": 1.0}}
    del table["road"]
    own = scene_of(table, "s.toml", tmp_path)
    with pytest.raises(InputError, match=said):
        own.measured(own.cut_vehicle())
