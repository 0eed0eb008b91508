"""A virtual measurement that is written to files, read back, stabilised, and compared with its true run."""

import re
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import RunFailed
from models.core.strict import read
from models.core.systems import load
from models.engines.cut_vehicle import ENGINES
from models.measured.checks import check as check_recording
from models.measured.faults_of_measurement import SimulatedFaults
from models.measured.formats import write
from models.measured.recording import Recording
from models.systems.hub_forces.measurement import HubForces, hub_model
from models.systems.measured.run import read_files as read_files
from models.systems.measured.section_run import AttitudeHold, SectionOutcome, SectionRunSettings
from models.systems.measured.section_run import run as march
from models.systems.measured.sections import Sections
from models.systems.measured.trust import MeasurementErrors, predicted_drift
from models.systems.measured.verdict import errors_of_run, judge_beside_truth, judge_run
from models.systems.measured.virtual import (
    VirtualMeasurement,
    VirtualTable,
    channel_group,
    map_lines,
    virtual_measurement,
)
from models.vehicles.cut_vehicle import PITCH, ROLL, CutVehicle, cut_at_hubs, rigid_vehicle
from models.vehicles.vehicle_file import SHIPPED_FOLDER, load_vehicle
from validation.common.rows import Observed, Row, System, Table, behaviour_row, not_run
from validation.measured import measured_car
from validation.measured import recording as moving_car

TITLE = "Measurement files against the truth"
SYSTEM: System = "drift"
SEED, NOISE_SAMPLE_COUNT = 61, 10
FILE_FORMATS = ("csv", "mf4", "rsp", "tdms")
NOISE_DEVIATIONS = {"force": 8.0, "moment": 1.0, "angle": np.radians(0.1), "angular rate": 5e-3}
"""Standard deviations of the noise (N, N m, rad, rad/s): hub forces to 0.2 % of their largest, angles of an inertial
unit to 0.1 degrees."""
RECORDER_DELAY = 0.003
"""Delay (s) of the inertial unit's recorder, which the scene states."""
DAMAGE_TOLERANCE = 0.03
SAMPLING_RATE, DURATION = 500.0, 5.0
"""Sampling rate (Hz) and length (s) of the virtual measurements."""
NOISE_PATH_COUNT = 16
"""Number of paths in the ensembles that are compared with a predicted time of trust."""


@dataclass(frozen=True)
class MeasurementChainTest:
    """One virtual measurement that tests the whole chain from sensor to damage: vehicle file, frame of the hub forces,
    bits of the converter, stabiliser, and file formats."""

    name: str
    vehicle_file: str
    force_frame: str
    converter_bits: int
    attitude_hold: AttitudeHold
    file_formats: tuple[str, ...]


