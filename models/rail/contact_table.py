"""Wheel-rail contact of a wheelset with measured or standard profiles, over lateral displacement and yaw: the
Manchester contact benchmark.

The wheelset is held at a lateral displacement and a yaw angle. Its roll and the approach of each wheel follow from the
vertical load of each wheel; both wheels carry the same. Without friction the vertical parts of the normal forces make
up the load. With friction the wheelset rolls at a speed; creep forces come in, and its speed of spin is such that they
have no moment about the axle.

Roll angle and speed of spin are found with Kalker's simplified non-Hertzian theory (``simplified_theory``), each patch
with an area of its own, the patches of one wheel with the vertical approach in common. Places, loads and pressures are
then those of the exact normal contact (``joined_patches``). Creep forces are the simplified theory's, scaled with the
patch's load.

Benchmark: Shackleton and Iwnicki, Vehicle System Dynamics 46 (2008) 129-149; case A-1 without yaw, A-2 with 2.4 mrad
for each mm. The load of 10 kN on each wheel and the steps of 0.5 mm are those that CONTACT's example files give.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from models.contact.inputs import Array, checked_quantity
from models.contact.material import MaterialPair
from models.contact.simplified_theory import NormalContact, PatchPressure, solve_normal_contact, solve_rolling_contact
from models.contact.wheel_on_rail import TouchingPlace, WheelAndRail, WheelsetPose, touching_places, touching_pose
from models.core.errors import RunFailed
from models.rail.joined_patches import PatchShare, exact_patch_shares

ForceOrCreepage = tuple[float, float, float]
SIDE_SIGNS = (1.0, -1.0)
"""Factors of lateral displacement, yaw and roll for the right wheel, and for the left wheel seen in a mirror."""
ROLL_ITERATIONS = 3
"""Count of iterations for the roll angle with the approaches of both wheels."""
SPIN_ITERATIONS = 2
"""Count of iterations for the speed of spin with the exact loads of the patches."""
ITERATION_COUNT = 60
SPIN_SEARCH_SHARE = 0.05
"""Share of the nominal speed of spin within which the speed without moment about the axle is searched."""
CELLS_PER_STRIP = 31
"""Count of strips of a patch, and of cells along each."""
LOAD_PRECISION = 1e-7
"""Relative precision of the load that a wheel carries."""
CLIMBING_DEPTH = 2e-3
"""Distance (m) from the flange's tip to the first touch below which a wheel counts as having climbed the rail."""


@dataclass(frozen=True)
class PatchReport:
    """Report of one connected piece of a wheel's contact area: a patch, or several that have grown together.

    The left wheel as in a mirror, so that y and fy point away from the track's middle.

    touch_y, y : first touch and centre of pressure, on the rail from the middle of the track (m). top : the rail's
    highest point, likewise (m). x : of the centre of pressure, ahead of the axle (m). wheel_y : of first touch, on the
    wheel from the taping line (m). angle, centre_angle : of the rail's surface at first touch and at the centre
    of pressure (rad), negative where it falls towards the middle. rolling_radius : at first touch (m). below_tip : of
    first touch below the tip of the flange (m). curvature_x, curvature_y : second derivatives of the undeformed
    distance there, along and across (1/m). normal : N. vertical : part of it (N). fx, fy : creep forces on the wheel
    (N). mz : their moment about the normal through first touch of the patch that carries most (N m), which lies at
    touch_x ahead of the axle (m) and touch_y; patches that have grown together have the levers from there. xi_x, xi_y,
    spin : creepages at first touch, spin in 1/m. peak : largest pressure (Pa). area : m^2. length, width : of the
    rectangle about it, along the rail and across (m). approach : vertical, of the wheel (m).
    """

    touch_x: float
    touch_y: float
    y: float
    top: float
    x: float
    wheel_y: float
    angle: float
    centre_angle: float
    rolling_radius: float
    below_tip: float
    curvature_x: float
    curvature_y: float
    normal: float
    vertical: float
    fx: float
    fy: float
    mz: float
    xi_x: float
    xi_y: float
    spin: float
    peak: float
    area: float
    length: float
    width: float
    approach: float

    @property
    def wheel_centre(self) -> float:
        """Centre of pressure on the wheel, y from the taping line (m); the wheelset's roll is neglected, which costs at
        most 1e-4 of it."""
        return self.wheel_y + self.y - self.touch_y

    @property
    def on_rail(self) -> float:
        """Position of the centre of pressure on the rail, y from the rail's highest point (m)."""
        return self.y - self.top

    @property
    def touch_on_rail(self) -> float:
        """Position of first touch on the rail, y from the rail's highest point (m)."""
        return self.touch_y - self.top


