"""A car with seven degrees of freedom on a rough road, written by hand for each engine, and its equations of motion.

Body (z, roll, pitch) on four vertical spring-dampers, wheels (z) on tyre springs, without gravity. Its parameters go
straight into Exudyn's items, and into MuJoCo's XML with site actuators for the suspension. No engine reads a table at
the stages of a step, so the road's forces come by one callback in each engine, compiled in MuJoCo.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from models.machine.compiled import lean, njit
from models.vehicles.spatial import SpatialVehicle
from validation.absence.hand_built import exudyn_march

Run = Callable[[], np.ndarray]
"""Function that simulates from rest; returns the states (step_count + 1, 14): z, roll and pitch of the body, z of the
wheels, then all rates."""


@dataclass(frozen=True)
class Car:
    """Parameters of a car with four wheels: mass of the body and of a wheel (kg), inertias of the body (kg m^2), tyre
    stiffness (N/m), centre of mass (m). corners (4, 5): position x, y, z of each strut relative to the body's centre of
    mass (m), its stiffness (N/m) and its damping (N s/m)."""

    mass: float
    inertia: tuple[float, float, float]
    wheel: float
    tyre: float
    centre: tuple[float, float, float]
    corners: np.ndarray

    @classmethod
    def of(cls, vehicle: SpatialVehicle) -> "Car":
        """Parameters of the car, read from a seven-degree-of-freedom vehicle."""
        body, wheel = vehicle.bodies[:2]
        corners = [[*np.subtract(s.first_point, body.position), s.stiffness, s.damping] for s in vehicle.springs]
        return cls(
            body.mass,
            tuple(np.diag(body.inertia).tolist()),
            wheel.mass,
            vehicle.tyres[0].stiffness,
            body.position,
            np.array(corners),
        )


def exudyn_run(car: Car, road_heights: np.ndarray, time_step: float, step_count: int) -> Run:
    """Returns a function that simulates the car in Exudyn by the classical Runge-Kutta method; ``road_heights`` (2
    step_count + 1, 4): heights (m) under the wheels at half steps."""
    import exudyn as exu
    import exudyn.itemInterface as typed_items

    items: Any = typed_items
    lists: Any = exu
    container = exu.SystemContainer()
    mbs: Any = container.AddSystem()
    mbs.AddObject(items.ObjectGround())
    kinds, zero, still = exu.JointType, np.zeros((3, 3)), [0.0, 0.0, 0.0]
    nodes = [
        mbs.AddNode(
            items.NodeGenericODE2(
                referenceCoordinates=still,
                initialCoordinates=still,
                initialCoordinates_t=still,
                numberOfODE2Coordinates=3,
            )
        )
    ]
    body = mbs.AddObject(
        items.ObjectKinematicTree(
            nodeNumber=nodes[0],
            gravity=still,
            jointTypes=[kinds.PrismaticZ, kinds.RevoluteX, kinds.RevoluteY],
            linkParents=[-1, 0, 1],
            jointTransformations=lists.Matrix3DList([np.eye(3)] * 3),
            jointOffsets=lists.Vector3DList([np.array(car.centre), np.zeros(3), np.zeros(3)]),
            linkInertiasCOM=lists.Matrix3DList([zero, zero, np.diag(car.inertia)]),
            linkCOMs=lists.Vector3DList([np.zeros(3)] * 3),
            linkMasses=[0.0, 0.0, car.mass],
        )
    )
    upright = [[0, 0, -1], [0, 1, 0], [1, 0, 0]]
    for x, y, z, stiffness, damping in car.corners.tolist():
        node = mbs.AddNode(items.Node1D(referenceCoordinates=[0.0], initialCoordinates=[0.0], initialVelocities=[0.0]))
        wheel = mbs.AddObject(
            items.Mass1D(
                nodeNumber=node,
                mass=car.wheel,
                referenceRotation=upright,
                referencePosition=np.add(car.centre, (x, y, z)).tolist(),
            )
        )
        ends = [
            mbs.AddMarker(items.MarkerKinematicTreeRigid(objectNumber=body, linkNumber=2, localPosition=[x, y, z])),
            mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=wheel)),
        ]
        mbs.AddObject(
            items.CartesianSpringDamper(markerNumbers=ends, stiffness=[0, 0, stiffness], damping=[0, 0, damping])
        )
        nodes.append(node)
    forces, per_time = (car.tyre * road_heights).tolist(), 2.0 / time_step
    mbs.AddObject(
        items.ObjectGenericODE2(
            nodeNumbers=nodes[1:],
            massMatrix=np.zeros((4, 4)),
            stiffnessMatrix=car.tyre * np.eye(4),
            forceUserFunction=lambda mbs, t, item, q, v: forces[round(t * per_time)],
        )
    )
    march = exudyn_march(container, mbs, nodes, time_step, step_count)
    return lambda: np.hstack([states[:, 1:] for states in march()])


def mujoco_run(car: Car, road_heights: np.ndarray, time_step: float, step_count: int) -> Run:
    """Returns a function that simulates the car in MuJoCo by the classical Runge-Kutta method; ``road_heights`` (2
    step_count + 1, 4): heights (m) under the wheels at half steps."""
    import mujoco
    from mujoco import rollout

    wheels = np.add(car.centre, car.corners[:, :3])
    corners = [
        {"i": i, "strut": _text(corner), "wheel": _text(wheel), "k": corner[3], "d": corner[4]}
        for i, (corner, wheel) in enumerate(zip(car.corners.tolist(), wheels, strict=True))
    ]
    parts = {
        name: "".join(corner_template.format(**corner, mass=car.wheel, tyre=car.tyre) for corner in corners)
        for name, corner_template in CORNERS.items()
    }
    centre, size = _text(np.array(car.centre)), 2 + road_heights.size
    vehicle_xml = VEHICLE_XML.format(step=time_step, centre=centre, mass=car.mass, size=size, **parts)
    model = mujoco.MjModel.from_xml_string(vehicle_xml)
    model.body_inertia[1] = car.inertia  # no distribution of mass has these, and the compiler says so
    model.numeric_data[:] = [2.0 / time_step, car.tyre, *road_heights.ravel()]
    mujoco.mj_setConst(model, mujoco.MjData(model))
    data, start, law = mujoco.MjData(model), np.zeros((1, 15)), _road_law()

    def run() -> np.ndarray:
        mujoco.set_mjcb_passive(law.ctypes)
        try:
            path, _ = rollout.rollout(model, data, start, nstep=step_count)
        finally:
            mujoco.set_mjcb_passive(None)
        return np.vstack([start[:, 1:], path[0, :, 1:15]])

    return run


@cache
def _road_law() -> Any:
    """Compiled MuJoCo callback that adds the road's forces on the wheels, from a table in the model's numeric data."""
    from numba import cfunc, types

    from models.engines.mujoco_layout import offset
    from models.machine.stack import array_at, double_at

    numeric, passive = offset("mjModel", "numeric_data"), offset("mjData", "qfrc_passive")
    time = offset("mjData", "time")

    @cfunc(types.void(types.voidptr, types.voidptr), cache=True)
    def law(model, case_data):
        parameter_array, forces = array_at(model, numeric), array_at(case_data, passive)
        row = 2 + 4 * int(np.rint(double_at(case_data, time)[0] * parameter_array[0]))
        for i in range(4):
            forces[3 + i] += parameter_array[1] * parameter_array[row + i]

    return law


STATE_COUNT, BODY_NUMBERS, CORNER_NUMBERS = 14, 4, 5
"""Number of states of the car; in ``parameter_array``, number of values of the body and of each corner."""


@lean
def rates(car_state, road_heights, car_parameters, state_rate):
    """Compute the time derivatives (14,) of a linear car's state on road heights (4,) (m). ``car_parameters``: masses
    of body and wheel, roll and pitch inertia, then x, y, stiffness, damping and tyre stiffness of every corner."""
    lift = roll = pitch = 0.0
    for i in range(4):
        k = BODY_NUMBERS + CORNER_NUMBERS * i
        distance_ahead, distance_aside, stiffness, damping, tyre = (
            car_parameters[k],
            car_parameters[k + 1],
            car_parameters[k + 2],
            car_parameters[k + 3],
            car_parameters[k + 4],
        )
        body_height, fast = (
            car_state[0] + distance_aside * car_state[1] - distance_ahead * car_state[2],
            car_state[7] + distance_aside * car_state[8] - distance_ahead * car_state[9],
        )
        force = stiffness * (car_state[3 + i] - body_height) + damping * (car_state[10 + i] - fast)
        lift, roll, pitch = lift + force, roll + distance_aside * force, pitch - distance_ahead * force
        state_rate[3 + i], state_rate[10 + i] = (
            car_state[10 + i],
            (tyre * (road_heights[i] - car_state[3 + i]) - force) / car_parameters[1],
        )
    for i in range(3):
        state_rate[i] = car_state[7 + i]
    state_rate[7], state_rate[8], state_rate[9] = (
        lift / car_parameters[0],
        roll / car_parameters[2],
        pitch / car_parameters[3],
    )


@njit(cache=True, error_model="numpy")
def march(copy_states, road_heights, step, car_parameters):
    """Simulate each copy of the car by the classical Runge-Kutta method and overwrite ``copy_states`` (14, copies) with
    the final states. road_heights (2 step_count + 1, 4, copies): heights (m) at half steps."""
    rate, total, stage_state = np.empty(STATE_COUNT), np.empty(STATE_COUNT), np.empty(STATE_COUNT)
    for copy in range(copy_states.shape[1]):
        x, road = copy_states[:, copy].copy(), road_heights[:, :, copy].copy()
        for i in range(len(road) // 2):
            rates(x, road[2 * i], car_parameters, rate)
            for k in range(STATE_COUNT):
                total[k], stage_state[k] = rate[k], x[k] + 0.5 * step * rate[k]
            for stage in range(2):
                rates(stage_state, road[2 * i + 1], car_parameters, rate)
                for k in range(STATE_COUNT):
                    total[k] += 2.0 * rate[k]
                    stage_state[k] = x[k] + (0.5 * step if stage == 0 else step) * rate[k]
            rates(stage_state, road[2 * i + 2], car_parameters, rate)
            for k in range(STATE_COUNT):
                x[k] += step / 6.0 * (total[k] + rate[k])
        copy_states[:, copy] = x


def parameter_array(car: Car) -> np.ndarray:
    """A car's parameters as one array, in the order that ``rates`` expects."""
    corners = np.column_stack([car.corners[:, [0, 1, 3, 4]], np.full(4, car.tyre)])
    return np.concatenate([[car.mass, car.wheel, car.inertia[0], car.inertia[1]], corners.ravel()])


