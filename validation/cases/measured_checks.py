"""Checks of a recording before it is used: planted faults must be named with their size, and clean recordings must
pass."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from models.core.finding import Finding
from models.measured.checks import check
from models.measured.faults_of_measurement import SimulatedFaults
from models.systems.measured.virtual import VirtualMeasurement
from models.vehicles.cut_vehicle import GRAVITY
from validation.common.rows import Observed, Row, System, Table, behaviour_row, not_run
from validation.measured import measured_car
from validation.measured import recording as car
from validation.measured.planted import (
    NOISE,
    SEED,
    PlantedMeasurementFault,
    Ride,
    clipped_channel,
    drifting_findings,
    drop_samples,
    errors_and_doubts,
    exchanged_hubs,
    hold_sample,
    measurement,
    moments_about_point,
    planted_findings,
    scaled_channels,
    spiked_channel,
)
from validation.spatial.cars import r19

TITLE = "Checks of a recording"
SYSTEM: System = "drift"
ROADS_OF_CLEAN_RECORDINGS: tuple[Ride, ...] = (
    ("A", 1, 30.0, 15.0),
    ("B", 2, 20.0, 5.0),
    ("C", 3, 20.0, 20.0),
    ("D", 5, 10.0, 15.0),
)
"""ISO class, seed, speed (m/s) and duration (s) of the roads of clean recordings."""
NOISE_SAMPLE_COUNT = 4
FAULT_SIZE_TOLERANCE = 0.2
"""Relative tolerance of the size that a check states for a planted fault."""
VERTICAL_FORCE_CHANNELS = tuple(f"{hub}_fz" for hub in ("fl", "fr", "rl", "rr"))
DEGREES_PER_RADIAN = 180 / np.pi
PLANTED_DELAY = 3e-3
FAULTS_OF_QUICK_RUN = (
    PlantedMeasurementFault(
        "3 ms late, one force", "shift", "fl_fz", PLANTED_DELAY, "s", faults={"delay": {"fl_fz": PLANTED_DELAY}}
    ),
    PlantedMeasurementFault(
        "left and right front wheel swapped", "swapped", "fl with fr", 1.0, "", exchanged_hubs(("fl", "fr"))
    ),
    PlantedMeasurementFault("gap of 0.5 s", "gaps", "rr_fz", 0.5, "s", drop_samples("rr_fz", 3.0, 0.5)),
)
TRANSDUCER_FAULTS: tuple[tuple[str, str, str, float, str, str, dict[str, float]], ...] = (
    ("3 ms late, one hub", "shift", "all channels of rr", PLANTED_DELAY, "s", "delay", {"rr": PLANTED_DELAY}),
    (
        "3 ms early, one force",
        "shift",
        "rl_fz",
        -PLANTED_DELAY,
        "s",
        "delay",
        {**dict.fromkeys(NOISE, PLANTED_DELAY), "rl_fz": 0.0},
    ),
    (
        "3 ms late, one accelerometer",
        "shift",
        "all channels of shelf",
        PLANTED_DELAY,
        "s",
        "delay",
        {"shelf": PLANTED_DELAY},
    ),
    (
        "3 ms late, all inertial channels",
        "shift",
        "all inertial",
        PLANTED_DELAY,
        "s",
        "delay",
        dict.fromkeys(("acceleration", "angular rate", "angle"), PLANTED_DELAY),
    ),
    ("40 ms late, one force", "shift", "fr_fz", 4e-2, "s", "delay", {"fr_fz": 4e-2}),
    ("2 % too much, front wheel", "gain", "fl_fz", 2.0, "%", "gain", {"fl_fz": 0.02}),
    ("2 % too little, rear wheel", "gain", "rr_fz", -2.0, "%", "gain", {"rr_fz": -0.02}),
    ("offset of 30 N, one force", "offset", "rl_fz", -30.0, "N", "bias", {"rl_fz": -30.0}),
    ("3 % too much, accelerometer", "gain", "tower_az", 3.0, "%", "gain", {"tower_az": 0.03}),
    ("noise four times as stated", "noise", "rr_fy", 32.0, "N", "noise", {"rr_fy": 32.0}),
)
"""Faults of transducers: name, check that must detect the fault, place, size and unit of the expected finding, kind of
the fault, and its amount by channel."""
SCALE_FAULTS: tuple[tuple[str, str, float, tuple[str, ...]], ...] = (
    ("kN for N, one wheel", "unit", 1e-3, ("fr_fz",)),
    ("N for kN, all wheels", "unit", 1e3, VERTICAL_FORCE_CHANNELS),
    ("degrees for radians, angle", "unit", DEGREES_PER_RADIAN, ("roll",)),
    ("degrees for radians, rate", "unit", DEGREES_PER_RADIAN, ("pitch_rate",)),
    ("g for m/s^2", "unit", 1 / 9.80665, ("rail_az",)),
    ("sign of a side force", "sign", -1.0, ("rl_fy",)),
    ("sign of a vertical force", "sign", -1.0, ("fl_fz",)),
    ("sign of an angle", "sign", -1.0, ("roll",)),
    ("sign of an accelerometer", "sign", -1.0, ("tower_ay",)),
)
SWAPPED_HUBS = {
    "front and rear left wheel swapped": (("fl", "rl"),),
    "wheels swapped across": (("fl", "rr"),),
    "sides swapped, both axles": (("fl", "fr"), ("rl", "rr")),
}
LEVER_FAULTS = {
    "moments about the contact patch, all wheels": (-0.3, ("fl", "fr", "rl", "rr")),
    "moments about the contact patch, one wheel": (-0.34, ("rr",)),
    "moments referred to the hub twice, one axle": (0.3, ("fl", "fr")),
}
FURTHER_FAULTS = (
    *(
        PlantedMeasurementFault(name, check, place, size, unit, faults={key: amounts})
        for name, check, place, size, unit, key, amounts in TRANSDUCER_FAULTS
    ),
    PlantedMeasurementFault(
        "gravity not included", "gravity", "tower_az", 9.81, "m/s^2", scaled_channels(1.0, "tower_az", offset=-9.81)
    ),
    *(
        PlantedMeasurementFault(name, check, of[0], factor, "1", scaled_channels(factor, *of))
        for name, check, factor, of in SCALE_FAULTS
    ),
    *(
        PlantedMeasurementFault(
            name, "swapped", " and ".join(f"{a} with {b}" for a, b in pairs), 1.0, "", exchanged_hubs(*pairs)
        )
        for name, pairs in SWAPPED_HUBS.items()
    ),
    *(
        PlantedMeasurementFault(name, "lever", " and ".join(hubs), lever, "m", moments_about_point(lever, *hubs))
        for name, (lever, hubs) in LEVER_FAULTS.items()
    ),
    PlantedMeasurementFault("clipped, 0.5 % of samples", "clipped", "fl_fz", 0.5, "%", clipped_channel("fl_fz", 0.005)),
    PlantedMeasurementFault("value held for 0.3 s", "clipped", "rl_mx", 0.3, "s", hold_sample("rl_mx", 4.0, 0.3)),
    PlantedMeasurementFault("value held for 0.06 s", "clipped", "fl_fz", 0.06, "s", hold_sample("fl_fz", 4.0, 0.06)),
    PlantedMeasurementFault("spike of one sample", "spikes", "rl_my", 2e3, "N m", spiked_channel("rl_my", 4.0, 2e3)),
    PlantedMeasurementFault("dead channel", "clipped", "rl_mx", 15.0, "s", scaled_channels(0.0, "rl_mx")),
)


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows of single faults on one road; a full run also has clean recordings on four roads, several faults at once,
    and other noise samples."""
    virtual = measurement(road=("C", 1, 20.0, 5.0)) if quick else measurement()
    rows, finding_texts = [], dict[str, str]()
    for fault in FAULTS_OF_QUICK_RUN if quick else FAULTS_OF_QUICK_RUN + FURTHER_FAULTS:
        findings = planted_findings(virtual, work_folder, fault.spoil, **fault.faults)
        rows += _planted_fault_rows(fault, findings)
        finding_texts[fault.name] = findings[0].text if findings else "nothing"
    rows.append(_clean_recordings_row("quick", [planted_findings(virtual, work_folder)]))
    if not quick:
        rows += [
            *_clean_recording_rows(work_folder),
            *_wrong_vehicle_rows(work_folder),
            *_three_faults_at_once_rows(virtual, work_folder),
            _mean_delay_row(virtual, work_folder),
        ]
        size = 1e6 * _stated_fault_size(drifting_findings(virtual, 5e-4, work_folder), "drift")
        rows += [
            _stated_size_row("clocks", "drift between the clocks of two files", size, "1e-6", 500.0),
            *_moving_car_check_rows(work_folder),
        ]
    return rows, {"said": finding_texts}


