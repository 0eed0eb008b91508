"""Table of numbers that the compiled forces of a cut vehicle read: its bodies, springs and hubs, and the inputs over
time."""

import itertools
from dataclasses import dataclass, replace

import numpy as np

from models.multibody import cut_kernel as kernel
from models.multibody.parts import curve_numbers
from models.vehicles.cut_vehicle import ROLL, CutVehicle, CutVehicleElement
from models.vehicles.free_vehicle import joint_table as free_joints
from models.vehicles.free_vehicle import last_coordinate_and_joint
from models.vehicles.spatial import Vector


@dataclass(frozen=True)
class HubInputs:
    """Measured loads at the wheel hubs of a cut vehicle, and its prescribed roll and pitch, at half steps: row i is at
    the time of i / 2 steps.

    hubs : (m, 6 h), force (N) and moment (N m) of each hub in ``frame``, "hub", "body" or "inertial"; or, on a road,
        (m, 2 h), heights (m) under the hubs, then their rates (m/s), for a vehicle that travels at ``speed`` (m/s)
    guide : (m, 6), prescribed roll, pitch, their rates and accelerations (rad, per s); None leaves the vehicle free
    pull : stiffness and damping (N m/rad, N m s/rad) of roll, then pitch, towards these angles; None enforces them
    enforcing_rate : 1/s, how fast an enforced angle comes back to its prescribed course, critically damped
    constant_in_step : whether the hubs' forces at the start of a step are those of the whole step
    """

    hubs: np.ndarray
    frame: str = "hub"
    speed: float = 0.0
    guide: np.ndarray | None = None
    pull: tuple[float, float, float, float] | None = None
    enforcing_rate: float = 20.0
    constant_in_step: bool = False

    @property
    def road(self) -> bool:
        """Whether tyres on a road act instead of measured forces."""
        return self.speed > 0.0

    @property
    def rows(self) -> np.ndarray:
        """Inputs in the form that the kernel reads: (m, 6 h or 2 h), with 6 more columns if there is a guide."""
        return self.hubs if self.guide is None else np.hstack([self.hubs, self.guide])

    def constant_force_spans(self) -> list[tuple[int, int]]:
        """First and last step of each time span in which the hub forces are constant, in order of time."""
        begins = self.hubs[:-1:2]
        changes = np.flatnonzero((begins[1:] != begins[:-1]).any(axis=1)) + 1
        ends = [0, *changes.tolist(), len(begins)]
        return list(itertools.pairwise(ends))

    def in_steps(self, first_step: int, last_step: int) -> "HubInputs":
        """Hub inputs of the steps from ``first_step`` to ``last_step`` alone, with the hub forces of their start
        throughout; their time starts at 0."""
        hubs = np.repeat(self.hubs[2 * first_step : 2 * first_step + 1], 2 * (last_step - first_step) + 1, axis=0)
        return replace(
            self, hubs=hubs, guide=None if self.guide is None else self.guide[2 * first_step : 2 * last_step + 1]
        )


@dataclass(frozen=True)
class JointTable:
    """Joint table of a cut vehicle. For every body by name: the index of its last joint, and the position (m) of
    that joint."""

    rows: np.ndarray
    last_joint: dict[str, int]
    joint_position: dict[str, Vector]


def joint_table_of(vehicle: CutVehicle) -> JointTable:
    """Joint table of a cut vehicle, in the order of its coordinates. All joints of a body have the same position, that
    of the first."""
    kind, below, *arm = free_joints(vehicle.tree).T
    anchors = {body.name: last_coordinate_and_joint(vehicle.tree, body.name) for body in vehicle.tree.bodies}
    rows = np.column_stack([below, kind >= 3, kind % 3, *arm])
    origin = {name: place for name, (_, place) in anchors.items()}
    return JointTable(rows, {name: joint for name, (joint, _) in anchors.items()}, origin)


