"""Plants faults in a recording of a car on a road, and collects what the checks of the recording find."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache, wraps
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy.interpolate import make_interp_spline

from models.core.finding import Finding
from models.measured.checks import check
from models.measured.faults_of_measurement import SimulatedFaults
from models.measured.signal import HUB_COMPONENTS, TransducerPlace
from models.systems.hub_forces.scene import TwoTrackRoadTable
from models.systems.measured.virtual import VirtualMeasurement, VirtualTable, recording_of_samples, virtual_measurement
from models.vehicles.cut_vehicle import CutVehicle, cut_at_hubs
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.vehicle_file import load_vehicle
from validation.spatial.cars import twin

SEED = 61
SENSORS = {"rail": [0.3, 0.5, 0.4], "tower": [1.0, 0.0, 0.7], "shelf": [-1.2, -0.3, 0.6], "bonnet": [1.3, -0.5, 0.8]}
"""Positions of the accelerometers on the chassis, m."""
NOISE: dict[str, float] = {"force": 8.0, "moment": 1.0, "acceleration": 0.05, "angular rate": 5e-3, "angle": 1.75e-3}
"""Standard deviation of the white noise on every sample, by quantity, in SI units."""
Ride = tuple[Literal["A", "B", "C", "D"], int, float, float]
"""Road class, seed, speed (m/s) and length (s) of a recording."""
Spoil = Callable[[VirtualMeasurement, np.ndarray], None]
"""Function that changes samples (n, signals) in place."""


def column_numbers(virtual_measurement: VirtualMeasurement, *channel_names: str) -> list[int]:
    """Column numbers of the channels with these names."""
    return [[s.name for s in virtual_measurement.signals].index(name) for name in channel_names]


def spoiling_function(change_samples: Callable[..., None]) -> Callable[..., Spoil]:
    """Decorator for a fault: the decorated function takes only the fault's settings, and returns a function that
    changes the samples of a recording."""

    def make_spoil(*settings: Any, **named_settings: Any) -> Spoil:
        return lambda virtual, samples: change_samples(virtual, samples, *settings, **named_settings)

    return wraps(change_samples)(make_spoil)


@spoiling_function
def scaled_channels(
    virtual_measurement: VirtualMeasurement,
    samples: np.ndarray,
    factor: float,
    *channel_names: str,
    offset: float = 0.0,
) -> None:
    """Fault: the samples of some channels are multiplied by a factor, then a constant is added."""
    samples[:, column_numbers(virtual_measurement, *channel_names)] = (
        factor * samples[:, column_numbers(virtual_measurement, *channel_names)] + offset
    )


@spoiling_function
def exchanged_hubs(virtual_measurement: VirtualMeasurement, samples: np.ndarray, *hub_pairs: tuple[str, str]) -> None:
    """Fault: all channels of two hubs are exchanged, for each pair of hubs."""
    for pair in hub_pairs:
        first, second = (
            column_numbers(virtual_measurement, *(f"{hub}_{name.lower()}" for name, *_ in HUB_COMPONENTS))
            for hub in pair
        )
        samples[:, first + second] = samples[:, second + first]


@spoiling_function
def drop_samples(
    virtual_measurement: VirtualMeasurement, samples: np.ndarray, channel_name: str, begin_time: float, duration: float
) -> None:
    """Fault: a channel is NaN for ``duration`` (s) from ``begin_time`` (s) on."""
    first = round(begin_time / virtual_measurement.period)
    samples[
        first : first + round(duration / virtual_measurement.period), column_numbers(virtual_measurement, channel_name)
    ] = np.nan


@spoiling_function
def hold_sample(
    virtual_measurement: VirtualMeasurement, samples: np.ndarray, channel_name: str, begin_time: float, duration: float
) -> None:
    """Fault: a channel keeps the same value for ``duration`` (s) from ``begin_time`` (s) on."""
    first, (column,) = round(begin_time / virtual_measurement.period), column_numbers(virtual_measurement, channel_name)
    samples[first : first + round(duration / virtual_measurement.period), column] = samples[first, column]


@spoiling_function
def spiked_channel(
    virtual_measurement: VirtualMeasurement,
    samples: np.ndarray,
    channel_name: str,
    spike_time: float,
    spike_height: float,
) -> None:
    """Fault: a single sample of a channel is too high by ``spike_height``."""
    samples[round(spike_time / virtual_measurement.period), column_numbers(virtual_measurement, channel_name)] += (
        spike_height
    )


@spoiling_function
def clipped_channel(
    virtual_measurement: VirtualMeasurement, samples: np.ndarray, channel_name: str, clipped_share: float
) -> None:
    """Fault: the largest samples of a channel, a given share of all, are limited to the same value."""
    (column,) = column_numbers(virtual_measurement, channel_name)
    samples[:, column] = np.minimum(samples[:, column], np.quantile(samples[:, column], 1 - clipped_share))


@spoiling_function
def moments_about_point(
    virtual_measurement: VirtualMeasurement, samples: np.ndarray, lever_arm: float, *hub_names: str
) -> None:
    """Fault: the hub moments refer to a point ``lever_arm`` (m) above the hubs: (Mx + r Fy, My - r Fx)."""
    for hub in hub_names:
        fx, fy, mx, my = column_numbers(virtual_measurement, *(f"{hub}_{name}" for name in ("fx", "fy", "mx", "my")))
        samples[:, mx] += lever_arm * samples[:, fy]
        samples[:, my] -= lever_arm * samples[:, fx]


@dataclass(frozen=True)
class PlantedMeasurementFault:
    """A planted fault: the check that must find it, the ``place`` that this check must name, and the ``size`` of the
    fault in ``unit``."""

    name: str
    check: str
    place: str
    size: float
    unit: str
    spoil: Spoil | None = None
    faults: dict[str, Any] = field(default_factory=dict)


@cache
def measurement(
    vehicle_name: str = "r19_free", road: Ride = ("C", 1, 20.0, 15.0), sampling_rate: float = 500.0
) -> VirtualMeasurement:
    """Virtual measurement of a car on a road, with four accelerometers and a given sampling rate (Hz)."""
    kind, seed, speed, duration = road
    virtual = VirtualTable(
        road=TwoTrackRoadTable(iso8608=kind, seed=seed, speed=speed),
        duration=duration,
        step=2e-3,
        sampling_rate=sampling_rate,
        accelerometers=SENSORS,
    )
    return virtual_measurement(_car_variant(vehicle_name), virtual, "mujoco")


def _car_variant(variant_name: str) -> CutVehicle:
    """The car R19-free or a variant of it: without symmetry (twin), with 80 kg more (loaded), with springs 20 % stiffer
    (stiff), or with dampers 30 % weaker (worn)."""
    full_vehicle = load_vehicle("r19_free")
    body, *other_bodies = full_vehicle.bodies
    vehicles = {
        "r19_free": full_vehicle,
        "twin": twin(),
        "loaded": replace(full_vehicle, bodies=(replace(body, mass=body.mass + 80), *other_bodies)),
        "stiff": _suspended_vehicle(full_vehicle, 1.2, 1.0),
        "worn": _suspended_vehicle(full_vehicle, 1.0, 0.7),
    }
    return cut_at_hubs(vehicles[variant_name], "body")


def _suspended_vehicle(vehicle: SpatialVehicle, stiffness_factor: float, damping_factor: float) -> SpatialVehicle:
    springs = tuple(
        replace(s, stiffness=stiffness_factor * s.stiffness, damping=damping_factor * s.damping)
        for s in vehicle.springs
    )
    return replace(vehicle, springs=springs)


def errors_and_doubts(
    virtual_measurement: VirtualMeasurement, samples: np.ndarray, work_folder: Path
) -> tuple[Finding, ...]:
    """Findings of the checks in samples (n, signals), without mere notes."""
    spoilt = recording_of_samples(
        virtual_measurement, samples, work_folder / f"{len(list(work_folder.iterdir()))}.columns"
    )
    transducers = {name: TransducerPlace("body", (x, y, z)) for name, (x, y, z) in SENSORS.items()}
    claimed = {s.name: NOISE[s.quantity] for s in virtual_measurement.signals}
    return tuple(
        finding
        for finding in check(spoilt, virtual_measurement.vehicle, transducers, claimed)
        if finding.weight != "note"
    )


def planted_findings(
    virtual_measurement: VirtualMeasurement,
    work_folder: Path,
    *spoil_samples: Spoil | None,
    seed: int = SEED,
    **transducer_faults: Any,
) -> tuple[Finding, ...]:
    """Errors and doubts that the checks find in a recording with transducer faults and changed samples."""
    samples = virtual_measurement.samples(
        SimulatedFaults(**transducer_faults | {"noise": NOISE | transducer_faults.get("noise", {})}), seed
    )
    for change in spoil_samples:
        if change is not None:
            change(virtual_measurement, samples)
    return errors_and_doubts(virtual_measurement, samples, work_folder)


def drifting_findings(
    virtual_measurement: VirtualMeasurement, clock_error: float, work_folder: Path
) -> tuple[Finding, ...]:
    """Errors and doubts that the checks find if all signals except the hub forces come from another file. Its clock is
    too fast by the fraction ``clock_error``."""
    samples, driving = virtual_measurement.samples(SimulatedFaults(noise=NOISE), SEED), ("force", "moment")
    clock = virtual_measurement.period * np.arange(len(samples))
    for i in (i for i, s in enumerate(virtual_measurement.signals) if s.quantity not in driving):
        samples[:, i] = make_interp_spline(clock, samples[:, i])(np.minimum(clock / (1 + clock_error), clock[-1]))
    signals = tuple(
        replace(s, file="wheels" if s.quantity in driving else "inertial") for s in virtual_measurement.signals
    )
    return errors_and_doubts(replace(virtual_measurement, signals=signals), samples, work_folder)
