"""A recording is checked before it is believed: planted faults are named with their size, clean recordings pass."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy.interpolate import make_interp_spline

from models.core.finding import Finding
from models.measured.checks import check
from models.measured.faults_of_measurement import Faults
from models.measured.signal import Place
from models.systems.hub_forces.scene import Road
from models.systems.measured.virtual import VirtualMeasurement, VirtualTable, recording, virtual_measurement
from models.vehicles.cut_vehicle import GRAVITY, CutVehicle, cut
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.vehicle_file import load_vehicle
from validation.cases.hub_forces import r19, twin
from validation.common.rows import Row, System, Table, behaves, finding, not_run, within
from validation.measured import measured_car
from validation.measured import recording as car

TITLE = "Checks of a recording"
SYSTEM: System = "drift"
SEED = 61
SENSORS = {"rail": [0.3, 0.5, 0.4], "tower": [1.0, 0.0, 0.7], "shelf": [-1.2, -0.3, 0.6], "bonnet": [1.3, -0.5, 0.8]}
"""Accelerometers on the chassis, m."""
NOISE: dict[str, float] = {"force": 8.0, "moment": 1.0, "acceleration": 0.05, "angular rate": 5e-3, "angle": 1.75e-3}
"""White noise on every sample, SI."""
Ride = tuple[Literal["A", "B", "C", "D"], int, float, float]
ROADS: tuple[Ride, ...] = (("A", 1, 30.0, 15.0), ("B", 2, 20.0, 5.0), ("C", 3, 20.0, 20.0), ("D", 5, 10.0, 15.0))
"""Class, seed, speed (m/s) and length (s) of clean recordings."""
Samples = Callable[[VirtualMeasurement, np.ndarray], np.ndarray]
SAMPLES = 4
SHARE = 0.2
"""Part of a planted size by which what is found may be off."""


@dataclass(frozen=True)
class Planted:
    """A fault: ``check`` and a part of the ``place`` that must be named, and the ``size`` in its ``unit``."""

    name: str
    check: str
    place: str
    size: float
    unit: str
    faults: dict[str, Any]
    change: Samples | None = None


def _columns(found: VirtualMeasurement, *names: str) -> list[int]:
    return [[s.name for s in found.signals].index(name) for name in names]


def _times(factor: float, *names: str, add: float = 0.0) -> Samples:
    """Samples of some channels, times a factor."""

    def change(found: VirtualMeasurement, samples: np.ndarray) -> np.ndarray:
        samples[:, _columns(found, *names)] = factor * samples[:, _columns(found, *names)] + add
        return samples

    return change


def _exchanged(*pairs: tuple[str, str]) -> Samples:
    """All channels of hubs, exchanged."""

    def change(found: VirtualMeasurement, samples: np.ndarray) -> np.ndarray:
        for one, two in pairs:
            own, other = (
                _columns(found, *(f"{hub}_{c}" for c in ("fx", "fy", "fz", "mx", "my", "mz"))) for hub in (one, two)
            )
            samples[:, own + other] = samples[:, other + own]
        return samples

    return change


def _lost(name: str, begin: float, length: float) -> Samples:
    def change(found: VirtualMeasurement, samples: np.ndarray) -> np.ndarray:
        first = round(begin / found.period)
        samples[first : first + round(length / found.period), _columns(found, name)] = np.nan
        return samples

    return change


def _held(name: str, begin: float, length: float) -> Samples:
    def change(found: VirtualMeasurement, samples: np.ndarray) -> np.ndarray:
        first, (own,) = round(begin / found.period), _columns(found, name)
        samples[first : first + round(length / found.period), own] = samples[first, own]
        return samples

    return change


def _spiked(name: str, time: float, height: float) -> Samples:
    """One sample of a channel too high."""

    def change(found: VirtualMeasurement, samples: np.ndarray) -> np.ndarray:
        samples[round(time / found.period), _columns(found, name)] += height
        return samples

    return change


def _clipped(name: str, part: float) -> Samples:
    """The largest samples of a channel cut off."""

    def change(found: VirtualMeasurement, samples: np.ndarray) -> np.ndarray:
        (own,) = _columns(found, name)
        samples[:, own] = np.minimum(samples[:, own], np.quantile(samples[:, own], 1 - part))
        return samples

    return change


def referred(lever: float, *hubs: str) -> Samples:
    """Moments of hubs about a point so far (m) above them: (Mx + r Fy, My - r Fx)."""

    def change(found: VirtualMeasurement, samples: np.ndarray) -> np.ndarray:
        for hub in hubs:
            fx, fy, mx, my = _columns(found, *(f"{hub}_{name}" for name in ("fx", "fy", "mx", "my")))
            samples[:, mx] += lever * samples[:, fy]
            samples[:, my] -= lever * samples[:, fx]
        return samples

    return change


VERTICAL = tuple(f"{hub}_fz" for hub in ("fl", "fr", "rl", "rr"))
QUICK = (
    Planted("3 ms late, one force", "shift", "fl_fz", 3e-3, "s", {"delay": {"fl_fz": 3e-3}}),
    Planted("left and right front wheel swapped", "swapped", "fl with fr", 1.0, "", {}, _exchanged(("fl", "fr"))),
    Planted("gap of 0.5 s", "gaps", "rr_fz", 0.5, "s", {}, _lost("rr_fz", 3.0, 0.5)),
)
FULL = (
    Planted("3 ms late, one hub", "shift", "all channels of rr", 3e-3, "s", {"delay": {"rr": 3e-3}}),
    Planted(
        "3 ms early, one force", "shift", "rl_fz", -3e-3, "s", {"delay": dict.fromkeys(NOISE, 3e-3) | {"rl_fz": 0.0}}
    ),
    Planted("3 ms late, one accelerometer", "shift", "all channels of shelf", 3e-3, "s", {"delay": {"shelf": 3e-3}}),
    Planted(
        "3 ms late, all inertial channels",
        "shift",
        "all inertial",
        3e-3,
        "s",
        {"delay": {"acceleration": 3e-3, "angular rate": 3e-3, "angle": 3e-3}},
    ),
    Planted("40 ms late, one force", "shift", "fr_fz", 4e-2, "s", {"delay": {"fr_fz": 4e-2}}),
    Planted("2 % too much, front wheel", "gain", "fl_fz", 2.0, "%", {"gain": {"fl_fz": 0.02}}),
    Planted("2 % too little, rear wheel", "gain", "rr_fz", -2.0, "%", {"gain": {"rr_fz": -0.02}}),
    Planted("offset of 30 N, one force", "offset", "rl_fz", -30.0, "N", {"bias": {"rl_fz": -30.0}}),
    Planted("3 % too much, accelerometer", "gain", "tower_az", 3.0, "%", {"gain": {"tower_az": 0.03}}),
    Planted("gravity not included", "gravity", "tower_az", 9.81, "m/s^2", {}, _times(1.0, "tower_az", add=-9.81)),
    Planted("kN for N, one wheel", "unit", "fr_fz", 1e-3, "1", {}, _times(1e-3, "fr_fz")),
    Planted("N for kN, all wheels", "unit", "fl_fz", 1e3, "1", {}, _times(1e3, *VERTICAL)),
    Planted("degrees for radians, angle", "unit", "roll", 180 / np.pi, "1", {}, _times(180 / np.pi, "roll")),
    Planted("degrees for radians, rate", "unit", "pitch_rate", 180 / np.pi, "1", {}, _times(180 / np.pi, "pitch_rate")),
    Planted("g for m/s^2", "unit", "rail_az", 1 / 9.80665, "1", {}, _times(1 / 9.80665, "rail_az")),
    Planted("sign of a side force", "sign", "rl_fy", -1.0, "1", {}, _times(-1.0, "rl_fy")),
    Planted("sign of a vertical force", "sign", "fl_fz", -1.0, "1", {}, _times(-1.0, "fl_fz")),
    Planted("sign of an angle", "sign", "roll", -1.0, "1", {}, _times(-1.0, "roll")),
    Planted("sign of an accelerometer", "sign", "tower_ay", -1.0, "1", {}, _times(-1.0, "tower_ay")),
    Planted("front and rear left wheel swapped", "swapped", "fl with rl", 1.0, "", {}, _exchanged(("fl", "rl"))),
    Planted("wheels swapped across", "swapped", "fl with rr", 1.0, "", {}, _exchanged(("fl", "rr"))),
    Planted(
        "sides swapped, both axles",
        "swapped",
        "fl with fr and rl with rr",
        1.0,
        "",
        {},
        _exchanged(("fl", "fr"), ("rl", "rr")),
    ),
    Planted(
        "moments about the contact patch, all wheels",
        "lever",
        "fl and fr and rl and rr",
        -0.3,
        "m",
        {},
        referred(-0.3, "fl", "fr", "rl", "rr"),
    ),
    Planted("moments about the contact patch, one wheel", "lever", "rr", -0.34, "m", {}, referred(-0.34, "rr")),
    Planted(
        "moments referred to the hub twice, one axle", "lever", "fl and fr", 0.3, "m", {}, referred(0.3, "fl", "fr")
    ),
    Planted("clipped, 0.5 % of samples", "clipped", "fl_fz", 0.5, "%", {}, _clipped("fl_fz", 0.005)),
    Planted("value held for 0.3 s", "clipped", "rl_mx", 0.3, "s", {}, _held("rl_mx", 4.0, 0.3)),
    Planted("value held for 0.06 s", "clipped", "fl_fz", 0.06, "s", {}, _held("fl_fz", 4.0, 0.06)),
    Planted("spike of one sample", "spikes", "rl_my", 2e3, "N m", {}, _spiked("rl_my", 4.0, 2e3)),
    Planted("dead channel", "clipped", "rl_mx", 15.0, "s", {}, _times(0.0, "rl_mx")),
    Planted("noise four times as stated", "noise", "rr_fy", 32.0, "N", {"noise": {"rr_fy": 32.0}}),
)


@cache
def measurement(
    vehicle: str = "r19_free", road: Ride = ("C", 1, 20.0, 15.0), rate: float = 500.0
) -> VirtualMeasurement:
    """A car on a road: class, seed, speed and length; it and the four accelerometers are read at a rate (Hz)."""
    kind, seed, speed, duration = road
    own = VirtualTable(
        road=Road(iso8608=kind, seed=seed, speed=speed),
        duration=duration,
        step=2e-3,
        sampling_rate=rate,
        accelerometers=SENSORS,
    )
    return virtual_measurement(_vehicle(vehicle), own, "mujoco")


def _vehicle(name: str) -> CutVehicle:
    """R19-free; without any symmetry; with 80 kg on board; on springs 20 % stiffer; on dampers 30 % weaker."""
    whole = load_vehicle("r19_free")
    body, *others = whole.bodies
    loaded = replace(whole, bodies=(replace(body, mass=body.mass + 80), *others))
    made = {
        "r19_free": whole,
        "twin": twin(),
        "loaded": loaded,
        "stiff": _sprung(whole, 1.2, 1.0),
        "worn": _sprung(whole, 1.0, 0.7),
    }
    return cut(made[name], "body")


def _sprung(whole: SpatialVehicle, stiffer: float, damped: float) -> SpatialVehicle:
    springs = tuple(replace(s, stiffness=stiffer * s.stiffness, damping=damped * s.damping) for s in whole.springs)
    return replace(whole, springs=springs)


def findings(found: VirtualMeasurement, samples: np.ndarray, folder: Path) -> tuple[Finding, ...]:
    """Errors and doubts of samples (m, signals)."""
    own = recording(found, samples, folder / f"{len(list(folder.iterdir()))}.columns")
    places = {name: Place("body", (x, y, z)) for name, (x, y, z) in SENSORS.items()}
    claimed = {s.name: NOISE[s.quantity] for s in found.signals}
    return tuple(one for one in check(own, found.vehicle, places, claimed) if one.weight != "note")


def planted(fault: Planted, found: VirtualMeasurement, folder: Path, seed: int = SEED) -> tuple[Finding, ...]:
    """What is found in a recording with a fault."""
    noise = NOISE | fault.faults.get("noise", {})
    samples = found.samples(Faults(**{**fault.faults, "noise": noise}), seed)
    return findings(found, fault.change(found, samples) if fault.change else samples, folder)


def measure(quick: bool, folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Single faults on one road; in full also clean recordings on four, faults together, and other noise."""
    found = measurement(road=("C", 1, 20.0, 5.0)) if quick else measurement()
    rows, said = [], dict[str, str]()
    for fault in QUICK if quick else QUICK + FULL:
        own = planted(fault, found, folder)
        rows += _rows(fault, own)
        said[fault.name] = own[0].text if own else "nothing"
    rows.append(_quiet("quick", [findings(found, found.samples(Faults(noise=NOISE), SEED), folder)]))
    if quick:
        return rows, {"said": said}
    return [
        *rows,
        *_clean(folder),
        *_strangers(folder),
        *_together(found, folder),
        _spread(found, folder),
        _clocks(found, folder),
        *_moving_car(folder),
    ], {"said": said}


