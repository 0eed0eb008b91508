"""A virtual measurement, written to files, read back, held and compared with the truth that it came from."""

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
from models.measured.faults_of_measurement import Faults
from models.measured.formats import write
from models.measured.recording import Recording
from models.systems.hub_forces.measurement import HubForces, hub_model
from models.systems.measured.run import read_files as read_files
from models.systems.measured.section_run import AttitudeHold, SectionOutcome, SectionRun
from models.systems.measured.section_run import run as march
from models.systems.measured.sections import Sections
from models.systems.measured.trust import MeasurementErrors, predicted_drift
from models.systems.measured.verdict import errors_of_run, judge, judge_beside_truth
from models.systems.measured.virtual import (
    VirtualMeasurement,
    VirtualTable,
    channel_group,
    map_lines,
    virtual_measurement,
)
from models.vehicles.cut_vehicle import PITCH, ROLL, CutVehicle, cut, rigid
from models.vehicles.vehicle_file import SHIPPED, load_vehicle
from validation.common.rows import Observed, Row, System, Table, behaviour_row, not_run
from validation.measured import measured_car
from validation.measured import recording as moving_car

TITLE = "Measurement files against the truth"
SYSTEM: System = "drift"
SEED, SAMPLES = 61, 10
FORMATS = ("csv", "mf4", "rsp", "tdms")
NOISE = {"force": 8.0, "moment": 1.0, "angle": np.radians(0.1), "angular rate": 5e-3}
"""N, N m, rad, rad/s: hub forces to 0.2 % of their largest, an inertial unit to 0.1 degrees."""
RECORDER_DELAY = 0.003
"""s, by which the inertial unit's recorder is late, which the scene states."""
DAMAGE = 0.03
SAMPLING_RATE, DURATION = 500.0, 5.0
"""Hz, s, of the proofs."""
COPIES = 16
"""Paths of the ensembles beside a predicted time of trust."""


@dataclass(frozen=True)
class Proof:
    """One virtual measurement to prove the whole chain: vehicle file, frame of the hub forces, bits of the converter,
    stabiliser, and file formats."""

    name: str
    vehicle: str
    frame: str
    bits: int
    hold: AttitudeHold
    formats: tuple[str, ...]


PROOFS = (
    Proof("r19_free", "r19_free", "hub", 16, AttitudeHold(), FORMATS),
    Proof("own", "own.toml", "inertial", 12, AttitudeHold(bandwidth=1.0), ("mf4",)),
)