def _text(point_coordinates: Any) -> str:
    return " ".join(repr(float(value)) for value in point_coordinates[:3])


CORNERS = {
    "site": """<site name="top {i}" pos="{strut}"/>
""",
    "wheel": """<body pos="{wheel}">
  <inertial pos="0 0 0" mass="{mass!r}" diaginertia="1 1 1"/>
  <joint type="slide" axis="0 0 1" stiffness="{tyre!r}"/>
  <site name="wheel {i}"/>
</body>
""",
    "actuator": """<general site="top {i}" refsite="wheel {i}" gear="0 0 1 0 0 0"
         gainprm="0" biastype="affine" biasprm="0 -{k!r} -{d!r}"/>
""",
}
"""MuJoCo XML of a corner: the strut's site on the body, the wheel's body, the suspension's actuator."""
VEHICLE_XML = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="{step!r}" gravity="0 0 0" integrator="RK4">
    <flag autoreset="disable" contact="disable" constraint="disable"/>
  </option>
  <worldbody>
    <body pos="{centre}">
      <inertial pos="0 0 0" mass="{mass!r}" diaginertia="1 1 1"/>
      <joint type="slide" axis="0 0 1"/>
      <joint type="hinge" axis="1 0 0"/>
      <joint type="hinge" axis="0 1 0"/>
      {site}
    </body>
    {wheel}
  </worldbody>
  <actuator>{actuator}</actuator>
  <custom><numeric name="road" size="{size}" data="0"/></custom>
</mujoco>
"""