def _rows(fault: Planted, own: tuple[Finding, ...]) -> list[Row]:
    """Named at the right place, nothing else named, and its size."""
    key = "measured_checks." + fault.name.replace(" ", "_").replace(",", "").replace("%", "percent").replace("^", "")
    named = [one for one in own if one.check == fault.check and fault.place in one.place]
    others = [one for one in own if one.check != fault.check]
    word = "named" if named and not others else f"{[one.check for one in own]}"
    rows = [
        behaves(
            f"{key}.named",
            SYSTEM,
            f"{fault.name}: the finding",
            word,
            "named",
            f"'{fault.check}' at {fault.place or 'the vehicle'}, and nothing else",
        )
    ]
    if fault.check == "swapped":
        return rows
    size = named[0].size if named and named[0].size is not None else float("nan")
    return [
        *rows,
        within(
            f"{key}.size",
            SYSTEM,
            f"{fault.name}: its size",
            size,
            fault.unit,
            fault.size,
            SHARE * abs(fault.size),
            "what was planted, 20 %",
            "closed form",
        ),
    ]


def _quiet(name: str, found: list[tuple[Finding, ...]]) -> Row:
    """No error and no doubt in clean recordings."""
    alarms = [one.text for own in found for one in own]
    why = "; ".join(alarms) or "noise as stated, nothing planted"
    return within(
        f"measured_checks.clean.{name}",
        SYSTEM,
        f"errors and doubts in {len(found)} clean recordings",
        len(alarms),
        "",
        0,
        0,
        why,
        "closed form",
    )