MEASUREMENT_CHAIN_TESTS = (
    MeasurementChainTest("r19_free", "r19_free", "hub", 16, AttitudeHold(), FILE_FORMATS),
    MeasurementChainTest("own", "own.toml", "inertial", 12, AttitudeHold(bandwidth=1.0), ("mf4",)),
)


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows on virtual measurements through the whole chain of files, run and damage with ten noise samples, on the
    engines, and on the predicted time of trust; a quick run has one short noise sample."""
    if quick:
        return _quick_rows(work_folder), {}
    rows, data = list[Row](), dict[str, Any]()
    for chain_test in MEASUREMENT_CHAIN_TESTS:
        proved, ratios = _file_format_rows(chain_test, work_folder / chain_test.name)
        rows += proved
        data[chain_test.name] = ratios
    return [*rows, *_trust_time_rows(), *_moving_car_rows(work_folder / "moving")], data


def write_user_vehicle(work_folder: Path) -> str:
    """Write a vehicle file that differs from R19-free in every spring, damper and mass, without symmetry; returns its
    name."""
    text, number = (SHIPPED_FOLDER / "r19_free.toml").read_text(encoding="utf-8"), count()

    def scaled_entry(number_match: re.Match[str]) -> str:
        return f"{number_match[1]} = {float(number_match[2]) * (1.0 + 0.02 * (next(number) % 11 - 5))!r}"

    (work_folder / "own.toml").write_text(
        re.sub(r"^(mass|stiffness|damping) = ([\d.e+]+)$", scaled_entry, text, flags=re.M)
    )
    return "own.toml"


def measurement_of_test(chain_test: MeasurementChainTest, work_folder: Path, duration: float) -> VirtualMeasurement:
    """The virtual measurement of a vehicle on a road; faults and noise are added to each sample later."""
    table = {
        "duration": duration,
        "sampling_rate": SAMPLING_RATE,
        "frame": chain_test.force_frame,
        "sections": ["front left"],
    }
    vehicle = cut_at_hubs(load_vehicle(chain_test.vehicle_file, work_folder), "body")
    return virtual_measurement(vehicle, read(VirtualTable, table, ""), "mujoco")


def planted_faults(converter_bits: int) -> SimulatedFaults:
    """All faults that are planted in the measurement."""
    table = {
        "noise": NOISE_DEVIATIONS,
        "delay": dict.fromkeys(("angle", "angular rate"), RECORDER_DELAY),
        "quantisation": {"bits": converter_bits},
        "dropouts": {"rate": 0.1, "length": 0.02, "channels": ["force", "moment"]},
    }
    return read(SimulatedFaults, table, "")


def recording_from_files(
    simulated_measurement: VirtualMeasurement,
    measured_samples: np.ndarray,
    vehicle_name: str,
    format_name: str,
    work_folder: Path,
) -> Recording:
    """Recording read back through a scene, after two recorders, one for hubs and one for the inertial unit, have
    written the samples in a file format."""
    work_folder.mkdir(parents=True)
    inertial = np.array(
        [signal.at == simulated_measurement.vehicle.chassis for signal in simulated_measurement.signals]
    )
    text = ['title = "proof"', 'system = "measured"', "[vehicle]", f'file = "{vehicle_name}"']
    for name, chosen, offset in (("hubs", ~inertial, 0.0), ("unit", inertial, -RECORDER_DELAY)):
        signals = tuple(signal for signal, taken in zip(simulated_measurement.signals, chosen, strict=True) if taken)
        write(
            work_folder / f"{name}.{format_name}",
            [channel_group(signals, measured_samples[:, chosen], simulated_measurement.period)],
        )
        text.append(map_lines(signals, f"{name}.{format_name}", offset))
    (work_folder / "scene.toml").write_text("\n".join(text))
    if (taken := work_folder.parent / vehicle_name).is_file():
        (work_folder / vehicle_name).write_bytes(taken.read_bytes())
    return read_files(load(work_folder / "scene.toml"), work_folder)


def stabilised_run(
    recording: Recording, vehicle: CutVehicle, attitude_hold: AttitudeHold, engine_name: str = "mujoco"
) -> SectionRunSettings:
    """Run of a recording, ready to be started, with the vehicle's attitude stabilised as ``attitude_hold`` says."""
    return SectionRunSettings(vehicle, recording, Sections(vehicle), engine_name, attitude_hold)


def _file_format_rows(
    chain_test: MeasurementChainTest, work_folder: Path
) -> tuple[list[Row], dict[str, dict[str, float]]]:
    """Rows and mean damage ratios of ten noise samples through every file format, stabilised. The first sample is also
    run free and in the other engine."""
    work_folder.mkdir()
    write_user_vehicle(work_folder)
    true, planted = measurement_of_test(chain_test, work_folder, DURATION), planted_faults(chain_test.converter_bits)
    ratios: dict[str, list[dict[str, float]]] = {form: [] for form in chain_test.file_formats}
    off = dict.fromkeys(chain_test.file_formats, 0.0)
    for path in range(NOISE_SAMPLE_COUNT):
        samples, known = true.samples(planted, SEED, path), list[tuple[np.ndarray, dict[str, float]]]()
        for form in chain_test.file_formats:
            format_folder = work_folder / f"{form}{path}"
            recording = recording_from_files(true, samples, chain_test.vehicle_file, form, format_folder)
            off[form] = max(off[form], _largest_channel_change(recording, true, samples))
            values = recording.columns.block(recording.columns.names, 0, recording.count)
            damage = next(
                (damages for other_format, damages in known if _differ_by_rounding(values, other_format)), None
            )
            if damage is None:
                damage = errors_of_run(
                    march(stabilised_run(recording, true.vehicle, chain_test.attitude_hold), format_folder / "run"),
                    true,
                ).damage
                known.append((values, damage))
            ratios[form].append(damage)
    means = {
        form: {name: float(np.mean([damages[name] for damages in ratios_of])) for name in ratios_of[0]}
        for form, ratios_of in ratios.items()
    }
    rows = [row for form in chain_test.file_formats for row in _damage_rows(chain_test, form, off[form], means[form])]
    first = recording_from_files(
        true, true.samples(planted, SEED), chain_test.vehicle_file, "csv", work_folder / "beside"
    )
    return [*rows, *_engine_and_free_run_rows(chain_test, first, true, work_folder)], means


