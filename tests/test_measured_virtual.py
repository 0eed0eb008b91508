"""Virtual measurements, their faults, bridged gaps, times of trust, verdicts, and recordings on the pitch plane."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from models.core.errors import InputError
from models.core.strict import read
from models.measured.columns import SampleFile
from models.measured.faults_of_measurement import SimulatedFaults, check_faults, measured_samples
from models.measured.gaps import filled_samples
from models.measured.recording import Recording
from models.measured.signal import MeasuredSignal, Quantity
from models.systems.measured.inputs import RecordingInputs, StepGrid
from models.systems.measured.pitch_plane import PlaneRunSettings
from models.systems.measured.pitch_plane import run as plane_run
from models.systems.measured.section_run import PULL_DAMPING, AttitudeHold
from models.systems.measured.sections import SectionChannel
from models.systems.measured.trust import MeasurementErrors, position_error, predicted_drift
from models.systems.measured.verdict import ChannelComparison, FrequencyBand, angle_uncertainty, channel_disagreement
from models.systems.measured.virtual import VirtualMeasurement, VirtualTable, recording_of_samples, virtual_measurement
from models.systems.measured.virtual import checked_signals as check_virtual
from models.systems.pitch_plane.run import run as simulate
from models.vehicles.cut_vehicle import CutVehicle, cut_at_hubs, rigid_vehicle
from models.vehicles.vehicle_file import load_vehicle
from validation.common.scenes import road_scene

PERIOD = 2e-3


@pytest.fixture(scope="module")
def car() -> CutVehicle:
    return cut_at_hubs(load_vehicle("r19_free"), "body")


@pytest.fixture(scope="module")
def driven(car: CutVehicle) -> VirtualMeasurement:
    table = {
        "duration": 0.5,
        "sampling_rate": 500.0,
        "accelerometers": {"origin": [-0.17469426452848785, 0.0, 0.6254492741749169], "roof": [0.3, 0.2, 1.4]},
        "travels": ["front left", "front bar"],
        "sections": ["front left"],
    }
    return virtual_measurement(car, read(VirtualTable, table, ""), "mujoco")


def _signal(channel: str, what: Quantity = "force", at: str = "fl", component: str = "z") -> MeasuredSignal:
    return MeasuredSignal(channel, "", channel, what, at, component, "inertial", 1, "N", 1.0)


def _faulty(
    faults: dict[str, object], signals: tuple[MeasuredSignal, ...], truth: np.ndarray, path: int = 0
) -> np.ndarray:
    return measured_samples(read(SimulatedFaults, faults, ""), signals, truth, 1e-3, 2, 7, path)


WAVE = np.sin(2 * np.pi * 3.0 * 1e-3 * np.arange(8001))
TWO = (_signal("a"), _signal("b", at="fr"))


@pytest.mark.grounds("closed form")
@pytest.mark.parametrize(
    ("faults", "expected"),
    [
        ({}, WAVE[::2]),
        ({"gain": {"fl": 0.02}}, 1.02 * WAVE[::2]),
        ({"bias": {"a": 3.0, "force": 9.0}}, WAVE[::2] + 3.0),
        ({"delay": {"force": 0.0035}}, np.sin(2 * np.pi * 3.0 * np.maximum(2e-3 * np.arange(4001) - 0.0035, 0.0))),
    ],
)
def test_a_fault_does_what_it_says_and_nothing_else(faults: dict[str, object], expected: np.ndarray) -> None:
    found = _faulty(faults, TWO, np.column_stack([WAVE, WAVE]))
    assert np.abs(found[:, 0] - expected).max() < 1e-9  # the spline of a delay errs by (w h)^4 / 384


def test_noise_belongs_to_its_channel() -> None:
    still = np.zeros((80_001, 2))
    both = _faulty({"noise": {"force": 2.0}}, TWO, still)
    alone = _faulty({"noise": {"force": 2.0}}, TWO[1:], still[:, 1:])
    assert (both[:, 1] == alone[:, 0]).all()
    assert abs(both.std() - 2.0) < 4 * 2.0 / np.sqrt(2 * both.size)  # four deviations of a standard deviation
    assert abs(np.corrcoef(both.T)[0, 1]) < 4 / np.sqrt(len(both))
    assert (both != _faulty({"noise": {"force": 2.0}}, TWO, still, path=1)).mean() > 0.99


@pytest.mark.grounds("closed form")
def test_a_converter_rounds_and_a_silent_transducer_loses_all_its_channels() -> None:
    signals = (_signal("a"), _signal("b", component="x"), _signal("c", at="fr"))
    truth = np.column_stack([WAVE, 2 * WAVE, WAVE])
    found = _faulty(
        {"quantisation": {"bits": 8, "channels": ["a"]}, "dropouts": {"rate": 1.0, "length": 0.02}}, signals, truth
    )
    lost = np.isnan(found)
    assert (lost[:, 0] == lost[:, 1]).all() and (lost[:, 0] != lost[:, 2]).any()
    assert 1 <= lost[:, 0].sum() / 10 <= 20  # of 8 expected gaps of 10 samples; 5 deviations of a Poisson number are 14
    steps = found[:, 0] / (2 * 1.25 / 2**8)
    assert np.nanmax(np.abs(steps - np.rint(steps))) < 1e-9 and len(np.unique(steps[~lost[:, 0]])) > 100


def test_names_that_no_signal_has_are_refused() -> None:
    with pytest.raises(InputError, match="did you mean 'force'"):
        check_faults(read(SimulatedFaults, {"noise": {"forse": 1.0}}, ""), TWO)
    with pytest.raises(InputError, match="must be 0 or more"):
        check_faults(read(SimulatedFaults, {"delay": {"a": -1e-3}}, ""), TWO)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"faults": {"gain": {"fl_fy2": 0.1}}}, "did you mean 'fl_fy'"),
        ({"travels": ["strut"]}, "travels = 'strut'"),
        ({"sampling_rate": 700.0}, "virtual.sampling_rate"),
        ({"duration": 1.00007}, "virtual.step"),
    ],
)
def test_a_measurement_that_cannot_be_is_refused_before_its_run(
    car: CutVehicle, table: dict[str, object], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        check_virtual(car, read(VirtualTable, table, ""))


def test_gaps_are_filled_far_better_than_by_a_line_and_say_how_well() -> None:
    rng = np.random.default_rng(3)
    hop = lfilter([1.0], [1.0, -1.96, 0.978], rng.normal(size=20_000))  # 12 Hz at 500 Hz, well damped
    lost = hop.copy()
    for first in range(500, 19_500, 700):
        lost[first : first + 8] = np.nan
    found, said = filled_samples(lost, PERIOD, 0.03)
    gone, at = np.isnan(lost), np.arange(len(hop))
    line = np.interp(at[gone], at[~gone], hop[~gone])
    error = np.std((found - hop)[gone])
    assert error < 0.5 * np.std(line - hop[gone])
    assert (
        0.5 * error < np.mean([gap.largest_deviation for gap in said]) < 3 * error
    )  # the largest in a gap, not the mean one
    assert (found[~gone] == hop[~gone]).all()
    kept, (gap,) = filled_samples(np.where((at > 99) & (at < 200), np.nan, hop), PERIOD, 0.03)
    assert np.isnan(kept[100:200]).all() and np.isnan(gap.largest_deviation)


@pytest.mark.grounds("closed form")
def test_half_steps_follow_cubics(car: CutVehicle, driven: VirtualMeasurement, tmp_path: Path) -> None:
    t = np.arange(-1.0, 12.0)[:, None]
    samples = 2.0 - t + 0.3 * t**2 - 0.05 * t**3
    rows = StepGrid(1e-3, 2e-3).cubic_rows(samples, 30)[:, 0]
    fine = np.arange(30) / 4
    assert np.abs(rows - (2.0 - fine + 0.3 * fine**2 - 0.05 * fine**3)).max() < 1e-13
    inputs = RecordingInputs(
        recording_of_samples(driven, driven.samples(SimulatedFaults(), 1), tmp_path / "c.bin"), car
    )
    start, end = inputs.wrenches_with_neighbours(0, 4), inputs.wrenches_with_neighbours(inputs.recording.count - 4, 4)
    assert (inputs.wrenches_with_neighbours(5, 4) == inputs.wrenches(4, 7)).all()
    assert np.allclose(start[0], 2 * start[1] - start[2]) and len(start) == len(end) == 7


def test_transducers_agree_with_one_another(car: CutVehicle, driven: VirtualMeasurement) -> None:
    value = {signal.channel: column for signal, column in zip(driven.signals, driven.values.T, strict=True)}
    assert abs(value["origin_az"][0] - 9.81) < 1e-3  # at rest on its tyres, reading upwards
    fall = np.gradient(driven.run.states[:, car.size + 2], driven.step, edge_order=2)
    assert np.abs(value["origin_az"] - 9.81 - fall)[5:-5].max() < 0.05 * np.abs(fall).max()  # tilts of some mrad
    lever = (value["roof_ay"] - value["origin_ay"]) / (1.4 - 0.6254492741749169)
    roll = np.gradient(value["roll_rate"], driven.step)
    assert np.abs(lever + roll)[5:-5].max() < 0.1 * np.abs(roll).max()  # about x, upwards is leftwards turned round
    spring = car.elements[[element.name for element in car.elements].index("front left")]
    law = (
        spring.preload
        + spring.stiffness * value["front left_travel"]
        + spring.damping * np.gradient(value["front left_travel"], driven.step)
    )
    assert np.abs(law - value["front left_force"])[5:-5].max() < 0.02 * np.ptp(value["front left_force"])


@pytest.mark.grounds("closed form")
def test_drift_by_its_closed_laws(car: CutVehicle) -> None:
    own, deviation = rigid_vehicle(car), np.tile([8.0] * 3 + [1.0] * 3, 4)
    bias = np.zeros(24)
    bias[2] = 5.0
    level = MeasurementErrors(8.0, 1.0, bias, tilt=(0.01, 0.0), rate=(0.0, 0.02))
    hub = predicted_drift(car, level, PERIOD, 8.0, "hub")
    law = own.angle_variance(deviation, PERIOD, hub.times[1:])
    assert np.abs(hub.deviations[200:] / np.sqrt(law[199:]) - 1).max() < 1e-3
    turning = np.linalg.solve(own.inertia, own.moments(bias[None])[0])
    assert np.allclose(hub.mean_errors["bias"][-1], turning * 32.0)
    assert np.allclose(hub.mean_errors["tilt at the start"][-1], [0.01, 0.0, 0.0])
    space = predicted_drift(car, level, PERIOD, 2.0, "inertial")
    late = space.mean_errors["tilt at the start"][[1000, 2000], 0]
    assert (
        abs(np.log(late[1] / late[0]) / own.toppling_rates()[0] - 1) < 0.01
    )  # cosh has become exp, products are small
    assert hub.passing_time(0.02, "rate at the start") == pytest.approx(1.0, abs=0.01)
    assert hub.angle > space.angle and space.trusted_time < hub.trusted_time == 8.0
    off = position_error(car, MeasurementErrors(0.0, 0.0, tilt=(0.01, 0.0)), PERIOD, np.array([2.0]), "hub")[0]
    assert np.allclose(off, [0.0, 9.81 * 0.01 * 2.0, 0.0])


def test_uncertainty_of_a_held_angle_is_what_its_pull_lets_through(car: CutVehicle) -> None:
    hold = AttitudeHold(force=1e-9, moment=1e-9, angle=2e-3, rate=5e-3)
    corner, h = 2 * np.pi * hold.bandwidth, PERIOD
    noise = np.random.default_rng(1).normal(size=(2, 400_000)) * np.array([[hold.angle], [hold.rate]])
    pushed = corner**2 * noise[0] + 2 * PULL_DAMPING * corner * noise[1]
    # x'' + 2 z w x' + w^2 x = pushed, by semi-implicit Euler
    c = 2 * PULL_DAMPING * corner * h
    angle = lfilter([h * h], [1.0, corner**2 * h * h + c - 2.0, 1.0 - c], pushed)
    assert 2 * angle.std() / angle_uncertainty(car, hold, h) == pytest.approx(
        1.0, abs=0.05
    )  # some hundred correlation times
    assert angle_uncertainty(car, replace(hold, method="none"), h) == 0.0


def test_a_channel_that_disagrees_is_told_from_its_noise() -> None:
    answer = SectionChannel("a", "N", "")
    band = ChannelComparison(
        _signal("a"),
        answer,
        0.0,
        (FrequencyBand(0.0, 9.0, 10.0, 3.0), FrequencyBand(9.0, 99.0, 0.0, 4.0)),
        0.0,
        {},
        np.inf,
    )
    assert channel_disagreement(band) == pytest.approx(0.5)  # 5 of 10
    assert channel_disagreement(band, 3.0) == pytest.approx(np.sqrt(16 / 91))
    assert channel_disagreement(band, np.nan) == channel_disagreement(band) and channel_disagreement(band, 5.0) == 0.0


@pytest.fixture(scope="module")
def planar(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    true = simulate(road_scene(duration=1.5, step=1e-3), "reference")
    pairs = [
        (_signal(f"{at}{side}", at=f"{at} {side}"), share * true[force])
        for at, force in (("front", "f1"), ("rear", "f2"))
        for side, share in (("left", 0.55), ("right", 0.45))
    ]
    pairs += [
        (_signal("pitch", "angle", "chassis", "pitch"), -true["pitch"]),
        (_signal("rate", "angular rate", "chassis", "pitch"), -true["pitch_rate"]),
    ]
    columns = SampleFile(tmp_path_factory.mktemp("plane") / "c.bin", tuple(s.name for s, _ in pairs), len(true.times))
    columns.write(0, np.column_stack([values for _, values in pairs]))
    return Recording(tuple(s for s, _ in pairs), columns, 1e-3)


def test_a_recording_on_the_pitch_plane_gives_its_pitch_back(planar: Recording, tmp_path: Path) -> None:
    found = plane_run(PlaneRunSettings(planar, "itwm_drift", hold=AttitudeHold(force=10.0)), tmp_path / "run")
    pitch = found.outcome.columns.read("chassis pitch")
    assert np.abs(pitch - planar.samples(planar.find_signals("angle")[0])).max() < 1e-4
    assert (
        found.verdict.word == "accepted" and found.outcome.normalised_innovation < 1.0
    )  # nothing but the stated noise is missing
    free = plane_run(PlaneRunSettings(planar, "itwm_drift", hold=AttitudeHold("none", force=2000.0)), tmp_path / "free")
    assert free.verdict.word == "stabilise" and free.trust is not None and free.trust.until is not None


def test_a_free_run_on_turning_forces_is_accepted_only_beside_its_pitch(planar: Recording, tmp_path: Path) -> None:
    turning = replace(planar, signals=tuple(replace(s, frame="body") for s in planar.signals))
    job = PlaneRunSettings(turning, "itwm_drift", hold=AttitudeHold("none", force=10.0))
    assert plane_run(job, tmp_path / "right").verdict.word == "accepted"
    # nothing grows where forces turn with the vehicle, so that its own prediction never ends
    blind = replace(turning, signals=turning.signals[:4])
    unseen = plane_run(replace(job, recording=blind), tmp_path / "blind").verdict
    assert unseen.word == "stabilise" and "no measured pitch" in unseen.reason
    names = planar.columns.names
    tilted = SampleFile(tmp_path / "tilted.bin", names, planar.count)
    tilted.write(0, planar.columns.block(names, 0, planar.count) + 0.03 * (np.array(names) == "pitch"))
    off = plane_run(replace(job, recording=replace(turning, columns=tilted)), tmp_path / "off").verdict
    assert off.word == "stabilise" and "0.03 rad off the measured one" in off.reason


def test_another_vehicle_or_a_missing_wheel_is_refused(planar: Recording, tmp_path: Path) -> None:
    names = planar.columns.names
    light = SampleFile(tmp_path / "light.bin", names, planar.count)
    light.write(0, 0.8 * planar.columns.block(names, 0, planar.count))
    with pytest.raises(InputError, match="too little"):
        plane_run(
            PlaneRunSettings(replace(planar, columns=light), "itwm_drift", hold=AttitudeHold("none")),
            tmp_path / "light",
        )
    fewer = replace(planar, signals=planar.signals[1:])
    with pytest.raises(InputError, match="both 'front left' and 'front right'"):
        plane_run(PlaneRunSettings(fewer, "itwm_drift", hold=AttitudeHold("none")), tmp_path / "fewer")