def _clean(folder: Path) -> list[Row]:
    """Four roads, two vehicles, two samples of noise each; recordings of 5 to 20 s."""
    rows = []
    for vehicle in ("r19_free", "twin"):
        found = []
        for road in ROADS if vehicle == "r19_free" else ROADS[1::2]:
            own = measurement(vehicle, road)
            found += [findings(own, own.samples(Faults(noise=NOISE), seed), folder) for seed in range(2)]
        rows.append(_quiet(vehicle, found))
    return rows


def _strangers(folder: Path) -> list[Row]:
    """A car that is not the one of the file: heavier, or with other springs."""
    loaded = _by_the_file("loaded", folder)
    weight = [one.size for one in loaded if one.check == "weight"]
    value = float("nan") if not weight or weight[0] is None else weight[0]
    others = [*loaded, *_by_the_file("stiff", folder), *_by_the_file("worn", folder)]
    errors = [one.text for one in others if one.weight == "error"]
    why = "; ".join(errors) or "doubts are allowed, errors would stop a good recording"
    return [
        within(
            "measured_checks.loaded",
            SYSTEM,
            "80 kg more on board than in the file: excess of weight",
            value,
            "%",
            100 * 80 / (r19().loads.sum() / GRAVITY),
            SHARE * 6.6,
            "what was loaded, 20 %",
            "closed form",
        ),
        within(
            "measured_checks.strangers",
            SYSTEM,
            "errors named where the car is 80 kg heavier, has springs 20 % "
            "stiffer or dampers 30 % weaker than its file",
            len(errors),
            "",
            0,
            0,
            why,
            "closed form",
        ),
    ]


