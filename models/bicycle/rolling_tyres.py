"""Whipple's bicycle for an engine: bodies behind joints, and compiled forces of both tyres and of the control.

The engine's design position has the steering axis upright, so that it lies along a joint's z: the pitch of the rear
frame is -tilt where the bicycle stands. Coordinates, axes of ISO 8855: x, y, yaw of the carrier, which is below the
rear wheel's centre; height (less the radius), lean, pitch of the frame; spin of the rear wheel; steer to the left; spin
of the front wheel.

Each tyre is that of handling (``models.tyre.bristles``) on the wheel's lowest point, R from its centre in its plane:
its load N = N0 + k (R cos lean - height) - c (its rate), N0 the load at rest, has the potential N^2 / 2 k. Stiffness s
scales a tyre so that it tends to ideal rolling: C = s C0, k = s^2 k0 and the width b0 / s, so that the side slip, the
trail and the patch's moment of turning all vanish as 1 / s.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from models.bicycle.whipple import FREE, Control, Whipple
from models.contact.fastsim_many import LOAD, MU, A, B
from models.core.errors import InputError
from models.engines.free_vehicle import Driven
from models.machine.compiled import lean
from models.machine.stack import array, at, beyond, doubles, row, start
from models.multibody import tree
from models.multibody.moving_vehicle import Tree, carried, carrier_frame
from models.multibody.tree import (
    AHEAD,
    ASIDE,
    GROUND,
    LOOSE,
    PER_JOINT,
    PER_LINK,
    PER_POINT,
    PER_SPOT,
    RATE,
    TURN,
    TURNED,
    TURNING,
    WHERE,
    cross,
    dot,
    inwards,
    locate,
    outwards,
    plus,
    push,
    three,
    times,
    twist,
)
from models.tyre.bristles import FIRST, net, shape_factor, tyre_forces
from models.vehicles.free_vehicle import joints
from models.vehicles.spatial import Body, SpatialVehicle

X, Y, YAW, HEIGHT, LEAN, PITCH, REAR, STEER, FRONT = range(COUNT := 9)
WHEELS = 2
(GAIN, UNTIL, FRICTION, DRY, DRY_RATE, SPEED_GAIN, SPEED_BIAS, MIDDLE, CELLS, STRIPS, TYRES) = range(11)
"""Head of the table: the control (gains multiplied), the patch's net; then tyres, joints, points, cells, strips."""
(CARRIER, ROTOR, RADIUS, LEVEL, STATIC, VERTICAL, VISCOUS, WIDTH, BRISTLES, GRIP, PER_TYRE) = range(11)
"""Of a tyre: coordinates of its frame and its spin; R and the height of its centre in the design position (m); N0, k,
c, half width (m), bristles (N/m^3), friction."""
(NORMAL, FX, FY, MZ, DEFLECTION, REPORTED) = range(6)
"""Columns of a tyre's report: load, creep forces (N), moment (N m), compression beyond rest (m)."""
POTENTIAL, DISSIPATED, STEER_POWER, LEDGER = range(4)
"""Energy of the tyres (J); power (W) of creep forces and tyre dampers; of the steer torque."""
JOINTS_AT = TYRES + WHEELS * PER_TYRE
POINTS_AT = JOINTS_AT + COUNT * PER_JOINT
CELLS_AT = POINTS_AT + WHEELS * PER_POINT


@dataclass(frozen=True)
class BicycleTyre:
    """cornering : side force by slip and load, 1/rad; vertical : N/m; damping : N s/m; half_width : m, of the patch;
    friction; cells : of the patch's net per strip; stiffness : s, by which the tyre is stiffer than that."""

    cornering: float = 20.0
    vertical: float = 2e5
    damping: float = 200.0
    half_width: float = 5e-3
    friction: float = 1.0
    cells: int = 9
    stiffness: float = 1.0


