"""Virtual measurement: a spatial vehicle on a rough road, the samples of virtual transducers on it, and their file."""

import json
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import Field

from models.core.discretisation import Estimate
from models.core.errors import InputError
from models.core.steps import dividing_step, step_divides
from models.core.strict import Strict, quantity
from models.core.whole_files import write_whole
from models.engines.assembly import Settings
from models.engines.cut_vehicle import FIXED_STEP_METHOD, HubRun
from models.measured.channel import SAMPLES_PER_BLOCK
from models.measured.columns import SampleFile
from models.measured.faults_of_measurement import SimulatedFaults, measured_samples
from models.measured.faults_of_measurement import check_faults as check_faults
from models.measured.formats import write
from models.measured.formats.writing import ChannelGroup
from models.measured.recording import Recording
from models.measured.signal import HUB_COMPONENTS, MeasuredSignal, Quantity
from models.sensors.rotations import quaternion_from_cardan, rotation_matrix
from models.sensors.sensor_array import specific_forces_on_body
from models.systems.hub_forces.measurement import element_travels
from models.systems.hub_forces.run import run_on_road
from models.systems.hub_forces.scene import ForceFrame, TwoTrackRoadTable
from models.vehicles.cut_vehicle import GRAVITY, HEADING, PITCH, ROLL, CutVehicle, X, Y, Z

if TYPE_CHECKING:
    from models.systems.measured.scene import MeasuredScene

FILE_UNITS: dict[Quantity, tuple[str, float]] = {
    "force": ("kN", 1e3),
    "moment": ("N*m", 1.0),
    "acceleration": ("m/s^2", 1.0),
    "angular rate": ("deg/s", np.pi / 180),
    "angle": ("deg", np.pi / 180),
    "travel": ("mm", 1e-3),
    "strain": ("-", 1.0),
}
"""Unit of each quantity in written files, with its factor to SI: units as on a test track, not all SI."""
START_OF_MEASUREMENT = datetime(2026, 1, 5, 8, 0, tzinfo=UTC)
"""Start time of every virtual measurement: always the same, so that files repeat bit for bit."""
Place = Annotated[list[float], Field(min_length=3, max_length=3)]


class VirtualTable(Strict):
    """[virtual]: road, duration and sampling of a virtual measurement, its transducers and their faults."""

    road: TwoTrackRoadTable = Field(default=TwoTrackRoadTable(), description="two tracks of a random road")
    duration: float = quantity("s", "of the measurement", default=15.0)
    step: float = quantity("s", "of Runge-Kutta 4 on the road", default=1e-3)
    sampling_rate: float = quantity("Hz", "of every channel", default=1000.0)
    frame: ForceFrame = Field(default="hub", description="axes of the hub forces")
    accelerometers: dict[str, Place] = Field(
        default={}, description="tri-axial ones on the chassis: name and place x, y, z in the vehicle's design axes, m"
    )
    travels: list[str] = Field(default=[], description="springs, mounts or bars whose travel is a check channel")
    sections: list[str] = Field(default=[], description="springs, mounts or bars whose force is a check channel")
    faults: SimulatedFaults = Field(default=SimulatedFaults(), description="what the transducers add to the truth")
    format: str = Field(default="mf4", description="extension of the file that is written: csv, mf4, rsp or tdms")
    seed: int = Field(default=1, ge=0, le=2**62, description="of noise and dropouts")


@dataclass(frozen=True)
class VirtualMeasurement:
    """True run of a vehicle on its tyres, and the signals of faultless transducers on it.

    signals : of the channels; values (n, signals) : in SI at every time step; run : the true run; stride : number of
    time steps per sampling period; errors : of the time steps of the true run, where they were requested.
    """

    vehicle: CutVehicle
    run: HubRun
    signals: tuple[MeasuredSignal, ...]
    values: np.ndarray
    stride: int
    errors: dict[str, Estimate] = field(default_factory=dict)

    @property
    def step(self) -> float:
        """Time step of the true run (s)."""
        return float(self.run.times[1])

    @property
    def period(self) -> float:
        """Sampling period of the transducers (s)."""
        return self.step * self.stride

    def samples(self, transducer_faults: SimulatedFaults, noise_seed: int, noise_path: int = 0) -> np.ndarray:
        """Returns the samples (m, signals) in SI with faults of the transducers; NaN where a
        transducer has no value.
        """
        return measured_samples(
            transducer_faults, self.signals, self.values, self.step, self.stride, noise_seed, noise_path
        )