def _by_the_file(name: str, folder: Path) -> tuple[Finding, ...]:
    """Findings in a recording of another car, by the file of R19-free."""
    own = measurement(name)
    return findings(replace(own, vehicle=r19()), own.samples(Faults(noise=NOISE), SEED), folder)


def _together(found: VirtualMeasurement, folder: Path) -> list[Row]:
    """Three faults at once: all of them named."""
    samples = found.samples(Faults(noise=NOISE, delay={"rl_fz": 3e-3}), SEED)
    samples = _times(1e-3, "rr_fz")(found, _exchanged(("fl", "fr"))(found, samples))
    own = {one.check: one for one in findings(found, samples, folder)}
    late = own["shift"].size if "shift" in own else None
    return [
        behaves(
            "measured_checks.together.named",
            SYSTEM,
            "wheels swapped, kN for N, 3 ms late at once: the findings",
            ", ".join(sorted(own)),
            "shift, swapped, unit",
            "each at its place",
        ),
        within(
            "measured_checks.together.size",
            SYSTEM,
            "the same: delay",
            float("nan") if late is None else late,
            "s",
            3e-3,
            SHARE * 3e-3,
            "what was planted, 20 %",
            "closed form",
        ),
    ]


def _spread(found: VirtualMeasurement, folder: Path) -> Row:
    """The delay of one channel over samples of noise: its bias."""
    named = [planted(QUICK[0], found, folder, seed) for seed in range(SAMPLES)]
    sizes = [own[0].size for own in named if own and own[0].size is not None]
    value = 1e3 * float(np.mean(sizes)) if len(sizes) == SAMPLES else float("nan")
    return within(
        "measured_checks.spread",
        SYSTEM,
        f"3 ms late, one force: mean over {SAMPLES} samples of noise",
        value,
        "ms",
        3.0,
        0.15,
        "5 %: the response is linear, the vehicle is not",
        "closed form",
    )