@dataclass(frozen=True, eq=False)
class RollingBicycle:
    """The bicycle on its tyres, as engines build it: ``driven``. InputError for what only the linear equations take."""

    bicycle: Whipple
    tyre: BicycleTyre = BicycleTyre()
    control: Control = FREE
    vehicle: SpatialVehicle = field(init=False)
    numbers: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        for name in ("rear_wheel", "body", "front_frame", "front_wheel"):
            part = getattr(self.bicycle, name)
            needed = {"mass": part.mass, "Ixx": part.Ixx, **({"Iyy": part.Iyy} if name.endswith("wheel") else {})}
            for key, value in needed.items():
                if not value > 0.0:
                    allowed = "must be above 0 in engines, whose every body has inertia; linear equations take 0"
                    raise InputError("", f"{name}.{key}", value, allowed)
        object.__setattr__(self, "vehicle", _vehicle(self.bicycle))
        object.__setattr__(self, "numbers", _table(self))

    @property
    def driven(self) -> Driven:
        """What an engine builds."""
        gravity = np.array([0.0, 0.0, -self.bicycle.gravity])
        return Driven(self.vehicle, gravity, self.numbers, bicycle_forces, set_bicycle_forces)

    def straight(self, speed: float, lean_rate: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Positions and rates (9,) of rolling straight and upright at a speed (m/s), with a lean rate (rad/s) about
        the line of the contacts."""
        q, v, b = np.zeros(COUNT), np.zeros(COUNT), self.bicycle
        q[PITCH] = -b.tilt
        v[X], v[REAR], v[FRONT] = speed, speed / b.rear_wheel.radius, speed / b.front_wheel.radius
        v[LEAN], v[Y] = lean_rate, -lean_rate * b.rear_wheel.radius
        return q, v

    def report(self, times: np.ndarray, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Reports (n, 2, REPORTED) of the tyres and ledgers (n, LEDGER) at times (n,), positions and rates (n, 9)."""
        tyres, ledgers = np.empty((len(times), WHEELS, REPORTED)), np.empty((len(times), LEDGER))
        read_bicycle(self.numbers, np.ascontiguousarray(q), np.ascontiguousarray(v), tyres, ledgers)
        return tyres, ledgers

    def loads(self) -> tuple[float, float]:
        """Loads (N) at rest of the rear and the front wheel."""
        b, g = self.bicycle, self.bicycle.gravity
        mass = b.rear_wheel.mass + b.body.mass + b.front_frame.mass + b.front_wheel.mass
        moment = b.body.mass * b.body.x + b.front_frame.mass * b.front_frame.x + b.front_wheel.mass * b.wheelbase
        front = g * moment / b.wheelbase
        return g * mass - front, front


def _vehicle(b: Whipple) -> SpatialVehicle:
    """Bodies in the order of a walk through their tree, in the design position with the steering axis upright."""
    sine, cosine = math.sin(b.tilt), math.cos(b.tilt)
    turned = np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])
    origin = np.array([0.0, 0.0, b.rear_wheel.radius])

    def place(x: float, z: float) -> tuple[float, float, float]:
        x, y, z = (origin + turned @ (np.array([x, 0.0, z]) - origin)).tolist()
        return x, y, z

    def tensor(inertia: np.ndarray) -> tuple[tuple[float, float, float], ...]:
        up = np.diag([1.0, -1.0, -1.0])
        return tuple(map(tuple, (turned @ up @ inertia @ up @ turned.T).tolist()))

    R, B, H, F = b.rear_wheel, b.body, b.front_frame, b.front_wheel
    rear, front = (np.diag([wheel.Ixx, wheel.Iyy, wheel.Ixx]) for wheel in (R, F))
    hub, pivot = place(0.0, R.radius), place(b.wheelbase + b.trail, 0.0)
    bodies = (
        Body("carrier", 0.0, (0.0, 0.0, 0.0), ("x", "y", "rz")),
        Body("frame", 0.0, hub, ("z", "rx", "ry"), parent="carrier"),
        Body("body", B.mass, place(B.x, -B.z), (), tensor(B.inertia), "frame"),  # type: ignore[arg-type]
        Body("rear wheel", R.mass, hub, ("ry",), tensor(rear), "body"),  # type: ignore[arg-type]
        Body("steering", 0.0, pivot, ("rz",), parent="body"),
        Body("front frame", H.mass, place(H.x, -H.z), (), tensor(H.inertia), "steering"),  # type: ignore[arg-type]
        Body("front wheel", F.mass, place(b.wheelbase, F.radius), ("ry",), tensor(front), "front frame"),  # type: ignore[arg-type]
    )
    return SpatialVehicle("bicycle", bodies, (), (), (), gravity=b.gravity)