def _differ_by_rounding(first_samples: np.ndarray, second_samples: np.ndarray) -> bool:
    """Whether two recordings differ only by rounding of the unit conversion; then one run serves for both."""
    largest = np.maximum(np.nanmax(np.abs(first_samples), axis=0), 1e-300)
    return bool(np.allclose(first_samples / largest, second_samples / largest, rtol=0.0, atol=1e-12, equal_nan=True))


def _largest_channel_change(
    recording: Recording, true_measurement: VirtualMeasurement, measured_samples: np.ndarray
) -> float:
    """Largest change of a hub channel by writing, mapping and resampling, divided by the channel's largest value;
    infinite if other samples are missing."""
    largest_change = 0.0
    for i, signal in enumerate(true_measurement.signals):
        if signal.at in true_measurement.vehicle.hubs:
            back = recording.samples(next(s for s in recording.signals if s.channel == signal.channel))
            gone = np.isnan(measured_samples[:, i])
            if (np.isnan(back) != gone).any():
                return np.inf
            off = float(np.nanmax(np.abs(back - measured_samples[:, i]))) / max(
                float(np.nanmax(np.abs(measured_samples[:, i]))), 1e-300
            )
            largest_change = max(largest_change, off)
    return largest_change


def _damage_rows(
    chain_test: MeasurementChainTest, format_name: str, channel_change: float, mean_damage_ratios: dict[str, float]
) -> list[Row]:
    """Rows: change of the hub channels by a file format, and the least accurate mean damage ratio."""
    worst = max(mean_damage_ratios, key=lambda name: abs(mean_damage_ratios[name] - 1))
    what = (
        f"{chain_test.name}, frame {chain_test.force_frame!r}, {chain_test.converter_bits} bit, through {format_name}"
    )
    return [
        Observed(
            f"measured_virtual.values_{chain_test.name}_{format_name}",
            SYSTEM,
            f"change of hub channels by writing, reading and mapping, relative to their largest value; {what}",
            channel_change,
            "1",
        ).at_most(
            2**-23 if format_name == "rsp" else 1e-12,
            "RPC III holds single precision, the others every bit; units cost a rounding",
            "native",
        ),
        Observed(
            f"measured_virtual.damage_{chain_test.name}_{format_name}",
            SYSTEM,
            f"ratio of the damage (slope 5) of {worst} to the true damage, the farthest of "
            f"{len(mean_damage_ratios)} springs, mounts and bars, mean of "
            f"{NOISE_SAMPLE_COUNT} samples of noise; {what}",
            mean_damage_ratios[worst],
            "1",
        ).within(1.0, DAMAGE_TOLERANCE, "demanded; body-frame section forces of the run held by the filter", "none"),
    ]


def _engine_and_free_run_rows(
    chain_test: MeasurementChainTest, recording: Recording, true_measurement: VirtualMeasurement, work_folder: Path
) -> list[Row]:
    """Rows: the recording simulated in Exudyn and MuJoCo, free and stabilised, and the verdicts on these runs."""
    free = stabilised_run(recording, true_measurement.vehicle, AttitudeHold("none"))
    jobs = {
        engine: stabilised_run(recording, true_measurement.vehicle, chain_test.attitude_hold, engine)
        for engine in ENGINES[1:]
    }
    runs = {engine: march(job, work_folder / engine) for engine, job in jobs.items()}
    beside, two = (run.columns.block(run.columns.names, 0, run.done) for run in runs.values())
    apart = float((np.abs(beside - two).max(axis=0) / np.maximum(np.abs(beside).max(axis=0), 1e-6)).max())
    last_run = runs[ENGINES[-1]]
    blind = judge_run(jobs[ENGINES[-1]], last_run)
    rows = [
        Observed(
            f"measured_virtual.engines_{chain_test.name}",
            SYSTEM,
            "difference between the channels of Exudyn and MuJoCo, over the largest value of each; "
            f"{chain_test.name}, stabilised, {recording.duration:g} s",
            apart,
            "1",
        ).at_most(1e-6, "same tableau, same step", "shared kernel"),
        behaviour_row(
            f"measured_virtual.verdict_{chain_test.name}",
            SYSTEM,
            f"verdict of the stabilised run without the truth; {chain_test.name}",
            blind.word,
            "accepted",
            f"{blind.reason}; beside the truth, 5 % for each damage of this one "
            f"sample of noise: {judge_beside_truth(last_run, true_measurement, chain_test.attitude_hold).word}",
        ),
    ]
    level = MeasurementErrors(NOISE_DEVIATIONS["force"], NOISE_DEVIATIONS["moment"])
    until = predicted_drift(
        true_measurement.vehicle, level, recording.period, recording.duration, chain_test.force_frame
    ).trusted_time
    try:
        run = march(free, work_folder / "free")
    except RunFailed as error:
        assert isinstance(error.partial, SectionOutcome)
        run = error.partial
    sentence = judge_run(free, run, trusted_time=until)
    rows.append(
        Observed(
            f"measured_virtual.free_{chain_test.name}",
            SYSTEM,
            f"time at which the free vehicle's run ends on these forces, frame {chain_test.force_frame!r}; "
            f"verdict: {sentence.word}, {sentence.reason}",
            (run.done - 1) * run.period,
            "s",
        ).beside(recording.duration, "stated")
    )
    return rows