def drifting(found: VirtualMeasurement, fast: float, folder: Path) -> tuple[Finding, ...]:
    """Findings where all but the hub forces is in a file whose clock is fast by a part."""
    samples, driving = found.samples(Faults(noise=NOISE), SEED), ("force", "moment")
    times = found.period * np.arange(len(samples))
    for i in (i for i, s in enumerate(found.signals) if s.quantity not in driving):
        samples[:, i] = make_interp_spline(times, samples[:, i])(np.minimum(times / (1 + fast), times[-1]))
    signals = tuple(replace(s, file="wheels" if s.quantity in driving else "inertial") for s in found.signals)
    return findings(replace(found, signals=signals), samples, folder)


def _clocks(found: VirtualMeasurement, folder: Path) -> Row:
    """Drift between the clocks of two files."""
    named = [one.size for one in drifting(found, 5e-4, folder) if one.check == "drift"]
    value = 1e6 * named[0] if named and named[0] is not None else float("nan")
    return within(
        "measured_checks.clocks",
        SYSTEM,
        "drift between the clocks of two files",
        value,
        "1e-6",
        500.0,
        SHARE * 500.0,
        "what was planted, 20 %",
        "closed form",
    )


def _moving_car(folder: Path) -> list[Row]:
    """Inertial checks of a real car's telephone, where the recording is there."""
    path = car.find()
    if path is None:
        return [not_run("measured_checks.car", SYSTEM, "inertial checks of a moving car", "no recording here")]
    own = measured_car.samples(path)
    degrees, down = own.copy(), own.copy()
    degrees[:, 4] *= 180 / np.pi
    down[:, :6] *= np.tile(measured_car.TURNED, 2)
    found = {
        name: check(measured_car.recording(values, folder / f"{name}.columns"), None)
        for name, values in (("clean", own), ("degrees", degrees), ("down", down))
    }
    errors = {name: {one.place: one for one in ones if one.weight == "error"} for name, ones in found.items()}
    pitch = next(one for one in found["clean"] if one.check == "turning" and "pitch" in one.place)
    turned = errors["degrees"].get("q and pitch")
    return [
        behaves(
            "measured_checks.car.errors",
            SYSTEM,
            "moving car, accelerometers, gyros and pose: errors named",
            ", ".join(errors["clean"]) or "none",
            "none",
            "signs and units are right",
        ),
        behaves(
            "measured_checks.car.down",
            SYSTEM,
            "the same with axes right and down, taken for left and up: named",
            ", ".join(sorted(errors["down"])),
            "az, q and pitch",
            "gravity and the turning of the pose tell",
        ),
        within(
            "measured_checks.car.degrees",
            SYSTEM,
            "the same with degrees for radians in pitch: size",
            float("nan") if turned is None or turned.size is None else turned.size,
            "1",
            180 / np.pi,
            SHARE * 180 / np.pi,
            "what was planted, 20 %",
            "closed form",
        ),
        finding(
            "measured_checks.car.ratio",
            SYSTEM,
            "the same: pitch rate of the gyro by that of the camera's pose",
            pitch.size or float("nan"),
            "1",
            1.0,
            "a telephone beside a camera at 20 Hz",
        ),
    ]


def tables(data: dict[str, Any]) -> list[Table]:
    """What an engineer is told."""
    rows = tuple((name, text) for name, text in data["said"].items())
    return [Table("What the checks say of planted faults", "The first sentence of each.", ("planted", "said"), rows)]


def draw(data: dict[str, Any]) -> list[tuple[str, Any]]:
    """No figure."""
    return []
