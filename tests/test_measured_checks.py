"""Checks of a recording: what is planted is named with place and size, and what is not there is not."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from models.core.finding import Finding, findings_as_dicts, merged_findings
from models.measured.checks import (
    check,
    clipped,
    drift,
    findings_of_all_checks,
    gaps,
    gravity,
    noise,
    spikes,
    turning,
    weight,
)
from models.measured.checks.evidence import CheckedRecording
from models.measured.checks.response import SensorResponse
from models.measured.checks.spectra import windowed_means
from models.measured.columns import SampleFile
from models.measured.faults_of_measurement import SimulatedFaults
from models.measured.ratios import probable_mistake
from models.measured.recording import Recording
from models.measured.signal import MeasuredSignal, Quantity, TransducerPlace
from models.systems.hub_forces.tilt_filter import StatedDeviations, TiltFilter
from models.systems.measured.consequences import CORRECTION_OF_CHECK, Consequence, consequence_texts
from models.systems.measured.inputs import RecordingInputs
from models.systems.measured.section_run import SectionOutcome
from models.systems.measured.verdict import filter_doubts
from models.systems.measured.virtual import VirtualMeasurement, recording_of_samples
from models.vehicles.cut_vehicle import rigid_vehicle
from validation.cases import measured_checks as case
from validation.measured import planted as bench
from validation.spatial.cars import r19

PERIOD = 2e-3


@pytest.fixture(scope="module")
def ridden() -> VirtualMeasurement:
    """Five seconds of a car on a road."""
    return bench.measurement(road=("C", 1, 20.0, 5.0))


def made(folder: Path, **columns: np.ndarray) -> Recording:
    """A recording of nothing but these columns, named quantity_component."""
    kinds: dict[str, Quantity] = {"acc": "acceleration", "angle": "angle", "rate": "angular rate", "force": "force"}
    signals = tuple(
        MeasuredSignal(name, "", name, kinds[name.split("_")[0]], "body", name.split("_")[1], "body", 1, "", 1.0)
        for name in columns
    )
    values = np.column_stack(list(columns.values()))
    own = SampleFile(folder / "made.columns", tuple(columns), len(values))
    own.write(0, values)
    return Recording(signals, own, PERIOD)


def said(check_one, recording: Recording, **claimed: float) -> list[Finding]:
    """What one check finds without a vehicle, notes left out."""
    return [one for one in check_one(CheckedRecording(recording, None, {}, claimed)) if one.weight != "note"]


def white(count: int = 5000, seed: int = 3) -> np.ndarray:
    """Noise of deviation 1."""
    return np.random.default_rng(seed).normal(size=count)


@pytest.mark.parametrize("seconds", [1.0, 1.5, 3.0])
def test_a_short_recording_that_is_right_is_not_accused(seconds, ridden, tmp_path):
    samples = ridden.samples(SimulatedFaults(noise=bench.NOISE), 3)[: round(seconds / PERIOD)]
    turning_alone = [i for i, s in enumerate(ridden.signals) if s.quantity != "acceleration"]
    few = replace(ridden, signals=tuple(ridden.signals[i] for i in turning_alone))
    assert not bench.errors_and_doubts(few, samples[:, turning_alone], tmp_path)
    hubs = [i for i in turning_alone if ridden.signals[i].at in ridden.vehicle.hubs]
    others = samples[::-1, turning_alone].copy()  # the motion backwards: by these forces nobody moves so
    others[:, : len(hubs)] = samples[:, hubs]
    said = bench.errors_and_doubts(few, others, tmp_path)
    assert seconds < 2.0 or any(one.check in ("swapped", "shift", "sign") for one in said)


@pytest.mark.parametrize("fault", case.FAULTS_OF_QUICK_RUN, ids=lambda fault: fault.name)
def test_a_planted_fault_is_named_with_its_size(fault, ridden, tmp_path):
    assert all(
        row.status == "passed"
        for row in case._planted_fault_rows(
            fault, bench.planted_findings(ridden, tmp_path, fault.spoil, **fault.faults)
        )
    )


def test_a_clean_recording_of_five_seconds_raises_nothing(ridden, tmp_path):
    assert not bench.errors_and_doubts(ridden, ridden.samples(SimulatedFaults(noise=bench.NOISE), 5), tmp_path)


@pytest.mark.parametrize(
    ("fault", "check_name", "size"),
    [({"gain": {"rr_fz": -0.02}}, "gain", -2.0), ({"gain": {"fl_fz": 0.02}}, "gain", 2.0)],
)
def test_two_percent_are_seen_in_five_seconds(fault, check_name, size, ridden, tmp_path):
    # the mean moment of the hub forces is what the gyros say that it must be
    (found,) = bench.errors_and_doubts(ridden, ridden.samples(SimulatedFaults(noise=bench.NOISE, **fault), 5), tmp_path)
    assert found.check == check_name and found.size == pytest.approx(size, rel=0.2) and "offset of" in found.text


@pytest.mark.parametrize(
    "pair", [("fl_fz", "fr_fz"), ("fl_fx", "fl_fy"), ("fl_fz", "rl_fz"), ("roll", "pitch"), ("roll_rate", "pitch_rate")]
)
def test_two_channels_that_are_exchanged_are_named(pair, ridden, tmp_path):
    """Hubs as a whole were looked for, and a sign, or a delay, that would not have helped was named instead."""
    samples = ridden.samples(SimulatedFaults(noise=bench.NOISE), 5)
    one, other = bench.column_numbers(ridden, *pair)
    samples[:, [one, other]] = samples[:, [other, one]]
    found = bench.errors_and_doubts(ridden, samples, tmp_path)
    assert [(f.check, set(f.signals)) for f in found if f.check in ("exchanged", "sign", "shift", "swapped")] == [
        ("exchanged", set(pair))
    ]
    (named,) = (f for f in found if f.check == "exchanged")
    recorded = {s: np.array([i]) for i, s in enumerate(ridden.signals)}
    signals = [s for s in ridden.signals if s.name in pair]
    right = CORRECTION_OF_CHECK["exchanged"](named, signals, recorded, ridden.period)
    assert [int(right[s][0]) for s in signals] == [int(recorded[s][0]) for s in reversed(signals)]


def test_an_angle_and_a_rate_of_different_axes_have_no_sign_to_turn(ridden, tmp_path):
    """Their ratio is chance: the sign of one was called wrong, and the run stopped with a remedy that does not help."""
    samples = ridden.samples(SimulatedFaults(noise=bench.NOISE), 5)
    one, other = bench.column_numbers(ridden, "roll", "pitch")
    samples[:, [one, other]] = samples[:, [other, one]]
    own = recording_of_samples(ridden, samples, tmp_path / "a.columns")
    for vehicle in (ridden.vehicle, None):
        found = [f for f in turning.check(CheckedRecording(own, vehicle)) if f.weight != "note"]
        assert all(f.weight == "doubt" and "is not the derivative" in f.text for f in found)


def test_pairs_that_move_the_vehicle_alike_are_named_as_not_seen(ridden, tmp_path):
    own = recording_of_samples(ridden, ridden.samples(SimulatedFaults(noise=bench.NOISE), 5), tmp_path / "a.columns")
    notes = [f.text for f in check(own, ridden.vehicle) if f.check == "exchanged"]
    assert len(notes) == 1 and "fl_my with fr_my" in notes[0] and "fl_fz with fr_fz" not in notes[0]


@pytest.mark.parametrize("count, period", [(200, 2e-6), (1000, 2.0), (110, 1e-3), (100, 5e-4), (300, 1e-3)])
def test_recordings_with_no_line_or_few_in_the_band_of_the_motion(ridden, tmp_path, count, period):
    """Times of another unit, and short ones: the spectra had no line, which ended in a traceback."""
    own = recording_of_samples(ridden, ridden.samples(SimulatedFaults(), 1)[:count], tmp_path / "a.columns")
    check(replace(own, period=period), ridden.vehicle)


def test_many_findings_of_one_kind_are_one_line_with_the_worst():
    gap = [Finding("gaps", "doubt", f"c{i}", f"c{i} lacks {i} s.", float(i), "s", (f"c{i}",)) for i in range(20)]
    others = [Finding("sign", "error", "x", "turn it."), Finding("gaps", "note", "", "looked at.")]
    assert [f.text for f in merged_findings(others + gap)] == [
        "turn it.",
        "looked at.",
        "'gaps' at 20 channels, the worst: c19 lacks 19 s.",
    ]
    assert merged_findings(gap[:3]) == gap[:3] and len(findings_as_dicts(gap)) == 20
    effects = [Consequence(one, "s F", 1e-3 * one.size, 1.0) for one in gap]
    assert len(consequence_texts(effects[:3])) == 3 and consequence_texts(effects) == [
        f"{effects[19]}, the worst of 20"
    ]


def test_the_slope_of_delays_and_its_error_by_their_scatter():
    times, late = np.arange(5.0), 2e-3 * np.arange(5.0) + 1e-3 * np.array([1.0, -2.0, 0.0, 2.0, -1.0])
    slope, error = drift._slope_of_delays(times, late, np.full(5, 1e-6))
    line, covariance = np.polyfit(times, late, 1, cov=True)
    assert (slope, error) == pytest.approx((line[0], covariance[0, 0] ** 0.5))
    assert drift._slope_of_delays(times, 2e-3 * times, np.full(5, 1e-3))[1] == pytest.approx(1e-3 / np.sqrt(10))


@pytest.mark.full
def test_a_clock_that_is_fast_is_named_and_nothing_else(tmp_path):
    (found,) = (one for one in bench.drifting_findings(bench.measurement(), -5e-4, tmp_path) if one.check != "noise")
    assert found.check == "drift" and found.place == "inertial" and found.size == pytest.approx(-5e-4, rel=0.2)
    assert not bench.drifting_findings(
        bench.measurement(), 0.0, tmp_path
    )  # no noise is filtered by interpolation, either


def test_moments_of_an_offset_are_known_before_a_run(ridden, tmp_path):
    values = [ridden.samples(SimulatedFaults(noise=bench.NOISE, bias=bias), 5) for bias in ({}, {"fl_fz": 30.0})]
    clean, off = (
        weight.mean_hub_moments(
            CheckedRecording(recording_of_samples(ridden, own, tmp_path / f"{i}.columns"), ridden.vehicle)
        )
        for i, own in enumerate(values)
    )
    arm = rigid_vehicle(ridden.vehicle).arms[0]
    assert not clean.any() and off == pytest.approx([30 * arm[1], -30 * arm[0]], rel=0.1)


def test_hub_forces_explain_the_motion_through_the_vehicle_and_only_with_their_signs(ridden, tmp_path):
    clean = ridden.samples(SimulatedFaults(), 1)
    share = {}
    for sign in (1, -1):
        clean[:, bench.column_numbers(ridden, "fl_fy", "fr_fy", "rl_fy", "rr_fy")] *= sign
        own = recording_of_samples(ridden, clean, tmp_path / f"{sign}.columns")
        agreement = CheckedRecording(own, ridden.vehicle).agreement
        assert agreement is not None
        share[sign] = agreement.median_unexplained()
    assert share[1] < 0.15 < 0.5 < share[-1]  # what is left: windows cut the spectra, and the vehicle is not linear


@pytest.mark.parametrize("axis", [1, 2])
def test_slow_forces_on_a_free_vehicle_are_felt_as_force_by_mass(axis):
    # at 0.01 Hz nothing inside the car moves: 1 N shared out as the loads are makes 1 / m at the centre of mass, along
    # y too, where the vehicle rolls far and what a sensor feels of its weight takes the sideways acceleration back
    car, whole = r19(), rigid_vehicle(r19())
    felt = MeasuredSignal("a", "", "a", "acceleration", "body", "xyz"[axis], "body", 1, "m/s^2", 1.0)
    place = TransducerPlace("body", tuple(whole.centre))
    response = SensorResponse(car, "hub").transfer_functions(np.array([1e-2]), (felt,), (place,))[0, 0, axis::6]
    assert (response @ car.loads / car.loads.sum()).real == pytest.approx(1 / whole.mass, rel=1e-3)


def test_gaps_are_named_with_begin_and_length(tmp_path):
    lost = white()
    lost[1000:1250] = np.nan
    (found,) = said(gaps.check, made(tmp_path, force_x=lost, force_y=white()))
    assert (found.weight, found.place, found.times) == ("error", "force_x", (2.0, 2.5))
    assert found.size == pytest.approx(0.5)


def test_a_short_gap_or_one_of_an_angle_is_a_doubt(tmp_path):
    short, angle = white(), white()
    short[100:110], angle[100:600] = np.nan, np.nan
    found = said(gaps.check, made(tmp_path, force_x=short, angle_roll=angle))
    assert [one.weight for one in found] == ["doubt", "doubt"]


def test_clipping_is_told_from_a_rounded_channel(tmp_path):
    cut, rounded = np.minimum(white(), 2.0), np.round(white(seed=4), 1)
    (found,) = said(clipped.check, made(tmp_path, force_x=cut, force_y=rounded))
    assert found.place == "force_x"
    assert found.size == pytest.approx(100 * np.mean(cut == 2.0))


def test_a_held_value_and_a_dead_channel_are_named(tmp_path):
    held = white()
    held[1000:1100] = held[1000]
    stuck, dead = said(clipped.check, made(tmp_path, force_x=held, force_y=np.full(5000, 3.0)))
    assert stuck.size == pytest.approx(0.2, abs=2 * PERIOD)
    assert dead.weight == stuck.weight == "error"


def test_a_value_held_no_longer_than_a_bridged_gap_is_a_doubt(tmp_path):
    held, rounded = white(), np.round(white(seed=4), 1)
    held[1000:1030] = held[1000]
    (found,) = said(clipped.check, made(tmp_path, force_x=held, force_y=rounded))
    assert (found.place, found.weight) == ("force_x", "doubt")
    assert found.size == pytest.approx(0.06, abs=2 * PERIOD)


@pytest.mark.parametrize("width", [1, 2])
def test_a_spike_is_named_with_its_height_and_noise_is_none(width, tmp_path):
    spiky, slow = white(), np.round(np.sin(np.arange(5000) / 100), 2)
    spiky[1000 : 1000 + width] += 50.0
    (found,) = said(spikes.check, made(tmp_path, force_x=spiky, force_y=white(seed=4), force_z=slow))
    assert (found.place, found.times) == ("force_x", pytest.approx((999 * PERIOD, 1002 * PERIOD)))
    assert found.size == pytest.approx(50.0, rel=0.1)  # noise of 1 on both neighbours


def test_a_spike_does_not_hide_an_error_of_its_channel(ridden, tmp_path):
    """One sample, of which a doubt is told, in a channel in kN that stops the run."""
    samples = ridden.samples(SimulatedFaults(noise=bench.NOISE), 5)
    samples[1000, bench.column_numbers(ridden, "rr_fz")] += 5e4
    samples[:, bench.column_numbers(ridden, "rr_fz")] *= 1e-3
    assert {(one.check, one.weight) for one in bench.errors_and_doubts(ridden, samples, tmp_path)} >= {
        ("spikes", "doubt"),
        ("unit", "error"),
    }


@pytest.mark.parametrize(
    ("level", "kind", "size"),
    [(0.0, "gravity", 9.81), (-9.81, "sign", -1.0), (1.0, "unit", 0.102), (8.9, "gravity", -0.91), (9.7, "", 0.0)],
)
def test_a_vertical_accelerometer_feels_gravity(level, kind, size, tmp_path):
    found = said(gravity.check, made(tmp_path, acc_z=level + 0.3 * white()))
    assert [one.check for one in found] == ([kind] if kind else [])
    assert not kind or found[0].size == pytest.approx(size, abs=0.03)


def test_gravity_along_another_axis_means_that_axes_are_exchanged(tmp_path):
    (found,) = said(gravity.check, made(tmp_path, acc_y=9.81 + white()))
    assert (found.weight, found.place) == ("error", "acc_y")


@pytest.mark.parametrize(
    ("factor", "late", "kind", "size"),
    [(1.0, 0.0, "", 0.0), (-1.0, 0.0, "sign", -1.0), (57.3, 0.0, "unit", 57.3), (1.0, 4e-3, "shift", 4e-3)],
)
def test_a_rate_is_the_derivative_of_its_angle(factor, late, kind, size, tmp_path):
    times, waves = PERIOD * np.arange(10_000), np.random.default_rng(1).uniform(0.5, 6.0, (40, 2))
    phase = np.pi * waves[:, 1]
    angle = np.sin(2 * np.pi * np.outer(times, waves[:, 0]) + phase).sum(axis=1)
    rate = (np.cos(2 * np.pi * np.outer(times - late, waves[:, 0]) + phase) * 2 * np.pi * waves[:, 0]).sum(axis=1)
    own = made(tmp_path, angle_roll=angle + 0.01 * white(10_000), rate_roll=factor * rate + 0.01 * white(10_000, 4))
    found = said(turning.check, own)
    assert [one.check for one in found] == ([kind] if kind else [])
    assert not kind or found[0].size == pytest.approx(size, rel=0.1)


def test_noise_is_estimated_beside_motion_and_compared_with_what_is_stated(tmp_path):
    motion = 50 * np.sin(2 * np.pi * 3 * PERIOD * np.arange(20_000))
    own = made(tmp_path, force_x=motion + 2.0 * white(20_000))
    (found,) = said(noise.check, own, force_x=8.0)
    assert found.size == pytest.approx(2.0, rel=0.05)  # 40 segments of 128 lines: 2 %
    assert not said(noise.check, own, force_x=2.2)


def test_the_mean_of_a_windowed_record_is_as_good_as_it_says():
    rng, off = np.random.default_rng(2), []
    for _ in range(200):
        values = rng.normal(size=500)
        centre, spread = windowed_means([partial(np.asarray, values)])
        off.append(float(centre[0] ** 2 / spread[0, 0]))
    assert 0.7 < np.mean(off) < 2.0  # F(1, 6) has the mean 1.5; three neighbouring lines are not quite independent


@pytest.mark.parametrize(("ratio", "kind"), [(1.02, "gain"), (1e3, "unit"), (-1.0, "sign"), (0.5, "size")])
def test_a_ratio_says_what_is_wrong(ratio, kind):
    own = MeasuredSignal("fz", "", "fz", "force", "fl", "z", "hub", 1, "kN", 1e3)
    assert probable_mistake(ratio, own)[0] == kind
    assert kind != "unit" or probable_mistake(ratio, own)[1] == "N taken for kN"


def test_findings_of_means_of_times_and_of_motion_have_their_figures(ridden, tmp_path):
    pytest.importorskip("matplotlib")
    from studies.recording_figures import figure_of_finding

    samples = ridden.samples(SimulatedFaults(noise=bench.NOISE, delay={"fl_fz": 3e-3}), 1)
    samples[:, bench.column_numbers(ridden, "rr_fz")] *= 1e-3
    samples[500:700, bench.column_numbers(ridden, "rl_mz")] = 0.0
    evidence = CheckedRecording(recording_of_samples(ridden, samples, tmp_path / "own.columns"), ridden.vehicle)
    drawn = {
        one.check
        for i, one in enumerate(findings_of_all_checks(evidence))
        if one.weight != "note" and figure_of_finding(one, evidence, tmp_path / f"{i}.png")
    }
    assert drawn == {"unit", "clipped", "shift"}
    assert len(list(tmp_path.glob("*.png"))) == 3


def test_without_a_vehicle_every_check_says_what_it_would_need(tmp_path):
    found = check(made(tmp_path, force_z=1000 + white()), None)
    assert {one.weight for one in found} == {"note"}
    assert any("a vehicle in space" in one.text for one in found)


def test_a_filter_that_is_surprised_by_its_measurements_is_a_doubt(tmp_path):
    """NaN is a run without a filter."""
    columns = made(tmp_path, force_z=white()).columns
    told = [filter_doubts(SectionOutcome(columns, (), PERIOD, 2, surprise, ())) for surprise in (1.2, np.nan, 2.5)]
    assert told[:2] == [(), ()]
    assert [(one.weight, one.size) for one in told[2]] == [("doubt", 2.5)]


def test_what_was_noticed_while_reading_is_carried_and_errors_come_first(ridden, tmp_path):
    noticed = Finding("clock", "doubt", "b.csv", "The clock of b.csv runs fast.")
    lost = white()
    lost[10:1000] = np.nan
    found = check(replace(made(tmp_path, force_z=lost), findings=(noticed,)), None)
    assert [one.weight for one in found[:2]] == ["error", "doubt"]
    assert found[1] is noticed


@pytest.mark.parametrize("hubs, lever", [(("fl", "fr", "rl", "rr"), -0.3), (("rr",), -0.34), (("fl", "fr"), 0.3)])
def test_moments_about_the_contact_patch_are_recognised(hubs, lever, ridden, tmp_path):
    samples = ridden.samples(SimulatedFaults(noise=bench.NOISE), bench.SEED)
    bench.moments_about_point(lever, *hubs)(ridden, samples)
    said = bench.errors_and_doubts(ridden, samples, tmp_path)
    assert [one.check for one in said] == ["lever"]
    # the fit has a standard error of 0.01 m here, and the vehicle is not linear
    assert said[0].size == pytest.approx(lever, abs=0.04)
    assert f"levers = {{ {hubs[0]} = " in said[0].text and ("contact patch" in said[0].text)


@pytest.mark.parametrize(
    "bias, named",
    [({}, ""), ({"pitch_rate": 3e-3}, "innovations of pitch "), ({"roll_rate": -5e-3}, "innovations of roll ")],
)
def test_a_filter_names_a_biased_gyro_and_no_right_one(bias, named, ridden, tmp_path):
    samples = ridden.samples(SimulatedFaults(noise=bench.NOISE, bias=bias), bench.SEED)
    own = recording_of_samples(ridden, samples, tmp_path / "a.columns")
    inputs = RecordingInputs(own, ridden.vehicle)
    forces = np.tile(np.repeat([bench.NOISE["force"], bench.NOISE["moment"]], 3), 4)
    followed = TiltFilter(ridden.vehicle, "hub", own.period, StatedDeviations(forces, (1.75e-3, 5e-3), 10.0))
    followed.advance(inputs.wrenches(0, own.count), inputs.tilt(0, own.count))
    assert [named in text for text in followed.objections()] == [True] * bool(bias)