def _trust_time_rows() -> list[Row]:
    """Rows: median drift-off time of an ensemble divided by the predicted drift-off time."""
    vehicle, rows = cut_at_hubs(load_vehicle("r19_free"), "body"), list[Row]()
    bias = np.zeros(6 * len(vehicle.hubs))
    bias[2] = 3.0
    cases = (
        ("noise", "inertial", 3.0, MeasurementErrors(8.0, 1.0)),
        ("bias", "hub", 5.0, MeasurementErrors(20.0, 4.0, bias)),
        ("tilt", "inertial", 1.6, MeasurementErrors(8.0, 1.0, tilt=(0.004, 0.0))),
    )
    for name, frame, duration, level in cases:
        virtual = read(
            VirtualTable, {"duration": duration, "step": 2e-3, "sampling_rate": SAMPLING_RATE, "frame": frame}, ""
        )
        true = virtual_measurement(vehicle, virtual, "mujoco")
        predicted = predicted_drift(vehicle, level, 1 / SAMPLING_RATE, duration, frame).passing_time()
        assert predicted is not None
        drift_off = float(np.median([_drift_off_time(vehicle, true, level, path) for path in range(NOISE_PATH_COUNT)]))
        rows.append(
            Observed(
                f"measured_virtual.trust_{name}",
                SYSTEM,
                "ratio of the median time at which roll or pitch is off by 0.05 rad to the predicted "
                f"time, {NOISE_PATH_COUNT} free runs on a rough road ({name}, {frame!r})",
                drift_off / predicted,
                "1",
            ).within(1.0, 0.2, "demanded; the median of 16 has a deviation of 3 to 10 %", "closed form")
        )
    return rows


def _drift_off_time(
    vehicle: CutVehicle, true_measurement: VirtualMeasurement, measurement_errors: MeasurementErrors, noise_path: int
) -> float:
    """Time (s) at which a run on one noise path drifts off."""
    samples = true_measurement.run.wrenches.reshape(len(true_measurement.run.times), -1)
    forces = HubForces(
        samples + (0.0 if measurement_errors.bias is None else measurement_errors.bias),
        true_measurement.step,
        frame_of_measurement(true_measurement),
    )
    deviation = np.tile(np.repeat([measurement_errors.force, measurement_errors.moment], 3), len(vehicle.hubs))
    start = np.zeros(2 * vehicle.size)
    start[[ROLL, PITCH]] = measurement_errors.tilt
    run = hub_model(
        "mujoco",
        vehicle,
        forces.with_noise(deviation, SEED, noise_path),
        true_measurement.step,
        float(true_measurement.run.times[-1]),
        "smooth",
    )
    states = run.marched(*np.split(start, 2)).states
    off = np.abs((states - true_measurement.run.states[: len(states)])[:, [ROLL, PITCH]]).max(axis=1) > 0.05
    return float(true_measurement.run.times[off.argmax()]) if off.any() else np.inf


def frame_of_measurement(true_measurement: VirtualMeasurement) -> str:
    """Frame of the hub forces of a virtual measurement."""
    return next(signal.frame for signal in true_measurement.signals if signal.at in true_measurement.vehicle.hubs)


