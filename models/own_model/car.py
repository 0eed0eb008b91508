"""Vehicle of a scene from an MJCF file: the same description as a vehicle file in TOML gives.

The chassis is the body with a free joint, or with three slides and three hinges. What rides on it keeps its hinges,
slides, springs, dampers and fixed tendons. Tyres, road, steering, brakes and drive are twinrig's: joints that spin or
steer a wheel, what acts on them, and contacts are left out, and the vehicle's notes say so.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NoReturn

import mujoco
import numpy as np

from models.core.errors import InputError
from models.own_model.car_bodies import CarBodies, car_bodies
from models.own_model.car_joints import JointRoles, remove_elements_on, roles_of
from models.own_model.content import CONTENT_KINDS, contents_of_model, limits_switched_off
from models.own_model.file import check_model_numbers, compiled_model
from models.own_model.names import coordinate_of, moving_bodies, object_label
from models.own_model.reading import body_loads, joint_elements, line_springs
from models.own_model.wheel_sites import WheelSite, wheel_sites
from models.own_model.xml_guard import ModelXml, checked_document
from models.vehicles.free_vehicle import CARRIER, SWAY, rotor_name
from models.vehicles.spatial import (
    JointElement,
    PartOutput,
    PointOutput,
    SideForce,
    SpatialOutput,
    SpatialVehicle,
    TurnOutput,
    Tyre,
    TyreOutput,
    Vector,
)
from models.vehicles.spatial_linear import static_preloads
from models.vehicles.vehicle_checks import check_vehicle

CONTACT_CONTENT = "contact"
"""The kind of content that a car's file may have beside twinrig's tyres: contacts, which are left out."""
GRAVITY = 9.81
PRELOAD_DIFFERENCE = 0.01
"""Relative difference of a preload from the file's from which a note reports it."""


def vehicle_of_file(mjcf_path: Path) -> SpatialVehicle:
    """The unloaded vehicle of an MJCF file. Raises InputError for features that vehicles of a scene cannot have."""
    document = checked_document(mjcf_path)
    if document.kind != "MJCF":
        raise InputError(mjcf_path.name, "", document.kind, "has no sites, by which wheels are known: save it as MJCF")
    model, _ = compiled_model(document)
    check_model_numbers(model, mjcf_path.name)
    return _CarReader(model, document).vehicle()


