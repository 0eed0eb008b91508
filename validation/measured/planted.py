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
from models.measured.faults_of_measurement import Faults
from models.measured.signal import HUB_COMPONENTS, TransducerPlace
from models.systems.hub_forces.scene import Road
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


def column_numbers(virtual: VirtualMeasurement, *names: str) -> list[int]:
    """Column numbers of the channels with these names."""
    return [[s.name for s in virtual.signals].index(name) for name in names]


def spoiling_function(change: Callable[..., None]) -> Callable[..., Spoil]:
    """Decorator for a fault: the decorated function takes only the fault's settings, and returns a function that
    changes the samples of a recording."""

    def make_spoil(*settings: Any, **named_settings: Any) -> Spoil:
        return lambda virtual, samples: change(virtual, samples, *settings, **named_settings)

    return wraps(change)(make_spoil)


@spoiling_function
def scaled_channels(
    virtual: VirtualMeasurement, samples: np.ndarray, factor: float, *names: str, add: float = 0.0
) -> None:
    """Fault: the samples of some channels are multiplied by a factor, then a constant is added."""
    samples[:, column_numbers(virtual, *names)] = factor * samples[:, column_numbers(virtual, *names)] + add


@spoiling_function
def exchanged_hubs(virtual: VirtualMeasurement, samples: np.ndarray, *hub_pairs: tuple[str, str]) -> None:
    """Fault: all channels of two hubs are exchanged, for each pair of hubs."""
    for pair in hub_pairs:
        first, second = (
            column_numbers(virtual, *(f"{hub}_{name.lower()}" for name, *_ in HUB_COMPONENTS)) for hub in pair
        )
        samples[:, first + second] = samples[:, second + first]


@spoiling_function
def drop_samples(virtual: VirtualMeasurement, samples: np.ndarray, name: str, begin_time: float, length: float) -> None:
    """Fault: a channel is NaN for ``length`` (s) from ``begin_time`` (s) on."""
    first = round(begin_time / virtual.period)
    samples[first : first + round(length / virtual.period), column_numbers(virtual, name)] = np.nan


@spoiling_function
def hold_sample(virtual: VirtualMeasurement, samples: np.ndarray, name: str, begin_time: float, length: float) -> None:
    """Fault: a channel keeps the same value for ``length`` (s) from ``begin_time`` (s) on."""
    first, (column,) = round(begin_time / virtual.period), column_numbers(virtual, name)
    samples[first : first + round(length / virtual.period), column] = samples[first, column]


@spoiling_function
def spiked_channel(virtual: VirtualMeasurement, samples: np.ndarray, name: str, time: float, height: float) -> None:
    """Fault: a single sample of a channel is too high by ``height``."""
    samples[round(time / virtual.period), column_numbers(virtual, name)] += height


@spoiling_function
def clipped_channel(virtual: VirtualMeasurement, samples: np.ndarray, name: str, share: float) -> None:
    """Fault: the largest samples of a channel, a given share of all, are limited to the same value."""
    (column,) = column_numbers(virtual, name)
    samples[:, column] = np.minimum(samples[:, column], np.quantile(samples[:, column], 1 - share))


@spoiling_function
def moments_about_point(virtual: VirtualMeasurement, samples: np.ndarray, lever: float, *hubs: str) -> None:
    """Fault: the hub moments refer to a point ``lever`` (m) above the hubs: (Mx + r Fy, My - r Fx)."""
    for hub in hubs:
        fx, fy, mx, my = column_numbers(virtual, *(f"{hub}_{name}" for name in ("fx", "fy", "mx", "my")))
        samples[:, mx] += lever * samples[:, fy]
        samples[:, my] -= lever * samples[:, fx]


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
    vehicle: str = "r19_free", road: Ride = ("C", 1, 20.0, 15.0), rate: float = 500.0
) -> VirtualMeasurement:
    """Virtual measurement of a car on a road, with four accelerometers and a given sampling rate (Hz)."""
    kind, seed, speed, duration = road
    virtual = VirtualTable(
        road=Road(iso8608=kind, seed=seed, speed=speed),
        duration=duration,
        step=2e-3,
        sampling_rate=rate,
        accelerometers=SENSORS,
    )
    return virtual_measurement(_car_variant(vehicle), virtual, "mujoco")


def _car_variant(name: str) -> CutVehicle:
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
    return cut_at_hubs(vehicles[name], "body")


def _suspended_vehicle(vehicle: SpatialVehicle, stiffness_factor: float, damping_factor: float) -> SpatialVehicle:
    springs = tuple(
        replace(s, stiffness=stiffness_factor * s.stiffness, damping=damping_factor * s.damping)
        for s in vehicle.springs
    )
    return replace(vehicle, springs=springs)


def errors_and_doubts(virtual: VirtualMeasurement, samples: np.ndarray, folder: Path) -> tuple[Finding, ...]:
    """Findings of the checks in samples (n, signals), without mere notes."""
    spoilt = recording_of_samples(virtual, samples, folder / f"{len(list(folder.iterdir()))}.columns")
    transducers = {name: TransducerPlace("body", (x, y, z)) for name, (x, y, z) in SENSORS.items()}
    claimed = {s.name: NOISE[s.quantity] for s in virtual.signals}
    return tuple(
        finding for finding in check(spoilt, virtual.vehicle, transducers, claimed) if finding.weight != "note"
    )


def planted_findings(
    virtual: VirtualMeasurement, folder: Path, *spoil: Spoil | None, seed: int = SEED, **faults: Any
) -> tuple[Finding, ...]:
    """Errors and doubts that the checks find in a recording with transducer faults and changed samples."""
    samples = virtual.samples(Faults(**faults | {"noise": NOISE | faults.get("noise", {})}), seed)
    for change in spoil:
        if change is not None:
            change(virtual, samples)
    return errors_and_doubts(virtual, samples, folder)


def drifting_findings(virtual: VirtualMeasurement, clock_error: float, folder: Path) -> tuple[Finding, ...]:
    """Errors and doubts that the checks find if all signals except the hub forces come from another file. Its clock is
    too fast by the fraction ``clock_error``."""
    samples, driving = virtual.samples(Faults(noise=NOISE), SEED), ("force", "moment")
    clock = virtual.period * np.arange(len(samples))
    for i in (i for i, s in enumerate(virtual.signals) if s.quantity not in driving):
        samples[:, i] = make_interp_spline(clock, samples[:, i])(np.minimum(clock / (1 + clock_error), clock[-1]))
    signals = tuple(replace(s, file="wheels" if s.quantity in driving else "inertial") for s in virtual.signals)
    return errors_and_doubts(replace(virtual, signals=signals), samples, folder)
