"""The pitch-plane vehicle written by hand for each engine, without any part of twinrig, to measure twinrig's overhead.

The paper's symbols go straight into Exudyn's items and MuJoCo's XML; the vehicle moves freely on its tyres over a flat
road. The computing time of twinrig without effects is compared with that of these models.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from models.vehicles.pitch_plane import PitchPlaneParameters

Run = Callable[[], np.ndarray]
"""Function that simulates from the start state; returns the states (step_count + 1, 8)."""


def exudyn_run(parameters: PitchPlaneParameters, start_state: np.ndarray, step: float, step_count: int) -> Run:
    """Returns a function that simulates the pitch-plane vehicle in Exudyn by the classical Runge-Kutta method; step in
    s. Exudyn's x axis in the plane points backward."""
    import exudyn as exu
    import exudyn.itemInterface as items

    container = exu.SystemContainer()
    mbs = container.AddSystem()
    ground = mbs.AddObject(items.ObjectGround())
    nodes = [
        mbs.AddNode(
            items.NodePoint2D(initialCoordinates=[0, start_state[i]], initialVelocities=[0, start_state[4 + i]])
        )
        for i in (0, 1)
    ]
    nodes.append(
        mbs.AddNode(
            items.NodeRigidBody2D(
                initialCoordinates=[0, start_state[2], start_state[3]],
                initialVelocities=[0, start_state[6], start_state[7]],
            )
        )
    )
    wheels = [
        mbs.AddObject(items.MassPoint2D(nodeNumber=node, mass=mass))
        for node, mass in zip(nodes, (parameters.m1, parameters.m2), strict=False)
    ]
    chassis = mbs.AddObject(items.RigidBody2D(nodeNumber=nodes[2], mass=parameters.m3, inertia=parameters.I))
    for node, mass in zip(nodes, (parameters.m1, parameters.m2, parameters.m3), strict=True):
        heave = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=1))
        mbs.AddLoad(items.LoadCoordinate(markerNumber=heave, load=mass * parameters.g))

    def spring(upper_body, upper_x, lower_body, stiffness, damping):
        ends = [
            mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=body, localPosition=[-x, 0, 0]))
            for body, x in ((lower_body, 0.0), (upper_body, upper_x))
        ]
        mbs.AddObject(
            items.CartesianSpringDamper(markerNumbers=ends, stiffness=[0, stiffness, 0], damping=[0, damping, 0])
        )

    spring(wheels[0], 0.0, ground, parameters.k1, parameters.d1)
    spring(wheels[1], 0.0, ground, parameters.k2, parameters.d2)
    spring(chassis, parameters.b, wheels[0], parameters.k3, parameters.d3)
    spring(chassis, -parameters.a, wheels[1], parameters.k4, parameters.d4)
    march = exudyn_march(container, mbs, nodes, step, step_count)

    def run() -> np.ndarray:
        read = march()
        return np.column_stack(
            [
                read[0][:, 2],
                read[1][:, 2],
                read[2][:, 2],
                read[2][:, 3],
                read[3][:, 2],
                read[4][:, 2],
                read[5][:, 2],
                read[5][:, 3],
            ]
        )

    return run


def exudyn_march(
    container: Any, mbs: Any, nodes: list[Any], step: float, step_count: int
) -> Callable[[], list[np.ndarray]]:
    """Returns a function that simulates a model in Exudyn by the classical Runge-Kutta method. The function returns
    arrays: coordinates of every node, then rates of every node, each with times (s) in the first column."""
    import exudyn as exu
    import exudyn.itemInterface as items

    kinds = exu.OutputVariableType
    sensors = [
        mbs.AddSensor(items.SensorNode(nodeNumber=node, storeInternal=True, writeToFile=False, outputVariableType=kind))
        for kind in (kinds.Coordinates, kinds.Coordinates_t)
        for node in nodes
    ]
    mbs.Assemble()
    options = exu.SimulationSettings()
    options.solution.file.write = False
    options.solution.sensors.writePeriod = step
    ti = options.timeIntegration
    ti.numberOfSteps, ti.endTime, ti.verboseMode = step_count, step * step_count, 0
    ti.adaptiveStep = False
    ti.explicit.computeEndOfStepAccelerations = False

    def march(container_kept_alive: Any = container) -> list[np.ndarray]:  # the system lives as long as its container
        mbs.SolveDynamic(options, solverType=exu.DynamicSolverType.RK44)
        return [mbs.GetSensorStoredData(sensor) for sensor in sensors]

    return march


def mujoco_model(parameters: PitchPlaneParameters, step: float) -> Any:
    """The pitch-plane vehicle in MuJoCo, from hand-written XML; z points down, positive pitch lifts the front."""
    import mujoco

    return mujoco.MjModel.from_xml_string(
        MJCF.format(**{**parameters.model_dump(), "minus_a": -parameters.a, "step": repr(step)})
    )


def mujoco_run(parameters: PitchPlaneParameters, start_state: np.ndarray, step: float, step_count: int) -> Run:
    """Returns a function that simulates the pitch-plane vehicle in MuJoCo by the classical Runge-Kutta method; step in
    s."""
    import mujoco
    from mujoco import rollout

    model = mujoco_model(parameters, step)
    data = mujoco.MjData(model)
    state = np.concatenate(([0.0], start_state))

    def run() -> np.ndarray:
        path, _ = rollout.rollout(model, data, state[None, :], nstep=step_count)
        return np.vstack([start_state, path[0, :, 1:9]])

    return run


MJCF = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="{step}" gravity="0 0 {g!r}" integrator="RK4">
    <flag autoreset="disable" contact="disable" constraint="disable"/>
  </option>
  <worldbody>
    <body pos="{b!r} 0 0">
      <inertial pos="0 0 0" mass="{m1!r}" diaginertia="1 1 1"/>
      <joint type="slide" axis="0 0 1" stiffness="{k1!r}" damping="{d1!r}"/>
      <site name="front wheel"/>
    </body>
    <body pos="{minus_a!r} 0 0">
      <inertial pos="0 0 0" mass="{m2!r}" diaginertia="1 1 1"/>
      <joint type="slide" axis="0 0 1" stiffness="{k2!r}" damping="{d2!r}"/>
      <site name="rear wheel"/>
    </body>
    <body>
      <inertial pos="0 0 0" mass="{m3!r}" diaginertia="{I!r} {I!r} {I!r}"/>
      <joint type="slide" axis="0 0 1"/>
      <joint type="hinge" axis="0 1 0"/>
      <site name="front" pos="{b!r} 0 0"/>
      <site name="rear" pos="{minus_a!r} 0 0"/>
    </body>
  </worldbody>
  <actuator>
    <general site="front" refsite="front wheel" gear="0 0 1 0 0 0"
             gainprm="0" biastype="affine" biasprm="0 -{k3!r} -{d3!r}"/>
    <general site="rear" refsite="rear wheel" gear="0 0 1 0 0 0"
             gainprm="0" biastype="affine" biasprm="0 -{k4!r} -{d4!r}"/>
  </actuator>
</mujoco>
"""