@dataclass(frozen=True)
class WheelsetPlacement:
    """Contact at a lateral displacement (m) and yaw (rad): the wheelset's roll (rad), its speed of spin (rad/s), and
    reports of the patches of both wheels."""

    shift: float
    yaw: float
    roll: float
    spin_speed: float
    right: tuple[PatchReport, ...]
    left: tuple[PatchReport, ...]


@dataclass(frozen=True, eq=False)
class LoadedWheel:
    """A wheel under its load: pressure of each patch, and creep forces and moment (N, N, N m); mirrored for the left
    wheel.

    pose : lowered until the wheel touches. shares : what the patches carry by the exact normal contact, if that is
    known. approach : vertical (m). creep_lift : vertical part of the creep forces, upwards on the rail (N).
    normal_force : that of the normal forces (N). moment : of the creep forces about the axle (N m)."""

    pose: WheelsetPose
    touches: list[TouchingPlace]
    creepages: list[ForceOrCreepage]
    normal_contact: NormalContact
    approach: float
    normal_force: float
    forces: Sequence[ForceOrCreepage] = ()
    shares: Sequence[PatchShare] = ()
    creep_lift: float = 0.0
    moment: float = 0.0

    @property
    def loads(self) -> list[float]:
        """Loads of the patches along their normals (N)."""
        if self.shares:
            return [share.load for share in self.shares]
        return [
            0.0 if patch_pressure is None else patch_pressure.load
            for patch_pressure in map(self.pressure_at, self.touches)
        ]

    def pressure_at(self, touch: TouchingPlace) -> PatchPressure | None:
        """Pressure of the patch at a touch by the simplified theory; None if the theory finds no contact there."""
        return next(
            (patch_pressure for patch_pressure in self.normal_contact.patches if patch_pressure.patch is touch.patch),
            None,
        )