def _moving_car_rows(work_folder: Path) -> list[Row]:
    """Rows on a real car: a telephone's gyro and accelerometers compared with the angles of its camera, from two files
    with different clocks."""
    path, what = moving_car.find_recording(), "telephone and camera of a moving car, two files on one clock:"
    if path is None:
        id, gyro = "measured_virtual.moving_gyro", f"{what} ratio of the gyro to the camera's angles"
        return [not_run(id, SYSTEM, gyro, f"TWINRIG_DATA does not lead to {moving_car.RECORDING_FILE}")]
    scene = measured_car.recording_scene(path, cut_at_hubs(load_vehicle("r19_free"), "body"), work_folder)
    recording = read_files(scene, work_folder)
    findings = check_recording(recording, None, scene.places, {})
    ratio = next((f.size for f in findings if f.check == "turning" and "pitch_rate" in f.place), None)
    shift = next((f.size for f in findings if f.check == "shift" and "roll_rate" in f.place), None)
    up = [recording.samples(recording.find_signals("acceleration", "phone", axis)[0]).mean() for axis in "xyz"]
    id, gyro = (
        "measured_virtual.moving",
        f"{what} ratio of the gyro's pitch rate to the derivative of the camera's angle",
    )
    late = f"{what} time by which the gyro's roll rate is late against the camera, as the check finds it"
    means, why = f"{what} mean of the accelerations", "a telephone's accelerometers are off by one or two per cent"
    mounted, size = "two devices, each as it was mounted", float(np.linalg.norm(up))
    gyro = f"{gyro}, as the check finds it"
    return [
        Observed(f"{id}_gyro", SYSTEM, gyro, ratio or 0.0, "1").within(1.0, 0.1, mounted, "none"),
        Observed(f"{id}_shift", SYSTEM, late, shift or 0.0, "s").beside("", "two clocks"),
        Observed(f"{id}_gravity", SYSTEM, means, size, "m/s^2").within(9.81, 0.2, why, "none"),
    ]


def _quick_rows(work_folder: Path) -> list[Row]:
    """Rows of a quick run: one short noise sample through a file, the damage of a spring, and the closed law of
    drift."""
    chain_test = MEASUREMENT_CHAIN_TESTS[0]
    true = measurement_of_test(chain_test, work_folder, 0.6)
    samples = true.samples(read(SimulatedFaults, {"noise": NOISE_DEVIATIONS}, ""), SEED)
    recording = recording_from_files(true, samples, chain_test.vehicle_file, "csv", work_folder / "quick")
    run = march(stabilised_run(recording, true.vehicle, chain_test.attitude_hold), work_folder / "quick" / "run")
    wrong = errors_of_run(run, true)
    level = MeasurementErrors(8.0, 1.0)
    law = rigid_vehicle(true.vehicle).angle_variance(np.tile([8.0] * 3 + [1.0] * 3, 4), true.period, np.array([10.0]))
    deviations = predicted_drift(true.vehicle, level, true.period, 10.0, "hub").deviations[-1]
    return [
        Observed(
            "measured_virtual.values",
            SYSTEM,
            "change of hub channels by a CSV file, map and clock, over their largest value",
            _largest_channel_change(recording, true, samples),
            "1",
        ).at_most(1e-12, "units cost a rounding", "native"),
        Observed(
            "measured_virtual.damage",
            SYSTEM,
            "ratio of the damage (slope 5) of the front left spring to the true damage, 0.6 s of a rough road",
            wrong.damage["front left"],
            "1",
        ).within(1.0, 0.1, "one sample of noise", "none"),
        Observed(
            "measured_virtual.law",
            SYSTEM,
            "difference of roll, pitch and heading after 10 s of noise from the law q t^3/3",
            float(np.abs(deviations / np.sqrt(law[0]) - 1).max()),
            "1",
        ).at_most(1e-4, "no growth in the frame of the hubs", "closed form"),
    ]


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Tables of the mean damage ratio of every section force, through every format."""
    tables = []
    for name, means in case_data.items():
        elements = next(iter(means.values()))
        rows = tuple((element, *(f"{of_form[element]:.4f}" for of_form in means.values())) for element in elements)
        tables.append(
            Table(
                f"Ratio of the damage to the true damage, {name}, mean of {NOISE_SAMPLE_COUNT} samples of noise",
                "Section forces in the chassis' axes, slope 5, held by the filter.",
                ("element", *means),
                rows,
            )
        )
    return tables
