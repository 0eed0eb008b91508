"""Linear response of a vehicle's accelerometers, gyros and angles to measured hub forces.

About its design position, by differences of the written-out equations: M q'' = ... becomes q'' = A q + D q' + B u. What
is looked at lies well above the drift of the free vehicle, so that neither its start nor its growth matters.
"""

from collections.abc import Sequence

import numpy as np

from models.engines.cut_vehicle import HubModel, build
from models.measured.signal import MeasuredSignal, TransducerPlace
from models.multibody.cut_kernel import WRENCH
from models.multibody.cut_table import HubInputs
from models.vehicles.cut_vehicle import GRAVITY, CutVehicle
from models.vehicles.kinematics import Kinematics

MODEL_TIME_STEP = 1e-3
"""Step (s) of the model, whose half steps hold the trial forces."""
STATE_DIFFERENCE_STEP = 1e-5
"""Step (m and rad, m/s and rad/s) of the finite differences by the state; the equations are smooth over metres."""
FORCE_DIFFERENCE_STEP = 100.0
"""Step (N and N m) of the finite differences by forces, in which the equations are linear."""
AXIS_INDEX = {"x": 0, "y": 1, "z": 2, "roll": 0, "pitch": 1, "yaw": 2}
"""Index of each component's axis."""


def component_index(signal: MeasuredSignal, hub_index: int) -> int:
    """Index of a force signal's component among the components of all hubs; ``hub_index`` is the index of its hub."""
    return WRENCH * hub_index + 3 * (signal.quantity == "moment") + AXIS_INDEX[signal.component]


class SensorResponse:
    """Linear response of a vehicle's sensors: q'' = stiff q + damped q' + pushed u, with forces u (6 h,) in N and N m
    at h hubs, given in a frame."""

    def __init__(self, vehicle: CutVehicle, frame: str) -> None:
        self.vehicle, self.motion = vehicle, Kinematics(vehicle.tree)
        model, n = _static_model(vehicle, frame), vehicle.size
        rest, moved = np.zeros(n), STATE_DIFFERENCE_STEP * np.eye(n)
        at = model.acceleration
        self.stiff = np.column_stack(
            [(at(0.0, d, rest) - at(0.0, -d, rest)) / (2 * STATE_DIFFERENCE_STEP) for d in moved]
        )
        self.damped = np.column_stack(
            [(at(0.0, rest, d) - at(0.0, rest, -d)) / (2 * STATE_DIFFERENCE_STEP) for d in moved]
        )
        still, hubs = at(0.0, rest, rest), range(WRENCH * len(vehicle.hubs))
        self.pushed = np.column_stack(
            [(at((i + 1) * MODEL_TIME_STEP / 2, rest, rest) - still) / FORCE_DIFFERENCE_STEP for i in hubs]
        )

    def transfer_functions(
        self, frequencies: np.ndarray, signals: Sequence[MeasuredSignal], transducer_places: Sequence[TransducerPlace]
    ) -> np.ndarray:
        """Transfer functions (f, signals, 6 h) from the forces at h hubs to the signals, each at its place, at
        frequencies (f,) in Hz."""
        laplace, n = 2j * np.pi * frequencies[:, None, None], self.vehicle.size
        q = np.linalg.solve(
            laplace**2 * np.eye(n) - laplace * self.damped - self.stiff, self.pushed[None].astype(complex)
        )
        rows = np.stack(
            [self._sensor_row(laplace[:, 0], s, place) for s, place in zip(signals, transducer_places, strict=True)],
            axis=1,
        )
        return np.asarray(rows @ q)

    def _sensor_row(self, i_omega: np.ndarray, signal: MeasuredSignal, transducer: TransducerPlace) -> np.ndarray:
        """Row (f, n) that maps the n coordinates to a sensor's reading, with ``i_omega`` (f, 1) the factor of a time
        derivative."""
        axis, turn = AXIS_INDEX[signal.component], self.motion.turn(transducer.body)
        if signal.quantity == "angle":
            return np.broadcast_to(turn[axis], (len(i_omega), self.vehicle.size))
        if signal.quantity == "angular rate":
            return i_omega * turn[axis]
        shift = self.motion.shift(transducer.body, transducer.position)[axis]
        weighs = signal.gravity and signal.frame in ("body", "sensor")  # a tilted sensor feels part of the weight
        tilt = GRAVITY * np.array([-turn[1], turn[0], 0 * turn[0]])[axis] if weighs else 0.0
        return i_omega**2 * shift + tilt


def _static_model(vehicle: CutVehicle, frame: str) -> HubModel:
    """Model of the vehicle with static loads alone at half step 0; at half step i + 1 a force on component i is
    added."""
    hubs = WRENCH * len(vehicle.hubs)
    rows = np.zeros((hubs + 1, hubs))
    rows[:, 2::WRENCH] = vehicle.loads
    rows[1:] += FORCE_DIFFERENCE_STEP * np.eye(hubs)
    return build("reference", vehicle, HubInputs(rows, frame), MODEL_TIME_STEP, MODEL_TIME_STEP * (hubs // 2))
