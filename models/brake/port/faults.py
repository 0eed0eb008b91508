"""Planned faults of the controller port, each within a time window: samples lost or delayed, valves stuck, teeth
missing.
"""

from collections import deque
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from models.brake.controller import APPLY, RELEASE, Command, Controller, Sample
from models.core.strict import Strict, quantity


class ControllerFault(Strict):
    """A planned fault. ``lost``: signals stay as they were at the last sample before it; ``delayed``: they are the
    signals of ``samples`` samples ago; ``stuck``: a valve stays in ``state``, or in the state of its last sample before
    it; ``tooth``: the tooth of this number is missing, for signals that are counted from teeth.
    """

    kind: Literal["lost", "delayed", "stuck", "tooth"]
    start: float = quantity("s", "when it begins", default=0.0, zero=True)
    end: float | None = quantity("s", "end of the fault; without it the fault lasts to the end", default=None)
    wheels: list[int] | None = Field(default=None, min_length=1, description="numbers from 0; all if not said")
    samples: int | None = Field(default=None, ge=1, le=1000, description="of the delay")
    state: int | None = Field(default=None, ge=RELEASE, le=APPLY, description="of the stuck valve")
    tooth: int | None = Field(default=None, ge=0, description="number of the missing tooth, from 0")

    @model_validator(mode="after")
    def _one_kind(self) -> "ControllerFault":
        for key, kind, needed in (("samples", "delayed", True), ("state", "stuck", False), ("tooth", "tooth", True)):
            if getattr(self, key) is not None and self.kind != kind:
                raise ValueError(f"{key} has no meaning for a fault of kind {self.kind}")
            if needed and self.kind == kind and getattr(self, key) is None:
                raise ValueError(f"a fault of kind {kind} needs {key}")
        if self.end is not None and self.end <= self.start:
            raise ValueError("end must be after start")
        return self

    def holds(self, fault_time: float) -> bool:
        """Whether the fault is active at a time (s)."""
        return self.start <= fault_time and (self.end is None or fault_time < self.end)

    def affected_wheels(self, wheel_count: int) -> list[int]:
        """Indices of the wheels that the fault affects, of so many wheels."""
        return list(range(wheel_count)) if self.wheels is None else self.wheels


@dataclass
class FaultyController:
    """A controller whose signals and commands are changed by faults; a new one is made for every run."""

    controller: Controller
    faults: list[ControllerFault]
    _past_signals: deque[np.ndarray] = field(init=False)
    _last_signals: np.ndarray | None = None
    _last_valves: np.ndarray | None = None

    def __post_init__(self) -> None:
        self._past_signals = deque(maxlen=1 + max((fault.samples or 0 for fault in self.faults), default=0))

    def sample(self, sample: Sample) -> Command:
        """The controller's command for the faulty signals; valves of the command may be stuck."""
        time = 1e-9 * sample.time
        active_faults = [fault for fault in self.faults if fault.holds(time)]
        command = self.controller.sample(sample._replace(wheels=self._faulty_signals(sample.wheels, active_faults)))
        return (
            command
            if command.valves is None
            else Command(valves=self._stuck_valves(np.array(command.valves), active_faults))
        )

    def _faulty_signals(self, wheel_speeds: np.ndarray, active_faults: list[ControllerFault]) -> np.ndarray:
        self._past_signals.append(wheel_speeds)
        faulty_wheels = wheel_speeds.copy()
        for fault in active_faults:
            for i in fault.affected_wheels(wheel_speeds.size):
                if fault.kind == "delayed":
                    faulty_wheels[i] = self._past_signals[max(len(self._past_signals) - 1 - (fault.samples or 0), 0)][i]
                elif fault.kind == "lost" and self._last_signals is not None:
                    faulty_wheels[i] = self._last_signals[i]
        self._last_signals = faulty_wheels
        return faulty_wheels

    def _stuck_valves(self, valve_states: np.ndarray, active_faults: list[ControllerFault]) -> np.ndarray:
        for fault in active_faults:
            for i in fault.affected_wheels(valve_states.size) if fault.kind == "stuck" else ():
                if fault.state is not None:
                    valve_states[i] = fault.state
                elif self._last_valves is not None:
                    valve_states[i] = self._last_valves[i]
        self._last_valves = valve_states
        return valve_states


def missing_teeth(faults: list[ControllerFault], wheel_index: int, tooth_index: int, time: float) -> bool:
    """Whether a tooth of a wheel is missing at a time (s), by any of the faults."""
    return any(
        fault.kind == "tooth"
        and fault.tooth == tooth_index
        and (fault.wheels is None or wheel_index in fault.wheels)
        and fault.holds(time)
        for fault in faults
    )