def _table(of: RollingBicycle) -> np.ndarray:
    """All numbers that the compiled forces read."""
    b, t, c, patch = of.bicycle, of.tyre, of.control, net(of.tyre.cells)
    rows = joints(of.vehicle)
    counts = [len(body.freedoms) for body in of.vehicle.bodies for _ in body.freedoms]
    rows[[REAR, FRONT], tree.KIND] = LOOSE
    bodies = {body.name: body.position for body in of.vehicle.bodies}
    tyres, points = [], []
    for carrier, rotor, wheel, name, joint, load in (
        (PITCH, REAR, b.rear_wheel, "rear wheel", "frame", of.loads()[0]),
        (STEER, FRONT, b.front_wheel, "front wheel", "steering", of.loads()[1]),
    ):
        if not load > 0.0:
            raise InputError("", name, load, "carries no weight (N): it must press on the road at rest")
        vertical, width = t.stiffness**2 * t.vertical, t.half_width / t.stiffness
        bristles = t.stiffness * t.cornering * vertical / (shape_factor(t.cells) * wheel.radius * width)
        law = [load, vertical, t.stiffness * t.damping, width, bristles, t.friction]
        tyres.append([carrier, rotor, wheel.radius, bodies[name][2], *law])
        points.append([carrier, *np.subtract(bodies[name], bodies[joint])])
    head = [c.torque_gain * c.gain, c.until, c.friction, c.dry_friction, c.dry_rate, c.speed_gain, c.speed_bias]
    head += [patch.middle, patch.cells.shape[1], patch.strips.shape[1]]
    sections = (head, np.ravel(tyres), np.column_stack([rows, counts]).ravel(), np.ravel(points))
    return np.concatenate([*map(np.asarray, sections), patch.cells.ravel(), patch.strips.ravel()]).astype(float)


@lean
def _touch(tyre, spot, link, frame, spin, patch, slip, way, report):
    """Load of a tyre, and its contact's slip and axes into ``way``: place, along, across, normal force, axle."""
    axle, centre = three(link, TURNED + 3), three(spot, WHERE)
    flat = math.sqrt(1.0 - axle[2] * axle[2])
    arm = times(plus(times(axle, axle[2]), (0.0, 0.0, -1.0)), tyre[RADIUS] / flat)
    along = times((axle[1], -axle[0], 0.0), 1.0 / flat)
    across = (-along[1], along[0], 0.0)
    turning = plus(plus(three(link, TURNING), (0.0, 0.0, frame.yawing)), times(axle, spin))
    sliding = plus(plus(three(spot, RATE), carried(frame, centre)), cross(turning, arm))
    deflection = tyre[RADIUS] * flat - centre[2]
    elastic = max(tyre[STATIC] + tyre[VERTICAL] * deflection, 0.0)
    load = max(elastic - tyre[VISCOUS] * sliding[2], 0.0) if elastic > 0.0 else 0.0
    slip[0], slip[1], slip[2] = dot(sliding, along), dot(sliding, across), turning[2]
    slip[3] = -spin * dot(cross(axle, arm), along)
    patch[A], patch[B] = math.sqrt(tyre[RADIUS] * load / tyre[VERTICAL]), tyre[WIDTH]
    patch[LOAD], patch[MU] = load, tyre[GRIP]
    patch[FIRST] = patch[FIRST + 1] = patch[FIRST + 2] = 1.0 / tyre[BRISTLES]
    report[NORMAL], report[DEFLECTION] = load, deflection
    tree.put(way, 0, arm)
    tree.put(way, 3, along)
    tree.put(way, 6, across)
    return 0.5 * elastic * elastic / tyre[VERTICAL], (load - elastic) * sliding[2]


@lean
def _press(tyre, creeping, spot, link, ground, way, forces, report):
    """Load, creep forces and moment of a tyre onto its frame, and their moment about the axle onto the spin."""
    arm, axle = three(way, 0), three(link, TURNED + 3)
    force = plus(times(three(way, 3), creeping[0]), times(three(way, 6), creeping[1]))
    force = plus(force, (0.0, 0.0, report[NORMAL]))
    moment = plus(cross(arm, force), (0.0, 0.0, creeping[2]))
    push(link, ground, force, three(spot, WHERE))
    twist(link, ground, moment)
    forces[int(tyre[ROTOR])] += dot(axle, moment)
    report[FX], report[FY], report[MZ] = creeping[0], creeping[1], creeping[2]