def cut_vehicle_table(vehicle: CutVehicle, hub_inputs: HubInputs, time_step: float) -> np.ndarray:
    """Table of all numbers that the compiled forces of a cut vehicle read, for a run with a step (s)."""
    joined = joint_table_of(vehicle)
    bodies = []
    for body in (body for body in vehicle.tree.bodies if body.mass or np.any(body.inertia)):
        arm = np.subtract(body.position, joined.joint_position[body.name])
        bodies.append([joined.last_joint[body.name], body.mass, *arm, *np.ravel(body.inertia)])
    elements = [_element_numbers(element, joined) for element in vehicle.elements]
    hubs = [_hub_numbers(vehicle, joined, i) for i in range(len(vehicle.hubs))]
    inputs = hub_inputs.rows
    head = np.zeros(kernel.HEADER)
    counts = [len(rows) for rows in (joined.rows, bodies, elements, hubs)]
    head[[kernel.JOINTS, kernel.BODIES, kernel.ELEMENTS, kernel.HUBS]] = counts
    head[[kernel.ROAD, kernel.FRAME, kernel.SPEED]] = (
        hub_inputs.road,
        kernel.FRAMES.index(hub_inputs.frame),
        hub_inputs.speed,
    )
    head[[kernel.ROWS_PER_SECOND, kernel.ROWS, kernel.COLUMNS]] = 2.0 / time_step, *inputs.shape
    head[[kernel.GRAVITY, kernel.CHASSIS, kernel.ENFORCING_RATE]] = (
        vehicle.tree.gravity,
        ROLL,
        hub_inputs.enforcing_rate,
    )
    if hub_inputs.guide is not None:
        head[kernel.STABILISER] = kernel.PULLED if hub_inputs.pull else kernel.ENFORCED
    head[kernel.ROLL_STIFFNESS : kernel.PITCH_DAMPING + 1] = hub_inputs.pull or 0.0
    rows = np.array(elements, float).reshape(-1, kernel.PER_ELEMENT)
    parts = (head, joined.rows, np.array(bodies, float), rows, np.array(hubs), inputs)
    curves = _put_curves(vehicle, rows, sum(part.size for part in parts))
    whole = np.concatenate([*(np.ravel(part) for part in parts), curves])
    whole[kernel.TABLE_SIZE] = len(whole)
    return whole


def _put_curves(vehicle: CutVehicle, element_rows: np.ndarray, first_index: int) -> np.ndarray:
    """Numbers of all force curves. The position of each curve, counted from ``first_index``, is also written into its
    element's row."""
    placed = list[float]()
    for row, element in zip(element_rows, vehicle.elements, strict=True):
        for column, curve in ((kernel.TRAVEL_CURVE, element.travel_force), (kernel.RATE_CURVE, element.rate_force)):
            if curve is not None:
                row[column] = first_index + len(placed)
                placed += curve_numbers(curve).tolist()
    return np.array(placed)


def _element_numbers(element: CutVehicleElement, joint_table: JointTable) -> list[float]:
    first, two = (
        np.subtract(element.first_point, joint_table.joint_position[element.first_body]),
        np.subtract(element.second_point, joint_table.joint_position[element.second_body]),
    )
    law = (
        element.preload,
        element.stiffness,
        element.damping,
        joint_table.last_joint[element.frame],
        element.friction,
        element.friction_rate,
        0.0,
        0.0,
    )
    return [
        joint_table.last_joint[element.first_body],
        *first,
        joint_table.last_joint[element.second_body],
        *two,
        *element.axis,
        element.design,
        *law,
    ]


def _hub_numbers(vehicle: CutVehicle, joint_table: JointTable, hub_index: int) -> list[float]:
    """Numbers of a wheel hub, including those of the tyre that was on it."""
    tyre = vehicle.uncut.tyres[hub_index]
    side = next((force for force in vehicle.uncut.side_forces if force.name == tyre.name), None)
    law = (tyre.stiffness, tyre.damping, side.stiffness if side else 0.0, side.roll_steer if side else 0.0)
    arm = np.subtract(tyre.point, joint_table.joint_position[tyre.body])
    return [joint_table.last_joint[tyre.body], *arm, tyre.point[2], vehicle.loads[hub_index], *law, tyre.pushes_only]