def virtual_measurement(
    vehicle: CutVehicle, virtual_settings: VirtualTable, engine: str, scene_path: str = "", estimate_error: bool = False
) -> VirtualMeasurement:
    """Run the vehicle on its tyres over the road in an engine, and read all transducers. Raises InputError, Refused or
    RunFailed.

    estimate_error : whether the error of the time steps is estimated, by further runs.
    """
    signals = checked_signals(vehicle, virtual_settings, scene_path)
    run, told = run_on_road(
        vehicle,
        virtual_settings.road,
        virtual_settings.frame,
        (engine, Settings(FIXED_STEP_METHOD, virtual_settings.step, virtual_settings.duration), "compiled"),
        estimate_error,
    )
    hubs = run.wrenches.reshape(len(run.times), -1)
    elements = [element.name for element in vehicle.elements]
    moved = element_travels(vehicle, run) if virtual_settings.travels else {}
    checks = [run.elements[:, [elements.index(name)]] for name in virtual_settings.sections]
    checks += [moved[name][:, None] for name in virtual_settings.travels]
    values = np.hstack([hubs, _chassis_motion(vehicle, run, virtual_settings.accelerometers), *checks])
    return VirtualMeasurement(
        vehicle, run, signals, values, round(1.0 / (virtual_settings.sampling_rate * virtual_settings.step)), told
    )


def checked_signals(
    vehicle: CutVehicle, virtual_settings: VirtualTable, scene_path: str = ""
) -> tuple[MeasuredSignal, ...]:
    """Returns the signals of all channels of a virtual measurement. Raises InputError for steps that do not divide one
    another, and for names that the vehicle does not have.
    """
    period, divides_text = (
        1.0 / virtual_settings.sampling_rate,
        f"divide virtual.duration = {virtual_settings.duration:g} s",
    )
    if not step_divides(virtual_settings.step, virtual_settings.duration):
        allowed = f"must {divides_text}, as {dividing_step(virtual_settings.step, virtual_settings.duration)} s does"
        raise InputError(scene_path, "virtual.step", virtual_settings.step, allowed)
    if not (step_divides(virtual_settings.step, period) and step_divides(period, virtual_settings.duration)):
        allowed = f"its period must be a multiple of virtual.step = {virtual_settings.step:g} s and {divides_text}"
        raise InputError(scene_path, "virtual.sampling_rate", virtual_settings.sampling_rate, allowed)
    known = tuple(element.name for element in vehicle.elements)
    for key in ("travels", "sections"):
        for name in (name for name in getattr(virtual_settings, key) if name not in known):
            raise InputError(scene_path, f"virtual.{key}", name, "the vehicle has no such spring, mount or bar", known)
    signals = _signals_of_channels(vehicle, virtual_settings)
    check_faults(virtual_settings.faults, signals, scene_path)
    return signals


def _signals_of_channels(vehicle: CutVehicle, virtual_settings: VirtualTable) -> tuple[MeasuredSignal, ...]:
    """Signals of hub forces, chassis motion, accelerometers and check channels, in the order of the
    measured columns.
    """
    body, units = vehicle.chassis, {element.name: element.unit for element in vehicle.elements}
    rows: list[tuple[str, Quantity, str, str, ForceFrame]] = [
        (f"{hub}_{name.lower()}", quantity, hub, axis, virtual_settings.frame)
        for hub in vehicle.hubs
        for name, quantity, axis, _ in HUB_COMPONENTS
    ]
    rows += [(name, "angle", body, name, "inertial") for name in ("roll", "pitch")]
    rows += [(f"{name}_rate", "angular rate", body, name, "body") for name in ("roll", "pitch", "yaw")]
    rows += [
        (f"{name}_a{axis}", "acceleration", name, axis, "body")
        for name in virtual_settings.accelerometers
        for axis in "xyz"
    ]
    first_check = len(rows)
    rows += [
        (f"{name}_force", "force" if units[name] == "N" else "moment", name, "", "body")
        for name in virtual_settings.sections
    ]
    rows += [(f"{name}_travel", "travel", name, "", "body") for name in virtual_settings.travels]
    return tuple(
        MeasuredSignal(name, "", name, quantity, at, axis, frame, 1, *FILE_UNITS[quantity], check=i >= first_check)
        for i, (name, quantity, at, axis, frame) in enumerate(rows)
    )


def _chassis_motion(
    vehicle: CutVehicle, hub_run: HubRun, accelerometer_positions: dict[str, list[float]]
) -> np.ndarray:
    """Roll and pitch (rad), gyro rates about axes of the chassis (rad/s), and readings of its accelerometers (m/s^2),
    as columns (n, m).
    """
    from scipy.interpolate import make_interp_spline

    n, angles = vehicle.size, hub_run.states[:, [ROLL, PITCH]]
    rates = body_rates(angles, hub_run.states[:, [n + ROLL, n + PITCH, n + HEADING]])
    if not accelerometer_positions:
        return np.hstack([angles, rates])
    slopes = make_interp_spline(
        hub_run.times, np.hstack([hub_run.states[:, [n + X, n + Y, n + Z]], rates]), k=5
    ).derivative()
    felt, alpha = np.split(np.asarray(slopes(hub_run.times)), 2, axis=1)
    felt[:, 2] += GRAVITY
    turn = rotation_matrix(quaternion_from_cardan(angles[:, 0], angles[:, 1], hub_run.states[:, HEADING]))
    arms = np.array(list(accelerometer_positions.values())) - np.array(vehicle.tree.body(vehicle.chassis).position)
    readings = specific_forces_on_body(arms, np.einsum("nji,nj->ni", turn, felt), rates, alpha)
    return np.hstack([angles, rates, readings.reshape(len(readings), -1)])