def measure(quick: bool, folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows: in full every proof with ten samples of noise, the engines and the predicted time of trust."""
    if quick:
        return _quick(folder), {}
    rows, data = list[Row](), dict[str, Any]()
    for proof in PROOFS:
        proved, ratios = _run_all_formats(proof, folder / proof.name)
        rows += proved
        data[proof.name] = ratios
    return [*rows, *_trust_times(), *_moving(folder / "moving")], data


def own_vehicle(folder: Path) -> str:
    """A vehicle file of a user's own: R19-free with every spring, damper and mass another, none symmetric."""
    text, number = (SHIPPED / "r19_free.toml").read_text(encoding="utf-8"), count()

    def scaled(number_match: re.Match[str]) -> str:
        return f"{number_match[1]} = {float(number_match[2]) * (1.0 + 0.02 * (next(number) % 11 - 5))!r}"

    (folder / "own.toml").write_text(re.sub(r"^(mass|stiffness|damping) = ([\d.e+]+)$", scaled, text, flags=re.M))
    return "own.toml"


def measured(proof_case: Proof, folder: Path, duration: float) -> VirtualMeasurement:
    """The virtual measurement of a vehicle on its road; faults and noise are added to each sample later."""
    table = {
        "duration": duration,
        "sampling_rate": SAMPLING_RATE,
        "frame": proof_case.frame,
        "sections": ["front left"],
    }
    vehicle = cut(load_vehicle(proof_case.vehicle, folder), "body")
    return virtual_measurement(vehicle, read(VirtualTable, table, ""), "mujoco")


def faults(bits: int) -> Faults:
    """All faults that are planted in the measurement."""
    table = {
        "noise": NOISE,
        "delay": dict.fromkeys(("angle", "angular rate"), RECORDER_DELAY),
        "quantisation": {"bits": bits},
        "dropouts": {"rate": 0.1, "length": 0.02, "channels": ["force", "moment"]},
    }
    return read(Faults, table, "")


def recorded(
    virtual: VirtualMeasurement, samples: np.ndarray, vehicle: str, format_name: str, folder: Path
) -> Recording:
    """Samples written as two recorders would, one for hubs and one for the inertial unit, in a file format, and read
    back through a scene."""
    folder.mkdir(parents=True)
    inertial = np.array([signal.at == virtual.vehicle.chassis for signal in virtual.signals])
    text = ['title = "proof"', 'system = "measured"', "[vehicle]", f'file = "{vehicle}"']
    for name, chosen, offset in (("hubs", ~inertial, 0.0), ("unit", inertial, -RECORDER_DELAY)):
        signals = tuple(signal for signal, taken in zip(virtual.signals, chosen, strict=True) if taken)
        write(folder / f"{name}.{format_name}", [channel_group(signals, samples[:, chosen], virtual.period)])
        text.append(map_lines(signals, f"{name}.{format_name}", offset))
    (folder / "scene.toml").write_text("\n".join(text))
    if (taken := folder.parent / vehicle).is_file():
        (folder / vehicle).write_bytes(taken.read_bytes())
    return read_files(load(folder / "scene.toml"), folder)


def held_run(recording: Recording, vehicle: CutVehicle, hold: AttitudeHold, engine: str = "mujoco") -> SectionRun:
    """The run of a recording, ready to be marched, with the vehicle's attitude stabilised as ``hold`` says."""
    return SectionRun(vehicle, recording, Sections(vehicle), engine, hold)


def _run_all_formats(proof_case: Proof, folder: Path) -> tuple[list[Row], dict[str, dict[str, float]]]:
    """Rows and mean damage of ten noise samples through every file format, stabilised. The first sample is also run
    free and in the other engine."""
    folder.mkdir()
    own_vehicle(folder)
    true, planted = measured(proof_case, folder, DURATION), faults(proof_case.bits)
    ratios: dict[str, list[dict[str, float]]] = {form: [] for form in proof_case.formats}
    off = dict.fromkeys(proof_case.formats, 0.0)
    for path in range(SAMPLES):
        samples, known = true.samples(planted, SEED, path), list[tuple[np.ndarray, dict[str, float]]]()
        for form in proof_case.formats:
            format_folder = folder / f"{form}{path}"
            recording = recorded(true, samples, proof_case.vehicle, form, format_folder)
            off[form] = max(off[form], _largest_channel_change(recording, true, samples))
            values = recording.columns.block(recording.columns.names, 0, recording.count)
            damage = next(
                (damages for other_format, damages in known if _differ_by_rounding(values, other_format)), None
            )
            if damage is None:
                damage = errors_of_run(
                    march(held_run(recording, true.vehicle, proof_case.hold), format_folder / "run"), true
                ).damage
                known.append((values, damage))
            ratios[form].append(damage)
    means = {
        form: {name: float(np.mean([damages[name] for damages in ratios_of])) for name in ratios_of[0]}
        for form, ratios_of in ratios.items()
    }
    rows = [row for form in proof_case.formats for row in _rows(proof_case, form, off[form], means[form])]
    first = recorded(true, true.samples(planted, SEED), proof_case.vehicle, "csv", folder / "beside")
    return [*rows, *_rows_of_other_runs(proof_case, first, true, folder)], means


def _differ_by_rounding(first: np.ndarray, second_samples: np.ndarray) -> bool:
    """Whether two recordings differ only by rounding from unit conversion, in which case a single run serves for
    both."""
    largest = np.maximum(np.nanmax(np.abs(first), axis=0), 1e-300)
    return bool(np.allclose(first / largest, second_samples / largest, rtol=0.0, atol=1e-12, equal_nan=True))


def _largest_channel_change(recording: Recording, true_measurement: VirtualMeasurement, samples: np.ndarray) -> float:
    """Largest change of a hub channel by writing, mapping and resampling, relative to the channel's largest value;
    infinite if other samples are missing."""
    largest_change = 0.0
    for i, signal in enumerate(true_measurement.signals):
        if signal.at in true_measurement.vehicle.hubs:
            back = recording.samples(next(s for s in recording.signals if s.channel == signal.channel))
            gone = np.isnan(samples[:, i])
            if (np.isnan(back) != gone).any():
                return np.inf
            off = float(np.nanmax(np.abs(back - samples[:, i]))) / max(float(np.nanmax(np.abs(samples[:, i]))), 1e-300)
            largest_change = max(largest_change, off)
    return largest_change


def _rows(proof_case: Proof, format_name: str, off: float, means: dict[str, float]) -> list[Row]:
    worst = max(means, key=lambda name: abs(means[name] - 1))
    what = f"{proof_case.name}, frame {proof_case.frame!r}, {proof_case.bits} bit, through {format_name}"
    return [
        Observed(
            f"measured_virtual.values_{proof_case.name}_{format_name}",
            SYSTEM,
            f"change of hub channels by writing, reading and mapping, relative to their largest value; {what}",
            off,
            "1",
        ).at_most(
            2**-23 if format_name == "rsp" else 1e-12,
            "RPC III holds single precision, the others every bit; units cost a rounding",
            "native",
        ),
        Observed(
            f"measured_virtual.damage_{proof_case.name}_{format_name}",
            SYSTEM,
            f"ratio of the damage (slope 5) of {worst} to the true damage, the farthest of "
            f"{len(means)} springs, mounts and bars, mean of {SAMPLES} samples of noise; {what}",
            means[worst],
            "1",
        ).within(1.0, DAMAGE, "demanded; body-frame section forces of the run held by the filter", "none"),
    ]


def _rows_of_other_runs(
    proof_case: Proof, first: Recording, true_measurement: VirtualMeasurement, folder: Path
) -> list[Row]:
    """Rows: the recording run in both engines, free and stabilised, and the verdicts on these runs."""
    free = held_run(first, true_measurement.vehicle, AttitudeHold("none"))
    jobs = {engine: held_run(first, true_measurement.vehicle, proof_case.hold, engine) for engine in ENGINES[1:]}
    runs = {engine: march(job, folder / engine) for engine, job in jobs.items()}
    beside, two = (run.columns.block(run.columns.names, 0, run.done) for run in runs.values())
    apart = float((np.abs(beside - two).max(axis=0) / np.maximum(np.abs(beside).max(axis=0), 1e-6)).max())
    last_run = runs[ENGINES[-1]]
    blind = judge(jobs[ENGINES[-1]], last_run)
    rows = [
        Observed(
            f"measured_virtual.engines_{proof_case.name}",
            SYSTEM,
            "difference between the channels of Exudyn and MuJoCo, over the largest value of each; "
            f"{proof_case.name}, stabilised, {first.duration:g} s",
            apart,
            "1",
        ).at_most(1e-6, "same tableau, same step", "shared kernel"),
        behaviour_row(
            f"measured_virtual.verdict_{proof_case.name}",
            SYSTEM,
            f"verdict of the stabilised run without the truth; {proof_case.name}",
            blind.word,
            "accepted",
            f"{blind.reason}; beside the truth, 5 % for each damage of this one "
            f"sample of noise: {judge_beside_truth(last_run, true_measurement, proof_case.hold).word}",
        ),
    ]
    level = MeasurementErrors(NOISE["force"], NOISE["moment"])
    until = predicted_drift(
        true_measurement.vehicle, level, first.period, first.duration, proof_case.frame
    ).trusted_time
    try:
        run = march(free, folder / "free")
    except RunFailed as error:
        assert isinstance(error.partial, SectionOutcome)
        run = error.partial
    sentence = judge(free, run, trusted=until)
    rows.append(
        Observed(
            f"measured_virtual.free_{proof_case.name}",
            SYSTEM,
            f"time at which the free vehicle's run ends on these forces, frame {proof_case.frame!r}; "
            f"verdict: {sentence.word}, {sentence.reason}",
            (run.done - 1) * run.period,
            "s",
        ).beside(first.duration, "stated")
    )
    return rows


def _trust_times() -> list[Row]:
    """Rows: ratio of the median drift-off time of an ensemble to the predicted time of trust."""
    vehicle, rows = cut(load_vehicle("r19_free"), "body"), list[Row]()
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
        drift_off = float(np.median([_drift_off(vehicle, true, level, path) for path in range(COPIES)]))
        rows.append(
            Observed(
                f"measured_virtual.trust_{name}",
                SYSTEM,
                "ratio of the median time at which roll or pitch is off by 0.05 rad to the predicted "
                f"time, {COPIES} free runs on a rough road ({name}, {frame!r})",
                drift_off / predicted,
                "1",
            ).within(1.0, 0.2, "demanded; the median of 16 has a deviation of 3 to 10 %", "closed form")
        )
    return rows


def _drift_off(
    vehicle: CutVehicle, true_measurement: VirtualMeasurement, drift_level: MeasurementErrors, path: int
) -> float:
    samples = true_measurement.run.wrenches.reshape(len(true_measurement.run.times), -1)
    forces = HubForces(
        samples + (0.0 if drift_level.bias is None else drift_level.bias),
        true_measurement.step,
        true_frame(true_measurement),
    )
    deviation = np.tile(np.repeat([drift_level.force, drift_level.moment], 3), len(vehicle.hubs))
    start = np.zeros(2 * vehicle.size)
    start[[ROLL, PITCH]] = drift_level.tilt
    run = hub_model(
        "mujoco",
        vehicle,
        forces.with_noise(deviation, SEED, path),
        true_measurement.step,
        float(true_measurement.run.times[-1]),
        "smooth",
    )
    states = run.marched(*np.split(start, 2)).states
    off = np.abs((states - true_measurement.run.states[: len(states)])[:, [ROLL, PITCH]]).max(axis=1) > 0.05
    return float(true_measurement.run.times[off.argmax()]) if off.any() else np.inf


def true_frame(true_measurement: VirtualMeasurement) -> str:
    """Frame of the hub forces of a virtual measurement."""
    return next(signal.frame for signal in true_measurement.signals if signal.at in true_measurement.vehicle.hubs)


def _moving(folder: Path) -> list[Row]:
    """Rows on a real car: a telephone's gyro and accelerometers compared with the angles of its camera, from two files
    with different clocks."""
    path, what = moving_car.find(), "telephone and camera of a moving car, two files on one clock:"
    if path is None:
        id, gyro = "measured_virtual.moving_gyro", f"{what} ratio of the gyro to the camera's angles"
        return [not_run(id, SYSTEM, gyro, f"TWINRIG_DATA does not lead to {moving_car.RECORDING_FILE}")]
    scene = measured_car.scene(path, cut(load_vehicle("r19_free"), "body"), folder)
    recording = read_files(scene, folder)
    findings = check_recording(recording, None, scene.places, {})
    ratio = next((f.size for f in findings if f.check == "turning" and "pitch_rate" in f.place), None)
    shift = next((f.size for f in findings if f.check == "shift" and "roll_rate" in f.place), None)
    up = [recording.samples(recording.find("acceleration", "phone", axis)[0]).mean() for axis in "xyz"]
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


def _quick(folder: Path) -> list[Row]:
    """Rows of the quick share: one short noise sample through a file, the damage of a spring, and the closed law of
    drift."""
    proof = PROOFS[0]
    true = measured(proof, folder, 0.6)
    samples = true.samples(read(Faults, {"noise": NOISE}, ""), SEED)
    recording = recorded(true, samples, proof.vehicle, "csv", folder / "quick")
    run = march(held_run(recording, true.vehicle, proof.hold), folder / "quick" / "run")
    wrong = errors_of_run(run, true)
    level = MeasurementErrors(8.0, 1.0)
    law = rigid(true.vehicle).angle_variance(np.tile([8.0] * 3 + [1.0] * 3, 4), true.period, np.array([10.0]))
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
    """Mean damage of every section force, through every format."""
    tables = []
    for name, means in case_data.items():
        elements = next(iter(means.values()))
        rows = tuple((element, *(f"{of_form[element]:.4f}" for of_form in means.values())) for element in elements)
        tables.append(
            Table(
                f"Ratio of the damage to the true damage, {name}, mean of {SAMPLES} samples of noise",
                "Section forces in the chassis' axes, slope 5, held by the filter.",
                ("element", *means),
                rows,
            )
        )
    return tables