def _stated_fault_size(findings: Sequence[Finding], check_name: str, finding_location: str = "") -> float:
    """Size that the first finding of a check states at a place; NaN if there is no such finding."""
    sizes = [finding.size for finding in findings if finding.check == check_name and finding_location in finding.place]
    return float("nan") if not sizes or sizes[0] is None else sizes[0]


def _stated_size_row(row_name: str, quantity_name: str, stated_size: float, unit: str, planted_size: float) -> Row:
    """Row that compares the size that a check states with the size of the planted fault."""
    id, why = f"measured_checks.{row_name}", "what was planted, 20 %"
    return Observed(id, SYSTEM, quantity_name, stated_size, unit).within(
        planted_size, FAULT_SIZE_TOLERANCE * abs(planted_size), why, "closed form"
    )


def _no_findings_row(row_name: str, quantity_name: str, finding_texts: list[str], tolerance_reason: str) -> Row:
    """Row that passes if there are no findings."""
    id, finding_text = f"measured_checks.{row_name}", "; ".join(finding_texts) or tolerance_reason
    return Observed(id, SYSTEM, quantity_name, len(finding_texts), "").within(0, 0, finding_text, "closed form")


def _planted_fault_rows(planted_fault: PlantedMeasurementFault, findings: tuple[Finding, ...]) -> list[Row]:
    """Rows on one planted fault: the right check names the fault at the right place, no other fault is named, and the
    size is right."""
    key = planted_fault.name.replace(" ", "_").replace(",", "").replace("%", "percent").replace("^", "")
    named = any(finding.check == planted_fault.check and planted_fault.place in finding.place for finding in findings)
    alone = all(finding.check == planted_fault.check for finding in findings)
    word = "named" if named and alone else f"{[finding.check for finding in findings]}"
    why = f"'{planted_fault.check}' at {planted_fault.place or 'the vehicle'}, and nothing else"
    rows = [
        behaviour_row(
            f"measured_checks.{key}.named",
            SYSTEM,
            f"the planted fault is named: {planted_fault.name}",
            word,
            "named",
            why,
        )
    ]
    if planted_fault.check != "swapped":
        size = _stated_fault_size(findings, planted_fault.check, planted_fault.place)
        rows.append(
            _stated_size_row(
                f"{key}.size", f"{planted_fault.name}: its size", size, planted_fault.unit, planted_fault.size
            )
        )
    return rows