@dataclass(frozen=True, eq=False)
class WheelsetContact:
    """Contact problem of a wheelset on its track. side : the right wheel on its rail. load : N on each wheel. speed :
    m/s. friction : coefficient, 0 for a smooth contact. cell_factor : size of the cells divided by the usual size, to
    estimate their error."""

    side: WheelAndRail
    load: float
    speed: float
    friction: float = 0.0
    material_pair: MaterialPair = MaterialPair()  # noqa: RUF009 - a frozen value
    cell_factor: float = 1.0

    def at(self, lateral_shift: float, yaw: float = 0.0) -> WheelsetPlacement:
        """Contact at a lateral displacement (m) to the right and a yaw (rad).

        Raises InputError as wheel_on_rail, and RunFailed where the load presses the bodies into each other beyond all
        measure, where no normal force carries the load, or where a wheel has climbed its flange.
        """
        checked_quantity("lateral_shift", lateral_shift, "a shift in m from -0.03 to 0.03", -0.03, 0.03)
        checked_quantity("yaw", yaw, "a yaw angle in rad from -0.1 to 0.1", -0.1, 0.1)
        pose = touching_pose(self.side, lateral_shift, yaw)
        level, rolling = pose.roll, -self.speed / self.side.wheelset.radius
        for _ in range(ROLL_ITERATIONS):
            right, left = wheels = self._both_wheels(pose, rolling)
            span = right.touches[0].wheel_y + left.touches[0].wheel_y + 2.0 * self.side.wheelset.arm
            pose = replace(pose, roll=level + (right.approach - left.approach) / span)
            if self.friction > 0.0:
                rolling = self._free_spin(wheels)
        wheels = self._both_wheels(pose, rolling)
        for _ in range(SPIN_ITERATIONS):
            wheels = [self._with_exact_normal(wheel) for wheel in wheels]
            if self.friction == 0.0:
                break
            rolling = self._free_spin(wheels)
            wheels = [self._with_spin_speed(wheel, rolling) for wheel in wheels]
        return _checked_placement(
            WheelsetPlacement(lateral_shift, yaw, pose.roll, rolling, *map(self._patch_reports, wheels))
        )

    def _both_wheels(self, pose: WheelsetPose, spin_speed: float) -> list[LoadedWheel]:
        """The right wheel and the mirrored left wheel, each lowered until it touches its rail, then loaded.

        By the simplified theory, with normal forces such that they and the creep forces carry the load.
        """
        return [
            self._wheel(WheelsetPose(sign * pose.shift, sign * pose.yaw, sign * pose.roll, 0.0), spin_speed)
            for sign in SIDE_SIGNS
        ]

    def _wheel(self, wheel_pose: WheelsetPose, spin_speed: float) -> LoadedWheel:
        pose = replace(wheel_pose, fall=self.side.clearance(wheel_pose))
        touches = touching_places(self.side, pose)
        creepages = [self._creepage(pose, touch, spin_speed) for touch in touches]

        def by_normal(vertical_force: float) -> LoadedWheel:
            pressed = solve_normal_contact([touch.patch for touch in touches], self.material_pair, load=vertical_force)
            return LoadedWheel(pose, touches, creepages, pressed, pressed.approach, vertical_force)

        return self._in_vertical_equilibrium(by_normal, self.load)

    def _with_exact_normal(self, approximate_wheel: LoadedWheel) -> LoadedWheel:
        """The loaded wheel with its normal contact solved exactly instead of by the simplified theory."""
        patches = [touch.patch for touch in approximate_wheel.touches]

        def by_normal(vertical_force: float) -> LoadedWheel:
            shares, approach = exact_patch_shares(
                patches,
                approximate_wheel.normal_contact.patches,
                vertical_force,
                approximate_wheel.approach,
                self.material_pair,
                self.cell_factor,
            )
            return replace(approximate_wheel, shares=shares, approach=approach, normal_force=vertical_force)

        return self._in_vertical_equilibrium(by_normal, approximate_wheel.normal_force)

    def _in_vertical_equilibrium(
        self, wheel_by_normal: Callable[[float], LoadedWheel], normal_force: float
    ) -> LoadedWheel:
        """The wheel in vertical equilibrium: normal and creep forces together carry the load. ``wheel_by_normal``
        returns the wheel for a vertical part (N) of the normal forces, which is iterated from ``normal_force``."""
        for _ in range(ITERATION_COUNT):
            wheel = self._with_creep_forces(wheel_by_normal(normal_force))
            if abs(normal_force - wheel.creep_lift - self.load) < LOAD_PRECISION * self.load:
                return wheel
            normal_force *= self.load / (normal_force - wheel.creep_lift)
        raise RunFailed("contact table", f"no normal force was found that carries {self.load:g} N")

    def _free_spin(self, loaded_wheels: Sequence[LoadedWheel]) -> float:
        """Speed of spin (rad/s) of a freely rolling wheelset, whose creep forces have no moment about the axle under
        the present normal forces."""

        def moment(spin_speed: float) -> float:
            return sum(self._with_spin_speed(wheel, spin_speed).moment for wheel in loaded_wheels)

        rolling = -self.speed / self.side.wheelset.radius
        return float(
            brentq(moment, rolling * (1.0 - SPIN_SEARCH_SHARE), rolling * (1.0 + SPIN_SEARCH_SHARE), xtol=1e-9)
        )

    def _with_spin_speed(self, loaded_wheel: LoadedWheel, spin_speed: float) -> LoadedWheel:
        """The wheel with unchanged normal contact at another speed of spin (rad/s)."""
        creepages = [self._creepage(loaded_wheel.pose, touch, spin_speed) for touch in loaded_wheel.touches]
        return self._with_creep_forces(replace(loaded_wheel, creepages=creepages))

    def _with_creep_forces(self, loaded_wheel: LoadedWheel) -> LoadedWheel:
        """The wheel with the creep forces of each patch; patches without contact get zero forces."""
        forces = []
        for touch, creepage, load in zip(loaded_wheel.touches, loaded_wheel.creepages, loaded_wheel.loads, strict=True):
            patch_pressure = loaded_wheel.pressure_at(touch)
            if patch_pressure is None or load == 0.0 or self.friction == 0.0:
                forces.append((0.0, 0.0, 0.0))
                continue
            single_patch = replace(loaded_wheel.normal_contact, patches=(replace(patch_pressure, load=load),))
            creep = solve_rolling_contact(
                single_patch, self.friction, *creepage, cell_count=round(CELLS_PER_STRIP / self.cell_factor)
            )
            forces.append((creep.fx, creep.fy, creep.mz))
        pairs, axle = list(zip(loaded_wheel.touches, forces, strict=True)), loaded_wheel.pose.rotation[:, 1]
        lifted = sum(force[1] * math.sin(touch.angle) for touch, force in pairs)
        moment = sum(
            float(axle @ _patch_moment(self._arm(loaded_wheel.pose, touch), touch, force)) for touch, force in pairs
        )
        return replace(loaded_wheel, forces=forces, creep_lift=lifted, moment=moment)

    def _creepage(self, pose: WheelsetPose, touch: TouchingPlace, spin_speed: float) -> ForceOrCreepage:
        """Longitudinal and lateral creepage, and spin (1/m), at a point of first touch."""
        if self.friction == 0.0:
            return 0.0, 0.0, 0.0
        axle, arm = pose.rotation[:, 1], self._arm(pose, touch)
        velocity = spin_speed * np.cross(axle, arm) + np.array([self.speed, 0.0, 0.0])
        across, into = _rail_surface_axes(touch)
        slips = velocity[0] / self.speed, velocity @ across / self.speed, spin_speed * axle @ into / self.speed
        return float(slips[0]), float(slips[1]), float(slips[2])

    def _radius(self, touch: TouchingPlace) -> float:
        return self.side.wheelset.radius + float(self.side.wheel.curve(touch.wheel_y))

    def _arm(self, pose: WheelsetPose, touch: TouchingPlace) -> Array:
        """Vector from the wheelset's centre to a point of first touch, in the track's axes (m)."""
        height_below = math.sqrt(self._radius(touch) ** 2 - touch.x**2)
        return pose.rotation @ np.array([touch.x, self.side.wheelset.arm + touch.wheel_y, height_below])

    def _patch_reports(self, wheel: LoadedWheel) -> tuple[PatchReport, ...]:
        """Reports of all patches of a wheel that carry load; patches that have grown together get one common report."""
        rows = [
            row
            for row in zip(wheel.touches, wheel.creepages, wheel.forces, wheel.shares, strict=True)
            if row[-1].load > 0.0
        ]
        pieces = dict.fromkeys(share.piece for *_, share in rows)
        return tuple(self._joined_report(wheel, [row for row in rows if row[-1].piece == piece]) for piece in pieces)

    def _joined_report(
        self, wheel: LoadedWheel, patch_rows: list[tuple[TouchingPlace, ForceOrCreepage, ForceOrCreepage, PatchShare]]
    ) -> PatchReport:
        """Report of one connected piece of the contact area; its first touch and creepages are those of the patch with
        the largest load."""
        side, (touch, creepage, _, _) = self.side, max(patch_rows, key=lambda row: row[-1].load)
        top, start = float(side.rail.y[np.argmin(side.rail.z)]), self._arm(wheel.pose, touch)
        loads = np.array([share.load for *_, share in patch_rows])
        centres = [
            (patch.rail_y + top + share.y * math.cos(patch.angle), patch.x + share.x)
            for patch, _, _, share in patch_rows
        ]
        y, x = (float(np.average(values, weights=loads)) for values in zip(*centres, strict=True))
        fx, fy = (float(sum(force[k] for _, _, force, _ in patch_rows)) for k in (0, 1))
        mz = sum(
            float(_rail_surface_axes(touch)[1] @ _patch_moment(self._arm(wheel.pose, patch) - start, patch, force))
            for patch, _, force, _ in patch_rows
        )
        boxes = np.array([share.box for *_, share in patch_rows])
        length, width = (float(boxes[:, k + 1].max() - boxes[:, k].min()) for k in (0, 2))
        return PatchReport(
            touch.x,
            touch.rail_y + top,
            y,
            top,
            x,
            touch.wheel_y,
            touch.angle,
            math.atan(float(side.rail.curve(y, 1))),
            self._radius(touch),
            float(side.wheel.z.max() - side.wheel.curve(touch.wheel_y)),
            *touch.patch.distance.curvatures,
            float(loads.sum()),
            sum(share.load * math.cos(patch.angle) for patch, _, _, share in patch_rows),
            fx,
            fy,
            mz,
            *creepage,
            max(share.peak for *_, share in patch_rows),
            sum(share.area for *_, share in patch_rows),
            length,
            width,
            wheel.approach,
        )


