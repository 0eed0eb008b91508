"""A sphere of unit inertia in an engine, under the torque that makes it rotate with the sampled rates of a gyro.

The torque is held from one sample to the next, so that the rates are exact at all samples and linear between them; the
attitude is the integrator's. Methods that blend a held force with the one before it take the angular acceleration at
the end of each step instead.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import exudyn as exu
import mujoco
import numpy as np
from mujoco import rollout

from models.core.errors import Refused, RunFailed
from models.engines.assembly import Settings
from models.engines.catalogue import CATALOGUE
from models.engines.exudyn_system import items, solve, solver_counts
from models.engines.mujoco import INTEGRATORS
from models.engines.mujoco_quiet import without_warnings
from models.sensors.rotations import quaternion_from_matrix, quaternion_product, rotation_vector

OUTPUT_TYPES = exu.OutputVariableType
Gyro = Callable[[np.ndarray], np.ndarray]
"""Function that returns the local rates (n, 3) in rad/s at times (n,) in s."""
HALF_DIFFERENCE_INTERVAL = 1e-4
"""Half the interval (s) of the central difference of the rates; its error is 1e-7 of a second-order method's."""


@dataclass(frozen=True)
class Attitudes:
    """Quaternions (n, 4) at the n compared times, and counts of work."""

    quaternions: np.ndarray
    counts: dict[str, int]


def attitudes_in_mujoco(
    method_name: str,
    sample_period: float,
    step_count: int,
    steps_per_row: int,
    start_attitude: np.ndarray,
    gyro_rates: Gyro,
) -> Attitudes:
    """Attitudes of the rotating sphere in MuJoCo: ``step_count`` steps of ``sample_period`` (s) from an attitude (4,),
    of which every ``steps_per_row``-th is kept.
    """
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.gravity, spec.option.integrator = (
        sample_period,
        [0, 0, 0],
        INTEGRATORS[method_name],
    )
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_AUTORESET
    body = spec.worldbody.add_body(mass=1.0, inertia=[1.0, 1.0, 1.0], ipos=[0, 0, 0], explicitinertial=True)
    body.add_joint(type=mujoco.mjtJoint.mjJNT_BALL)
    model = spec.compile()
    rates = gyro_rates(sample_period * np.arange(step_count + 1))
    torques = np.diff(rates, axis=0)[None] / sample_period
    with without_warnings():
        path, _ = rollout.rollout(
            model,
            mujoco.MjData(model),
            np.concatenate([[0.0], start_attitude, rates[0]])[None],
            torques,
            control_spec=int(mujoco.mjtState.mjSTATE_QFRC_APPLIED),
        )
    attitudes = np.vstack([start_attitude, path[0, steps_per_row - 1 :: steps_per_row, 1:5]])
    return _normalised_attitudes(
        "mujoco", attitudes, {"steps": step_count, "force calls": (4 if method_name == "RK4" else 1) * step_count}
    )


def attitudes_in_exudyn(
    method_name: str,
    sample_period: float,
    step_count: int,
    steps_per_row: int,
    start_attitude: np.ndarray,
    gyro_rates: Gyro,
) -> Attitudes:
    """Attitudes of the rotating sphere in Exudyn; raises Refused for methods whose steps cannot end on samples."""
    name = method_name.split()[0]
    known = CATALOGUE["exudyn"][name]
    if known.adaptive:
        raise Refused("exudyn", f"{name} picks its own steps, which do not end on the samples of the rates")
    sample_times = sample_period * np.arange(step_count + 2)
    rates = gyro_rates(sample_times)
    pushed = (
        np.diff(rates, axis=0) / sample_period
        if known.holds
        else (gyro_rates(sample_times + HALF_DIFFERENCE_INTERVAL) - gyro_rates(sample_times - HALF_DIFFERENCE_INTERVAL))
        / 2
        / HALF_DIFFERENCE_INTERVAL
    )
    implicit = name in ("GeneralizedAlpha", "TrapezoidalIndex2")
    mbs, sensor = _sphere(start_attitude, rates[0], pushed.tolist(), sample_period, implicit, known.holds)
    options = exu.SimulationSettings()
    options.solution.file.write, options.solution.sensors.active = False, True
    options.solution.sensors.writePeriod = sample_period * steps_per_row
    options.timeIntegration.automaticStepSize = False
    options.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    note = solve(mbs, Settings(name, sample_period, step_count * sample_period), options)
    stored = mbs.GetSensorStoredData(sensor)[:, 1:]
    if note or len(stored) != step_count // steps_per_row + 1:
        raise RunFailed("exudyn", "the solver reported failure", sample_period * steps_per_row * len(stored))
    attitudes = start_attitude + stored[:, 3:] if implicit else quaternion_from_matrix(stored.reshape(-1, 3, 3))
    return _normalised_attitudes("exudyn", attitudes, solver_counts(mbs))


def _sphere(
    start_attitude: np.ndarray,
    rate: np.ndarray,
    torques: list[list[float]],
    sample_period: float,
    implicit: bool,
    rate_is_held: bool,
) -> tuple[Any, Any]:
    """Exudyn system of the sphere, and its attitude sensor: a rotation matrix for explicit methods, changes of the
    Euler parameters for implicit ones."""
    mbs = exu.SystemContainer().AddSystem()
    still, turning = [0.0] * 3, np.concatenate([[0.0], rate])
    if implicit:
        kind, attitude, rates = items.NodeRigidBodyEP, start_attitude, 0.5 * quaternion_product(start_attitude, turning)
    else:
        kind, attitude, rates = items.NodeRigidBodyRotVecLG, rotation_vector(start_attitude), rate
    node = mbs.AddNode(kind(referenceCoordinates=still + attitude.tolist(), initialVelocities=still + rates.tolist()))
    body = mbs.AddObject(items.ObjectRigidBody(nodeNumber=node, mass=1.0, inertia=[1.0, 1.0, 1.0, 0.0, 0.0, 0.0]))
    row = [0]

    def begin(mbs: Any, t: float) -> bool:
        row[0] = round(t / sample_period) - rate_is_held  # t is the end of the step
        return True

    mbs.SetPreStepUserFunction(begin)
    mbs.AddLoad(
        items.LoadTorqueVector(
            markerNumber=mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=body)),
            bodyFixed=True,
            loadVectorUserFunction=lambda mbs, t, load: torques[row[0]],
        )
    )
    sensor = mbs.AddSensor(
        items.SensorNode(
            nodeNumber=node,
            storeInternal=True,
            writeToFile=False,
            outputVariableType=OUTPUT_TYPES.Coordinates if implicit else OUTPUT_TYPES.RotationMatrix,
        )
    )
    mbs.Assemble()
    return mbs, sensor


def _normalised_attitudes(engine: str, attitudes: np.ndarray, work_counts: dict[str, int]) -> Attitudes:
    """Attitudes with quaternions normalised to unit length; raises RunFailed if a length is not finite or differs from
    1 by 1 % or more."""
    size = np.linalg.norm(attitudes, axis=1, keepdims=True)
    if not (np.abs(size - 1) < 0.01).all():
        raise RunFailed(engine, "a quaternion is no rotation", 0.0)
    return Attitudes(attitudes / size, work_counts)