def body_rates(angles: np.ndarray, angle_rates: np.ndarray) -> np.ndarray:
    """Angular rates (n, 3) in rad/s about axes of the chassis, from roll and pitch (n, 2) in rad and the rates (n, 3)
    of roll, pitch and heading. The order of rotations is heading, pitch, roll.
    """
    (roll, pitch), (droll, dpitch, dheading) = angles.T, angle_rates.T
    return np.column_stack(
        [
            droll - dheading * np.sin(pitch),
            dpitch * np.cos(roll) + dheading * np.sin(roll) * np.cos(pitch),
            -dpitch * np.sin(roll) + dheading * np.cos(roll) * np.cos(pitch),
        ]
    )


def channel_group(signals: tuple[MeasuredSignal, ...], samples: np.ndarray, sample_period: float) -> ChannelGroup:
    """Returns samples (n, signals) in SI as a group of channels in the units of the file to be written."""
    factors = np.array([signal.factor for signal in signals])
    blocks = (samples[i : i + SAMPLES_PER_BLOCK] / factors for i in range(0, len(samples), SAMPLES_PER_BLOCK))
    comments = tuple(f"{s.quantity} {s.component} at {s.at}, axes {s.frame}" for s in signals)
    names, units = tuple(s.channel for s in signals), tuple(s.unit for s in signals)
    return ChannelGroup(names, units, comments, sample_period, len(samples), blocks)


def write_pattern(
    scene: "MeasuredScene", measurement: VirtualMeasurement, samples: np.ndarray, output_folder: Path
) -> Path:
    """Write samples (n, signals) in SI as ``measured.EXTENSION`` in the file's units, and a ``scene.toml`` that reads
    this file.

    Returns the scene's path. Raises InputError where a file exists or the format has no room for the channels.
    """
    assert scene.virtual is not None
    path, groups = (
        output_folder / f"measured.{scene.virtual.format}",
        [channel_group(measurement.signals, samples, measurement.period)],
    )
    write(path, groups, START_OF_MEASUREMENT, f"virtual measurement: {scene.title}")
    table = scene.model_dump(exclude_unset=True, exclude={"virtual", "files", "sensors", "file", "folder", "options"})
    table |= {f"effects.{name}": entries for name, entries in table.pop("effects", {}).items()}
    lines = [f"{key} = {_toml_text(value)}" for key, value in table.items() if not isinstance(value, dict)]
    for name, entries in table.items():
        if isinstance(entries, dict):
            lines += ["", f"[{name}]", *(f"{key} = {_toml_text(value)}" for key, value in entries.items())]
    for name, place in scene.virtual.accelerometers.items():
        lines += ["", f"[sensors.{_toml_text(name)}]", f'body = "{measurement.vehicle.chassis}"', f"position = {place}"]
    write_whole(output_folder / "scene.toml", "\n".join([*lines, "", map_lines(measurement.signals, path.name)]))
    return output_folder / "scene.toml"


def _toml_text(toml_value: object) -> str:
    """Returns a string, number, boolean or list of these as TOML text."""
    return json.dumps(toml_value, ensure_ascii=False)


def map_lines(signals: tuple[MeasuredSignal, ...], file_name: str, clock_offset: float = 0.0) -> str:
    """Returns the TOML text of a table [[files]] with a channel map of signals; ``clock_offset`` (s) is added to the
    file's clock.
    """
    lines = [
        "[[files]]",
        f'file = "{file_name}"',
        *([f"offset = {clock_offset}"] if clock_offset else []),
        "channels = [",
    ]
    for signal in signals:
        entry = {key: getattr(signal, key) for key in ("channel", "quantity", "at", "component", "frame")}
        text = ", ".join(f'{key} = "{value}"' for key, value in entry.items() if value)
        lines.append(f"  {{ {text}{', check = true' if signal.check else ''} }},")
    return "\n".join([*lines, "]", ""])


def recording_of_samples(measurement: VirtualMeasurement, samples: np.ndarray, columns_path: Path) -> Recording:
    """Returns samples (m, signals) of a virtual measurement as a recording, without measurement files and channel maps;
    ``columns_path`` : file of its columns.
    """
    columns = SampleFile(columns_path, tuple(signal.name for signal in measurement.signals), len(samples))
    columns.write(0, samples)
    return Recording(measurement.signals, columns, measurement.period)