@lean
def _steer(numbers, frame, v, f, ledger):
    """Torque of control and friction on the steering, to the left, by the speed of the rear wheel's centre."""
    missing = max(numbers[UNTIL] - numbers[SPEED_GAIN] * abs(frame.ahead) - numbers[SPEED_BIAS], 0.0)
    torque = -numbers[GAIN] * missing * v[LEAN] - numbers[FRICTION] * v[STEER]
    if numbers[DRY] != 0.0:
        torque -= numbers[DRY] * math.tanh(v[STEER] / numbers[DRY_RATE])
    f[STEER] += torque
    ledger[STEER_POWER] = torque * v[STEER]


@lean
def all_bicycle_forces(table, q, v, f, report, ledger):
    """Add all forces to ``f`` (9,); table : pointer; q, v (9,), report (2, REPORTED), ledger (LEDGER,) : arrays."""
    head = array(table, (TYRES,))
    room = doubles(PER_LINK * COUNT + PER_SPOT * WHEELS + GROUND)
    spots = beyond(room, PER_LINK * COUNT)
    ground = array(beyond(spots, PER_SPOT * WHEELS), (GROUND,))
    ground[AHEAD] = ground[ASIDE] = ground[TURN] = 0.0
    outwards(beyond(table, JOINTS_AT), COUNT, q, v, room)
    locate(beyond(table, POINTS_AT), WHEELS, room, spots)
    frame, ways = carrier_frame(q, v), doubles(9 * WHEELS)
    patches, slips = array(doubles(10 * WHEELS), (WHEELS, 10)), array(doubles(4 * WHEELS), (WHEELS, 4))
    creeping = array(doubles(4 * WHEELS), (WHEELS, 4))
    ledger[POTENTIAL] = ledger[DISSIPATED] = 0.0
    for i in range(WHEELS):
        tyre, spot = row(beyond(table, TYRES), PER_TYRE, i), row(spots, PER_SPOT, i)
        link, spin = row(room, PER_LINK, int(tyre[CARRIER])), v[int(tyre[ROTOR])]
        stored, lost = _touch(tyre, spot, link, frame, spin, patches[i], slips[i], row(ways, 9, i), report[i])
        ledger[POTENTIAL] += stored
        ledger[DISSIPATED] += lost
    cells, strips = int(head[CELLS]), int(head[STRIPS])
    net_cells = array(beyond(table, CELLS_AT), (5, cells))
    net_strips = array(beyond(table, CELLS_AT + 5 * cells), (4, strips))
    tyre_forces(patches, slips, net_strips, net_cells, head[MIDDLE], creeping)
    for i in range(WHEELS):
        tyre, spot = row(beyond(table, TYRES), PER_TYRE, i), row(spots, PER_SPOT, i)
        link = row(room, PER_LINK, int(tyre[CARRIER]))
        _press(tyre, creeping[i], spot, link, ground, row(ways, 9, i), f, report[i])
        for k in range(3):
            ledger[DISSIPATED] += creeping[i, k] * slips[i, k]
    _steer(head, frame, v, f, ledger)
    inwards(beyond(table, JOINTS_AT), COUNT, beyond(table, POINTS_AT), WHEELS, Tree(room, spots, ground), f)
    f[X] += frame.cosine * ground[AHEAD] - frame.sine * ground[ASIDE]
    f[Y] += frame.sine * ground[AHEAD] + frame.cosine * ground[ASIDE]
    f[YAW] += ground[TURN]


@lean
def bicycle_forces(numbers, t, q, v, f):
    """Add the forces to ``f``, for callbacks: all but the time (s) are pointers to doubles."""
    report, ledger = array(doubles(WHEELS * REPORTED), (WHEELS, REPORTED)), array(doubles(LEDGER), (LEDGER,))
    all_bicycle_forces(numbers, array(q, (COUNT,)), array(v, (COUNT,)), array(f, (COUNT,)), report, ledger)


@lean
def set_bicycle_forces(block, t, n):
    """``bicycle_forces`` in one block of doubles at an address: f, q and v (n,), and the table; f is cleared before."""
    f = at(block)
    array(f, (n,))[:] = 0.0
    bicycle_forces(beyond(f, 3 * n), t, beyond(f, n), beyond(f, 2 * n), f)


@lean
def read_bicycle(numbers, q, v, reports, ledgers):
    """Fill reports (m, 2, REPORTED) and ledgers (m, LEDGER) of states (m, 9)."""
    f = array(doubles(COUNT), (COUNT,))
    for i in range(len(q)):
        f[:] = 0.0
        all_bicycle_forces(start(numbers), q[i], v[i], f, reports[i], ledgers[i])