def _clean_recordings_row(recording_set: str, findings_of_recordings: list[tuple[Finding, ...]]) -> Row:
    """Row: the checks report no error and no doubt for recordings without a fault."""
    what = f"errors and doubts in {len(findings_of_recordings)} clean recordings"
    return _no_findings_row(
        f"clean.{recording_set}",
        what,
        [finding.text for findings in findings_of_recordings for finding in findings],
        "noise as stated, nothing planted",
    )


def _clean_recording_rows(work_folder: Path) -> list[Row]:
    """Rows: no errors or doubts for clean recordings of 5 to 20 s, from four roads, two vehicles and two noise samples
    each."""
    return [
        _clean_recordings_row(
            vehicle,
            [
                planted_findings(measurement(vehicle, road), work_folder, seed=seed)
                for road in roads
                for seed in range(2)
            ],
        )
        for vehicle, roads in (("r19_free", ROADS_OF_CLEAN_RECORDINGS), ("twin", ROADS_OF_CLEAN_RECORDINGS[1::2]))
    ]


def _wrong_vehicle_rows(work_folder: Path) -> list[Row]:
    """Rows on recordings of a car that differs from its vehicle file R19-free: heavier, with stiffer springs, or with
    weaker dampers."""
    findings_by_car = {
        name: errors_and_doubts(
            replace(of_recording, vehicle=r19()), of_recording.samples(SimulatedFaults(noise=NOISE), SEED), work_folder
        )
        for name, of_recording in ((name, measurement(name)) for name in ("loaded", "stiff", "worn"))
    }
    errors = [
        finding.text
        for of_recording in findings_by_car.values()
        for finding in of_recording
        if finding.weight == "error"
    ]
    what = "80 kg more on board than in the file: excess of weight"
    wanted, excess = 100 * 80 / (r19().loads.sum() / GRAVITY), _stated_fault_size(findings_by_car["loaded"], "weight")
    id, why = "measured_checks.loaded", "what was loaded, 20 %"
    quantity = (
        "errors named where the car is 80 kg heavier, has springs 20 % stiffer or dampers 30 % weaker than its file"
    )
    return [
        Observed(id, SYSTEM, what, excess, "%").within(wanted, FAULT_SIZE_TOLERANCE * 6.6, why, "closed form"),
        _no_findings_row("strangers", quantity, errors, "doubts are allowed, errors would stop a good recording"),
    ]