@dataclass
class _CarReader:
    """Reader of one MJCF file, which collects the parts of the vehicle and notes about it."""

    model: mujoco.MjModel
    document: ModelXml
    notes: list[str] = field(default_factory=list)
    design: mujoco.MjData = field(init=False)

    def vehicle(self) -> SpatialVehicle:
        """The complete vehicle of the file, after checks."""
        model, file = self.model, self.document.path.name
        design = self.design = mujoco.MjData(model)
        design.qpos[:] = model.qpos0
        mujoco.mj_kinematics(model, design)
        wheels = wheel_sites(model, design, self.document)
        roles = roles_of(model, design, wheels, self.document)
        self._leave_out(roles)
        self._check_gravity()
        parts = car_bodies(model, design, roles, self.document, _reserved_names(wheels))
        elements = tuple(self._elements(parts))
        tyres = tuple(_tyre(wheel, parts) for wheel in wheels)
        axles = tuple(float(next(w.point[0] for w in wheels if w.axle == i)) for i in range(wheels[-1].axle + 1))
        outputs = (*_spatial_outputs(parts, elements, tyres), *self._point_outputs(design, parts, wheels))
        vehicle = SpatialVehicle(
            name=file,
            bodies=parts.bodies,
            springs=(),
            tyres=tyres,
            axles=axles,
            side_forces=tuple(_side_force(wheel, parts) for wheel in wheels if wheel.cornering),
            outputs=outputs,
            joint_elements=elements,
            ranges=tuple(self._ranges(parts)),
        )
        check_vehicle(vehicle, file)
        return self._without_preloads(vehicle)

    def _refuse(self, part_name: str, value: object, reason: str) -> NoReturn:
        raise InputError(self.document.path.name, part_name, value, reason)

    def _leave_out(self, roles: JointRoles) -> None:
        """Remove parts of the file that twinrig models in another way; refuse other parts without an equivalent."""
        acted = remove_elements_on(self.model, roles)
        joints = [object_label(self.model, "joint", j) for j in (*roles.spin, *roles.steer)]
        for row in contents_of_model(self.model, self.document):
            if row.kind != CONTACT_CONTENT:
                said = f"{row.line()}: a vehicle of a scene cannot have it"
                self._refuse("", None, said)
            CONTENT_KINDS[CONTACT_CONTENT][2](self.model)
            joints.append("contacts")
        for line in line_springs(self.model, self.design):
            self._refuse(line.name, None, "lies along a line between two sites: springs of a car act along joints")
        for load in body_loads(self.model, self.design):
            self._refuse(load.name, None, "pushes a site: actuators of a car act along joints")
        if joints or acted:
            listed = ", ".join((*joints, *acted))
            self.notes.append(f"tyres, steering, brakes and drive are twinrig's; not built: {listed}")
        if limited := limits_switched_off(self.model):
            self.notes.append(f"stops are not built, and handling says where a run passes them: {', '.join(limited)}")

    def _check_gravity(self) -> None:
        """Refuse gravity that does not act downwards; add a note if it differs from the gravity of scenes."""
        gravity, name = np.array(self.model.opt.gravity), "option gravity"
        if np.any(gravity[:2]) or gravity[2] > 0.0:
            self._refuse(name, gravity.tolist(), "must be along -z: z is up from the road of a vehicle")
        if gravity[2] != -GRAVITY:
            self.notes.append(f"gravity is {GRAVITY:g} m/s^2, and not the file's {-gravity[2]:g}")
        for b in moving_bodies(self.model):
            if self.model.body_gravcomp[b]:
                self._refuse(
                    f"{object_label(self.model, 'body', b)} gravcomp", None, "must be 0: a vehicle has its weight"
                )

    def _elements(self, merged_bodies: CarBodies) -> Iterator[JointElement]:
        """Springs, dampers and rotor inertias along the coordinates of the suspension, with the signs of their axes."""
        joints = {coordinate_of(self.model, j)[0]: j for j in range(self.model.njnt)}
        for element in joint_elements(self.model):
            numbers = [joints[body] for body, _ in element.coordinates]
            for j in numbers:
                if j not in merged_bodies.coordinates:
                    said = f"acts along {object_label(self.model, 'joint', j)}, which twinrig moves, and along others"
                    self._refuse(element.name, None, said)
            moved = [merged_bodies.coordinates[j] for j in numbers]
            factors = tuple(factor * sign for factor, (_, sign) in zip(element.factors, moved, strict=True))
            yield replace(element, coordinates=tuple(at for at, _ in moved), factors=factors)

    def _ranges(self, merged_bodies: CarBodies) -> Iterator[tuple]:
        """Limits of the suspension joints, in the suspension's coordinates."""
        model = self.model
        for j, (at, sign) in merged_bodies.coordinates.items():
            if model.jnt_limited[j]:
                low, high = sorted(sign * (model.jnt_range[j] - model.qpos0[model.jnt_qposadr[j]]))
                yield at, float(low), float(high)

    def _point_outputs(
        self, design_data: mujoco.MjData, merged_bodies: CarBodies, wheels: tuple[WheelSite, ...]
    ) -> Iterator[PointOutput]:
        """Outputs of vertical acceleration at every named site that does not mark a wheel."""
        taken = {wheel.site for wheel in wheels}
        for s in range(self.model.nsite):
            name, body = self.model.site(s).name, int(self.model.site_bodyid[s])
            if name and s not in taken and body in merged_bodies.body_names:
                yield PointOutput(
                    name,
                    "acceleration",
                    merged_bodies.body_names[body],
                    _vector_of(design_data.site_xpos[s]),
                    (0.0, 0.0, 1.0),
                )

    def _without_preloads(self, vehicle: SpatialVehicle) -> SpatialVehicle:
        """The vehicle without preloads, since its springs will get the preloads that balance its weight. A note lists
        where the file's preloads differ."""
        held = static_preloads(replace(vehicle, gravity=GRAVITY)).parts
        changed = [
            f"{e.name} {held[e.name]:.4g} for {e.preload:.4g}"
            for e in vehicle.joint_elements
            if abs(e.preload - held[e.name]) > PRELOAD_DIFFERENCE * abs(held[e.name])
        ]
        if changed:
            said = "preloads (N, N m) hold the design position at rest and stand for the file's"
            self.notes.append(f"{said}: {', '.join(changed)}")
        bare = tuple(replace(element, preload=0.0) for element in vehicle.joint_elements)
        return replace(vehicle, joint_elements=bare, notes=tuple(self.notes))


def _reserved_names(wheels: tuple[WheelSite, ...]) -> set[str]:
    """Names of bodies that a system adds to a car, so that the file's bodies cannot have them."""
    return {CARRIER, SWAY, *(rotor_name(wheel.name) for wheel in wheels)}


def _tyre(wheel: WheelSite, merged_bodies: CarBodies) -> Tyre:
    at, spin = _vector_of(wheel.point), merged_bodies.spin_inertia.get(wheel.name)
    return Tyre(
        wheel.name,
        merged_bodies.body_names[wheel.body],
        at,
        wheel.axle,
        wheel.stiffness,
        wheel.damping,
        spin_inertia=spin,
    )


def _side_force(wheel: WheelSite, merged_bodies: CarBodies) -> SideForce:
    x, y, _ = _vector_of(wheel.point)
    return SideForce(wheel.name, merged_bodies.chassis, (x, y, 0.0), merged_bodies.chassis, wheel.cornering)


def _spatial_outputs(
    merged_bodies: CarBodies, elements: tuple[JointElement, ...], tyres: tuple[Tyre, ...]
) -> Iterator[SpatialOutput]:
    """Motion of the chassis, travels of springs and dampers, forces of tyres."""
    chassis = next(body for body in merged_bodies.bodies if body.name == merged_bodies.chassis)
    yield PointOutput(chassis.name, "acceleration", chassis.name, chassis.position, (0.0, 0.0, 1.0))
    for turn, axis in (("roll", (1.0, 0.0, 0.0)), ("pitch", (0.0, 1.0, 0.0))):
        yield TurnOutput(f"{turn} acceleration", "angular acceleration", chassis.name, axis)
    for element in elements:
        yield PartOutput(f"travel {element.name}", "travel", element.name)
    for tyre in tyres:
        yield TyreOutput(f"tyre force {tyre.name}", "tyre force", tyre.name)


def _vector_of(components: np.ndarray) -> Vector:
    x, y, z = np.asarray(components, float).tolist()
    return x, y, z
