"""Data that all checks of a recording use: the recording, the vehicle, sensor positions, and spectra computed once."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np

from models.measured.checks.agreement import MeasurementFault, MotionAgreement
from models.measured.checks.response import AXIS_INDEX, SensorResponse, component_index
from models.measured.checks.spectra import CrossSpectra, cross_spectra, white_noise, windowed_means
from models.measured.ratios import probable_mistake
from models.measured.recording import Recording
from models.measured.signal import MeasuredSignal, TransducerPlace
from models.vehicles.cut_vehicle import GRAVITY, CutVehicle
from models.vehicles.pitch_plane import PitchPlaneParameters

COMPARED_BAND = 1.0, 25.0
"""Frequency band (Hz) in which forces and motion are compared: above the drift of a free vehicle, below the bending of
its body."""
LEAST_TELLING_MEAN_SHARE = 5e-4
"""Share of a static load or of gravity below which a mean says nothing of unit and sign."""
INERTIAL_QUANTITIES = ("acceleration", "angular rate", "angle")
"""Quantities of the inertial signals."""


@dataclass(frozen=True)
class CheckedRecording:
    """Data on which the checks of a recording work. places : of accelerometers and gyros by name; stated_noise : stated
    white noise (SI), by name of signal.

    pitch_plane_parameters : those of the pitch-plane vehicle, if the recording drives one instead of a vehicle in
    space.
    """

    recording: Recording
    vehicle: CutVehicle | None
    places: Mapping[str, TransducerPlace] = field(default_factory=dict)
    stated_noise: Mapping[str, float] = field(default_factory=dict)
    pitch_plane_parameters: PitchPlaneParameters | None = None

    @cached_property
    def forces(self) -> tuple[MeasuredSignal, ...]:
        """Signals of the forces and moments at the vehicle's hubs."""
        hubs, signals = self.vehicle.hubs if self.vehicle else (), self.recording.signals
        acting = [s for s in signals if s.quantity in ("force", "moment") and s.component in ("x", "y", "z")]
        return tuple(s for s in acting if s.at in hubs)

    @cached_property
    def inertial_signals(self) -> tuple[MeasuredSignal, ...]:
        """Accelerations, angular rates and angles measured at a known place on the vehicle."""
        moving = [s for s in self.recording.signals if s.quantity in INERTIAL_QUANTITIES and s.component in AXIS_INDEX]
        return tuple(s for s in moving if self.transducer_place(s) is not None)

    def vertical_force_signals(self) -> dict[str, MeasuredSignal]:
        """Signal of the vertical force at each hub that has one."""
        return {s.at: s for s in self.forces if s.quantity == "force" and s.component == "z"}

    def transducer_place(self, signal: MeasuredSignal) -> TransducerPlace | None:
        """Position at which a signal is measured; None where neither the scene nor the vehicle gives it."""
        if signal.at in self.places or self.vehicle is None:
            return self.places.get(signal.at)
        bodies = {body.name: body for body in self.vehicle.uncut.bodies}
        bodies |= {tyre.name: bodies[tyre.body] for tyre in self.vehicle.uncut.tyres}
        body = bodies.get(signal.at)
        return TransducerPlace(body.name, body.position) if body else None

    @cached_property
    def missing_data_text(self) -> str:
        """Phrase on the data that are missing for comparing forces with motion; empty if none are."""
        if self.vehicle is None:
            return "a vehicle in space"
        bare = [hub for hub in self.vehicle.hubs if hub not in self.vertical_force_signals()]
        if bare:
            return f"the vertical force of {', '.join(bare)}"
        if not self.inertial_signals:
            return "an accelerometer or gyro whose place on the vehicle is known"
        if self.constant_signals:
            return f"life in {', '.join(self.constant_signals)}"
        return "" if self._spectra is not None else "a few seconds at 5 Hz or more without a gap in any channel"

    @cached_property
    def constant_signals(self) -> tuple[str, ...]:
        """Names of force and inertial signals whose measured samples all have the same value."""
        samples = ((s.name, self.recording.samples(s)) for s in (*self.forces, *self.inertial_signals))
        known = ((name, values[np.isfinite(values)]) for name, values in samples)
        return tuple(name for name, values in known if (values == values[:1]).all())

    @cached_property
    def factors_from_means(self) -> dict[MeasuredSignal, float]:
        """Ratio of recorded to true value of signals whose mean alone shows a wrong sign or unit.

        Means of vertical forces are compared with static loads, and those of vertical accelerometers with gravity.
        """
        loads = dict(zip(self.vehicle.hubs, self.vehicle.loads, strict=True)) if self.vehicle else {}
        ratios = {
            s: self.mean_of_signal(s) / loads[hub]
            for hub, s in self.vertical_force_signals().items()
            if not self.has_negligible_mean(s)
        }
        ratios |= {
            s: self.mean_of_signal(s) / GRAVITY
            for s in self.recording.find_signals("acceleration", "", "z")
            if s.gravity
        }
        return {
            s: ratio
            for s, ratio in ratios.items()
            if probable_mistake(ratio, s)[0] in ("sign", "unit") and abs(ratio) > LEAST_TELLING_MEAN_SHARE
        }

    def mean_of_signal(self, signal: MeasuredSignal) -> float:
        """Mean of all samples of a signal, weighted by a window."""
        return float(windowed_means([partial(self.recording.samples, signal)])[0][0])

    def has_negligible_mean(self, signal: MeasuredSignal) -> bool:
        """Whether a force varies more than its mean, which then does not reveal the sign or unit."""
        return abs(self.mean_of_signal(signal)) <= float(np.nanstd(self.recording.samples(signal)))

    @cached_property
    def _spectra(self) -> CrossSpectra | None:
        """Cross spectra of forces and inertial signals in the compared band; None if the recording is too short or has
        gaps."""
        top = min(COMPARED_BAND[1], 0.4 / self.recording.period)
        return cross_spectra(self.recording, (*self.forces, *self.inertial_signals), (COMPARED_BAND[0], top))

    @cached_property
    def agreement(self) -> MotionAgreement | None:
        """Comparison of recorded forces and motion, after correction of signs and units that means reveal; None where
        data are lacking."""
        if self.missing_data_text:
            return None
        assert self.vehicle is not None and self._spectra is not None
        measured_spectra, c = self._spectra, len(self.forces)
        places = [place for s in self.inertial_signals if (place := self.transducer_place(s)) is not None]
        response = SensorResponse(self.vehicle, self.frame).transfer_functions(
            measured_spectra.frequencies, self.inertial_signals, places
        )
        numbers = [component_index(s, self.vehicle.hubs.index(s.at)) for s in self.forces]
        forces, felt = (
            np.array([self.factors_from_means.get(s, 1.0) for s in each])
            for each in (self.forces, self.inertial_signals)
        )
        return MotionAgreement(
            measured_spectra.frequencies,
            self.forces,
            self.inertial_signals,
            measured_spectra.cross_spectra[:, :c, :c],
            measured_spectra.cross_spectra[:, c:, :c],
            np.einsum("fkk->fk", measured_spectra.cross_spectra[:, c:, c:]).real,
            response[:, :, numbers] / forces * felt[:, None],
            measured_spectra.independent_averages,
            measured_spectra.white_noise_power
            * np.square([white_noise(self.recording, s) for s in self.inertial_signals]),
        )

    @property
    def frame(self) -> str:
        """Frame in which the hub forces are given."""
        return self.forces[0].frame if self.forces else "hub"

    @cached_property
    def agreement_and_faults(self) -> tuple[MotionAgreement, tuple[MeasurementFault, ...]] | None:
        """The agreement of forces and motion after correction of its faults, and these faults, the worst one first."""
        return self.agreement.search_faults() if self.agreement else None

    @property
    def faults(self) -> tuple[MeasurementFault, ...]:
        """Faults found by comparing forces with motion; empty if they cannot be compared."""
        return self.agreement_and_faults[1] if self.agreement_and_faults else ()

    @cached_property
    def detectable_sizes(self) -> dict[str, tuple[float, float]]:
        """By signal name: smallest detectable delay (s) and relative error of the factor; empty if nothing could be
        compared."""
        return self.agreement_and_faults[0].detectable_sizes() if self.agreement_and_faults else {}

    def corrected_hub(self, signal: MeasuredSignal) -> str:
        """Hub at which a force signal acts after exchanged hubs are corrected."""
        for fault in self.faults:
            if fault.kind == "swapped" and signal.at in dict(fault.exchanged_hubs):
                return dict(fault.exchanged_hubs)[signal.at]
            if fault.kind == "crossed" and signal in fault.signals:
                return next(s.at for s in fault.signals if s != signal)
        return signal.at