def _three_faults_at_once_rows(virtual_measurement: VirtualMeasurement, work_folder: Path) -> list[Row]:
    """Rows: three faults at once are all named, and the size of one of them is right."""
    spoil = exchanged_hubs(("fl", "fr")), scaled_channels(1e-3, "rr_fz")
    findings = planted_findings(virtual_measurement, work_folder, *spoil, delay={"rl_fz": PLANTED_DELAY})
    what, checks = (
        "wheels swapped, kN for N, 3 ms late at once: the findings",
        ", ".join(sorted({f.check for f in findings})),
    )
    id = "measured_checks.together.named"
    last = [finding for finding in findings if finding.check == "shift"][-1:]
    return [
        behaviour_row(id, SYSTEM, what, checks, "shift, swapped, unit", "each at its place"),
        _stated_size_row(
            "together.size",
            "size of the delay among several faults",
            _stated_fault_size(last, "shift"),
            "s",
            PLANTED_DELAY,
        ),
    ]


def _mean_delay_row(virtual_measurement: VirtualMeasurement, work_folder: Path) -> Row:
    """Row: mean over several noise samples of the delay that the check states for one channel, as a test of its
    bias."""
    samples = [
        planted_findings(virtual_measurement, work_folder, seed=seed, **FAULTS_OF_QUICK_RUN[0].faults)
        for seed in range(NOISE_SAMPLE_COUNT)
    ]
    late = 1e3 * float(
        np.mean([_stated_fault_size(findings[:1], findings[0].check) if findings else np.nan for findings in samples])
    )
    what = f"3 ms late, one force: mean over {NOISE_SAMPLE_COUNT} samples of noise"
    why = "5 %: the response is linear, the vehicle is not"
    return Observed("measured_checks.spread", SYSTEM, what, late, "ms").within(3.0, 0.15, why, "closed form")


def _moving_car_check_rows(work_folder: Path) -> list[Row]:
    """Rows: inertial checks of a telephone recording in a real car, if the recording is available."""
    path = car.find_recording()
    if path is None:
        return [
            not_run("measured_checks.car", SYSTEM, "what the inertial checks say of a moving car", "no recording here")
        ]
    clean = measured_car.samples(path)
    degrees, down = clean.copy(), clean.copy()
    degrees[:, 4] *= DEGREES_PER_RADIAN
    down[:, :6] *= np.tile(measured_car.TELEPHONE_TO_CAR, 2)
    findings = {
        name: check(measured_car.phone_recording(values, work_folder / f"{name}.columns"), None)
        for name, values in (("clean", clean), ("degrees", degrees), ("down", down))
    }
    errors = {
        name: {finding.place: finding for finding in ones if finding.weight == "error"}
        for name, ones in findings.items()
    }
    turned = [finding for signal_names, finding in errors["degrees"].items() if signal_names == "q and pitch"]
    size = turned[0].size if turned and turned[0].size is not None else float("nan")
    what = "moving car with axes right and down, taken for left and up: faults named"
    return [
        behaviour_row(
            "measured_checks.car.errors",
            SYSTEM,
            "errors named in a moving car's accelerometers, gyros and pose",
            ", ".join(errors["clean"]) or "none",
            "none",
            "signs and units are right",
        ),
        behaviour_row(
            "measured_checks.car.down",
            SYSTEM,
            what,
            ", ".join(sorted(errors["down"])),
            "az, q and pitch",
            "gravity and the turning of the pose tell",
        ),
        _stated_size_row(
            "car.degrees",
            "moving car with degrees for radians in pitch: size of the fault",
            size,
            "1",
            DEGREES_PER_RADIAN,
        ),
        Observed(
            "measured_checks.car.ratio",
            SYSTEM,
            "ratio of the gyro's pitch rate to that of the camera's pose, moving car",
            _stated_fault_size(findings["clean"], "turning", "pitch"),
            "1",
        ).beside(1.0, "a telephone beside a camera at 20 Hz"),
    ]


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Table of the findings that the checks report to an engineer."""
    rows = tuple((name, text) for name, text in case_data["said"].items())
    return [Table("What the checks say of planted faults", "The first sentence of each.", ("planted", "said"), rows)]


def draw(case_data: dict[str, Any]) -> list[tuple[str, Any]]:
    """No figure."""
    return []