def _checked_placement(placement: WheelsetPlacement) -> WheelsetPlacement:
    """The placement unchanged; RunFailed if a wheel stands on the tip of its flange."""
    for name, patches_of_wheel in (("right", placement.right), ("left", placement.left)):
        least_depth = min(patch.below_tip for patch in patches_of_wheel)
        if least_depth < CLIMBING_DEPTH:
            raise RunFailed(
                "contact table",
                f"at {1e3 * placement.shift:g} mm the {name} wheel has climbed its flange and "
                f"touches {1e3 * least_depth:.1f} mm below the tip: no wheelset stays there",
            )
    return placement


def rolling_radius_difference(placement: WheelsetPlacement) -> float:
    """Rolling radius of the right wheel minus that of the left one (m), each at the patch with the largest load."""
    right, left = (
        max(patches_of_wheel, key=lambda patch: patch.normal) for patches_of_wheel in (placement.right, placement.left)
    )
    return right.rolling_radius - left.rolling_radius


def _rail_surface_axes(touch: TouchingPlace) -> tuple[Array, Array]:
    """Unit vectors along the rail's surface and along its inward normal, in the track's axes."""
    cosine, sine = math.cos(touch.angle), math.sin(touch.angle)
    return np.array([0.0, cosine, sine]), np.array([0.0, -sine, cosine])


def _patch_moment(lever: Array, touch: TouchingPlace, creep_force: ForceOrCreepage) -> Array:
    """Moment (3,) of a patch's creep forces and spin moment about a point; ``lever`` is the vector (m) from that point
    to the patch."""
    across, into = _rail_surface_axes(touch)
    return np.cross(lever, creep_force[0] * np.array([1.0, 0.0, 0.0]) + creep_force[1] * across) + creep_force[2] * into
