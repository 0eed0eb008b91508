"""Assumptions of a recording, and of the run of a spatial vehicle that its hub forces drive."""

from typing import TYPE_CHECKING

import numpy as np

from models.core.assumptions import Assumption, Watched
from models.engines.cut_vehicle import TUMBLED_PITCH
from models.measured.checks.clipped import clipping_extremes
from models.systems.hub_forces.assumptions import (
    LARGEST_IMBALANCE,
    SMALL_ANGLE,
    TURNED_FORCE_ANGLE,
    carried_weight_share,
    usual_travel_assumptions,
)
from models.systems.measured.scene import MeasuredScene
from models.vehicles.cut_vehicle import CutVehicle

if TYPE_CHECKING:
    from models.systems.measured.run import RecordingAnalysis

LARGEST_PULL_SHARE = 0.2
"""Largest downward force at a hub divided by the load at rest: weight and inertia of rim and tyre in the air. A larger
pull is not caused by the road.
"""


def assumptions(
    scene: MeasuredScene, vehicle: CutVehicle | None, recording_analysis: "RecordingAnalysis | None" = None
) -> list[Assumption]:
    """Assumptions of the run whose section forces are written to files; recording_analysis : of this run, None to list
    the assumptions only.

    The pitch plane (vehicle None) has further assumptions, which the system pitch_plane lists.
    """
    return [
        _transducer_range_assumption(recording_analysis),
        *([] if vehicle is None else _cut_vehicle_assumptions(scene, vehicle, recording_analysis)),
    ]


def _transducer_range_assumption(recording_analysis: "RecordingAnalysis | None") -> Assumption:
    """Assumption that transducers stay within their ranges, so that no samples pile up at an extreme value."""

    def clipped() -> Watched:
        """Share of the samples that pile up at an extreme value, for every signal that drives the run."""
        assert recording_analysis is not None
        values = {
            s.name: recording_analysis.recording.samples(s)
            for s in recording_analysis.recording.signals
            if recording_analysis.is_input(s)
        }
        return {name: np.array([np.isin(each, clipping_extremes(each)).mean()]) for name, each in values.items()}

    return Assumption(
        "transducers in range",
        "what is put in lies within its transducers' range",
        "measure again with a wider range, or leave these times out by [clock]",
        lambda run: clipped(),
        "of the samples",
        upper_limit=0.0,
    )


def _cut_vehicle_assumptions(
    scene: MeasuredScene, vehicle: CutVehicle, recording_analysis: "RecordingAnalysis | None"
) -> list[Assumption]:
    """Assumptions of a spatial vehicle driven by hub forces, checked on the channels of its run."""

    def read(name: str) -> np.ndarray:
        assert recording_analysis is not None and recording_analysis.outcome is not None
        return recording_analysis.outcome.samples(name)

    def tilt() -> Watched:
        return {name: read(f"{vehicle.chassis} {name}") for name in ("roll", "pitch")}

    def vertical() -> dict[str, np.ndarray]:
        return {hub: read(f"{hub} hub Fz") for hub in vehicle.hubs}

    def balance() -> Watched:
        assert recording_analysis is not None
        return {
            "all hubs": carried_weight_share(
                sum(vertical().values(), np.zeros(1)), vehicle, recording_analysis.recording.duration
            )
        }

    filtered = scene.stabilise.method == "kalman"
    remedy = (
        'use stabilise.method = "prescribed" in place of "kalman"'
        if filtered
        else 'use stabilise.method = "kalman" or "prescribed", or end the run before by clock.duration'
    )
    says = "the filter takes angles for turns about the body's axes" if filtered else "the vehicle stays upright"
    most = SMALL_ANGLE if filtered else TUMBLED_PITCH
    listed = [
        Assumption("small tilt" if filtered else "upright", says, remedy, lambda run: tilt(), "rad", -most, most),
        Assumption(
            "wheels press",
            "the road does not pull at a wheel",
            "correct zero, sign or unit of its vertical force in the channel map",
            lambda run: {
                hub: force / load for (hub, force), load in zip(vertical().items(), vehicle.loads, strict=True)
            },
            "of the load at rest",
            lower_limit=-LARGEST_PULL_SHARE,
        ),
        Assumption(
            "balance",
            "over the run the vertical forces carry the weight",
            "correct the loads of the vehicle file, or zero and unit of the forces in the channel map",
            lambda run: balance(),
            "of the weight",
            1.0 - LARGEST_IMBALANCE,
            1.0 + LARGEST_IMBALANCE,
        ),
        *usual_travel_assumptions(
            vehicle,
            lambda run: {each.name: read(f"{each.name} travel") for each in vehicle.elements},
            "leave these times out by [clock]: no stop is in the cut vehicle's linear springs",
        ),
    ]
    return [*listed, *_same_attitude_assumption(scene, vehicle, recording_analysis)]


def _same_attitude_assumption(
    scene: MeasuredScene, vehicle: CutVehicle, recording_analysis: "RecordingAnalysis | None"
) -> list[Assumption]:
    """Assumption that a free run has the measured roll and pitch, for forces that keep their directions in space; empty
    where neither angle was measured.
    """
    if scene.stabilise.method != "none" or recording_analysis is None:
        return []
    frames = {
        s.frame for s in recording_analysis.recording.signals if s.at in vehicle.hubs and recording_analysis.is_input(s)
    }
    angles = [
        s
        for s in recording_analysis.recording.find_signals("angle", vehicle.chassis)
        if s.component in ("roll", "pitch")
    ]
    if frames != {"inertial"} or not angles:
        return []

    def beside() -> Watched:
        assert recording_analysis.outcome is not None
        skip = round(recording_analysis.outcome.period / recording_analysis.recording.period)
        done = recording_analysis.outcome.done
        return {
            s.component: recording_analysis.outcome.samples(f"{vehicle.chassis} {s.component}")
            - recording_analysis.recording.samples(s)[::skip][:done]
            for s in angles
        }

    return [
        Assumption(
            "same attitude",
            "forces that keep their directions meet a vehicle that lies as the measured one",
            'use stabilise.method = "kalman" or "prescribed"',
            lambda run: beside(),
            "rad",
            -TURNED_FORCE_ANGLE,
            TURNED_FORCE_ANGLE,
        )
    ]
