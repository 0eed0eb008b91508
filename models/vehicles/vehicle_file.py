"""Reading of a vehicle file in TOML into a vehicle in space: strict, with checks, every fault named by its entry."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import InputError
from models.core.scene_file import existing_file, parse_toml
from models.core.strict import read
from models.vehicles.spatial import (
    AntiRollBar,
    Body,
    Curve,
    Drag,
    PartOutput,
    PointOutput,
    ReductionLimits,
    SideForce,
    SpatialOutput,
    SpatialVehicle,
    SpringDamper,
    TurnOutput,
    Tyre,
    TyreOutput,
    Vector,
    hitch_of,
)
from models.vehicles.vehicle_checks import check_vehicle
from models.vehicles.vehicle_tables import (
    AxleTable,
    BarTable,
    CurveTable,
    OutputTable,
    ReducedTable,
    SeatTable,
    SpringTable,
    TyreTable,
    VehicleTable,
)

GROUND = "ground"
SHIPPED_FOLDER = Path(__file__).parent / "parameters" / "vehicles"


def shipped_vehicles() -> tuple[str, ...]:
    """Names of the vehicles that come with twinrig."""
    return tuple(sorted(path.stem for path in SHIPPED_FOLDER.glob("*.toml")))


def load_vehicle(
    vehicle_name: str,
    scene_folder: str | Path = ".",
    scene_path: str = "",
    key_path: str = "",
    allows_reduced_vehicle: bool = False,
    allows_towing: bool = False,
) -> SpatialVehicle:
    """The unloaded vehicle that comes with twinrig under a name, or that a user's TOML file, relative to
    ``scene_folder``, describes.

    ``scene_path`` and ``key_path`` say who asked for it, for the message if there is none. allows_reduced_vehicle : may
    it have [reduced]? allows_towing : may it tow bodies by a hitch? Raises InputError."""
    path = vehicle_path(vehicle_name, scene_folder, scene_path, key_path)
    vehicle = build_vehicle(parse_toml(path), path.name)
    if vehicle.limits and not allows_reduced_vehicle:
        raise InputError(
            scene_path,
            key_path,
            vehicle_name,
            "has a table [reduced], which only the study ride of linear vehicles reads: name the whole vehicle here",
        )
    if vehicle.towed and not allows_towing:
        allowed = f"tows {vehicle.towed[0]!r} by a hitch, which only handling and braking drive: name a vehicle alone"
        raise InputError(scene_path, key_path, vehicle_name, allowed)
    return vehicle


def vehicle_path(vehicle_name: str, scene_folder: str | Path = ".", scene_path: str = "", key_path: str = "") -> Path:
    """Path of the file that ``load_vehicle`` reads for a vehicle. Raises InputError."""
    if not vehicle_name.endswith(".toml"):
        if vehicle_name not in shipped_vehicles():
            allowed = "no such vehicle; a file of your own ends in .toml or .xml"
            raise InputError(scene_path, key_path, vehicle_name, allowed, shipped_vehicles())
        return SHIPPED_FOLDER / f"{vehicle_name}.toml"
    return existing_file(vehicle_name, Path(scene_folder), scene_path, key_path)


def build_vehicle(file_table: Mapping[str, Any], vehicle_file: str) -> SpatialVehicle:
    """The vehicle from nested tables as a TOML file contains them. Raises InputError for the first fault."""
    return _VehicleBuilder(_checked_tables(file_table, vehicle_file), vehicle_file).vehicle()


def _checked_tables(file_table: Mapping[str, Any], vehicle_file: str) -> VehicleTable:
    """Checked tables of a vehicle file. An error inside a list of tables is reported with the name of the entry."""
    try:
        return read(VehicleTable, file_table, vehicle_file)
    except InputError as error:
        place = re.match(r"(\w+)\.(\d+)(?=\.|$)", error.place)
        if not place:
            raise
        section, number = place[1], int(place[2])
        entry = file_table[section][number]
        name = entry.get("name") if isinstance(entry, Mapping) else None
        told = _key_path(section, name or number) + error.place[place.end() :]
        raise InputError(vehicle_file, told, error.value, error.allowed) from None


def _key_path(table_name: str, entry_name: object, entry_key: str = "") -> str:
    return f"{table_name}[{entry_name}]" + (f".{entry_key}" if entry_key else "")


class _VehicleBuilder:
    """Builder of the parts of a vehicle from the tables of a vehicle file."""

    def __init__(self, vehicle_table: VehicleTable, vehicle_file: str) -> None:
        self.tables, self.file = vehicle_table, vehicle_file
        self._unique("bodies", [*vehicle_table.bodies, *vehicle_table.seats], reserved_names=(GROUND,))
        self._unique("axles", vehicle_table.axles)
        self._unique("tyres", vehicle_table.tyres)
        self._unique("outputs", vehicle_table.outputs)
        self.towed = tuple(body.name for body in vehicle_table.bodies if body.hitch is not None)
        self.bodies = self._bodies()
        self.axles = self._axles()
        self.tyres = {tyre.name: self._tyre(tyre) for tyre in vehicle_table.tyres}

    def vehicle(self) -> SpatialVehicle:
        """The complete vehicle, after checks."""
        tables = self.tables
        springs = (*map(self._spring, tables.springs), *self._mounts(), *map(self._seat_spring, tables.seats))
        bars = tuple(map(self._bar, tables.anti_roll_bars))
        self._unique("springs, mounts, seats, anti_roll_bars", (*springs, *bars))
        parts = (*(spring.name for spring in springs), *(bar.name for bar in bars))
        drag = tables.drag
        vehicle = SpatialVehicle(
            name=self.file,
            bodies=tuple(self.bodies.values()),
            springs=springs,
            tyres=tuple(self.tyres.values()),
            axles=tuple(axle.x for axle in tables.axles),
            bars=bars,
            side_forces=self._side_forces(),
            drags=() if drag is None else (Drag(self._body("drag.body", drag.body), drag.coefficient),),
            outputs=tuple(self._output(output, parts) for output in tables.outputs),
            towed=self.towed,
        )
        check_vehicle(vehicle, self.file)
        return replace(vehicle, limits=self._limits(vehicle))

    def _limits(self, vehicle: SpatialVehicle) -> ReductionLimits:
        table, places = self.tables.reduced or ReducedTable(), vehicle.coordinates()
        known = (
            ("massless", table.massless, "body", tuple(self.bodies)),
            ("rigid", table.rigid, "spring", tuple(spring.name for spring in vehicle.springs)),
            ("locked", map(" ".join, table.locked), "freedom of a body", tuple(map(" ".join, places))),
        )
        for key, names, kind, choices in known:
            for name in names:
                self._known_name(f"reduced.{key}", name, kind, choices)
        locked = frozenset(place for place in places if list(place) in table.locked)
        return ReductionLimits(frozenset(table.massless), frozenset(table.rigid), locked)

    def _require(self, condition: Any, key_path: str, value: Any, allowed: str, choices: Sequence[str] = ()) -> None:
        """Raise InputError unless the condition ``condition`` holds."""
        if not condition:
            raise InputError(self.file, key_path, value, allowed, tuple(choices))

    def _unique(self, table_name: str, entries: Sequence[Any], reserved_names: Sequence[str] = ()) -> None:
        names = [entry.name for entry in entries]
        for i, name in enumerate(names):
            place = _key_path(table_name, name, "name")
            self._require(name not in reserved_names, place, name, "this name means the ground: choose another")
            self._require(name not in names[:i], place, name, "two entries have this name")

    def _known_name(self, key_path: str, given_name: str, entry_kind: str, allowed_names: Sequence[str]) -> str:
        self._require(given_name in allowed_names, key_path, given_name, f"no such {entry_kind}", allowed_names)
        return given_name

    def _body(self, key_path: str, body_name: str) -> str:
        return self._known_name(key_path, body_name, "body", tuple(self.bodies))

    def _bodies(self) -> dict[str, Body]:
        """Bodies with parents before their children, otherwise in the order of the file; then the occupants of the
        seats."""
        waiting = {body.name: body for body in self.tables.bodies}
        names, done = tuple(waiting), dict[str, Body]()
        for body in self.tables.bodies:
            if body.parent is not None:
                self._known_name(_key_path("bodies", body.name, "parent"), body.parent, "body", names)
        while waiting:
            first = next(iter(waiting.values()))
            ready = next((body for body in waiting.values() if body.parent is None or body.parent in done), None)
            place = _key_path("bodies", first.name, "parent")
            self._require(ready, place, first.parent, "bodies ride on one another")
            assert ready is not None
            (xx, yy, zz), (xy, xz, yz) = ready.inertia, ready.products
            inertia = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
            at, freedoms = _vector_of_numbers(ready.position), tuple(ready.freedoms)
            whole = Body(ready.name, ready.mass, at, freedoms, inertia, ready.parent)
            if ready.hitch is not None:
                hitch = self._hitch(whole, _vector_of_numbers(ready.hitch))
                done[hitch.name], whole = hitch, replace(whole, freedoms=(), parent=hitch.name)
            done[ready.name] = whole
            del waiting[ready.name]
        return done | {s.name: Body(s.name, s.mass, _vector_of_numbers(s.position), ("z",)) for s in self.tables.seats}

    def _hitch(self, body: Body, point: Vector) -> Body:
        """Massless body with the rotations of a towed body, at the point where its parent tows it."""
        place, name = _key_path("bodies", body.name), hitch_of(body.name)
        self._require(
            body.parent, f"{place}.hitch", list(point), "nothing tows it: name the body that does as its parent"
        )
        turns = "rz" in body.freedoms and all(freedom.startswith("r") for freedom in body.freedoms)
        self._require(turns, f"{place}.freedoms", list(body.freedoms), "a towed body turns about its hitch: rz, rx, ry")
        names = [each.name for each in (*self.tables.bodies, *self.tables.seats)]
        self._require(name not in names, f"{place}.hitch", name, "is the name of another body: the hitch needs it")
        return Body(name, 0.0, point, body.freedoms, parent=body.parent)

    def _towed_under(self, body_name: str | None) -> str | None:
        """Name of the towed body that is, or carries, the given body; None if there is none."""
        while body_name is not None and body_name not in self.towed:
            body_name = self.bodies[body_name].parent
        return body_name

    def _axles(self) -> dict[str, AxleTable]:
        """Axles by name, in order from the front; each must have a tyre."""
        axles = {axle.name: axle for axle in self.tables.axles}
        for before, axle in pairwise(axles.values()):
            allowed = f"axles are listed from the front: must lie behind {before.name!r}, below {before.x:g} m"
            self._require(axle.x < before.x, _key_path("axles", axle.name, "x"), axle.x, allowed)
        named = {
            self._known_name(_key_path("tyres", tyre.name, "axle"), tyre.axle, "axle", tuple(axles))
            for tyre in self.tables.tyres
        }
        for name in axles:
            self._require(name in named, _key_path("axles", name), None, "no tyre names this axle")
        return axles

    def _spring(self, spring: SpringTable) -> SpringDamper:
        place = _key_path("springs", spring.name)
        ends, points = self._two_bodies(place, spring.bodies), self._points(place, spring)
        axis = self._axis(place, spring, points)
        gains = spring.stiffness, spring.damping
        acts = any((*gains, spring.friction, spring.travel_force, spring.rate_force))
        self._require(acts, f"{place}.stiffness", None, "is missing: neither spring, damper, curve nor friction")
        travel, rate = (self._curve(f"{place}.{key}", getattr(spring, key)) for key in ("travel_force", "rate_force"))
        return SpringDamper(
            spring.name,
            *ends,
            *points,
            axis,
            *gains,
            travel,
            rate,
            spring.friction,
            spring.friction_rate,
            self._frame(place, spring.frame, ends),
        )

    def _frame(self, key_path: str, frame_name: str | None, end_bodies: tuple[str, str | None]) -> str | None:
        """Name of the body in which an axis is fixed: the body that the table names, else the towed body that carries
        both ends, if any."""
        if frame_name is not None:
            return self._body(f"{key_path}.frame", frame_name)
        first, second = map(self._towed_under, end_bodies)
        return first if first == second else None

    def _two_bodies(self, key_path: str, body_names: Sequence[str]) -> tuple[str, str | None]:
        """Names of the two bodies that a part connects; None for the ground."""
        (first, second), key_path = body_names, f"{key_path}.bodies"
        self._require(first != second, key_path, body_names, "connects a body with itself")
        self._require(first != GROUND, key_path, body_names, "name the ground second")
        return self._body(key_path, first), None if second == GROUND else self._body(key_path, second)

    def _points(self, key_path: str, spring_table: SpringTable) -> tuple[Vector, Vector]:
        both = (spring_table.point is None) != (spring_table.points is None)
        self._require(both, f"{key_path}.point", None, "give either point, the place of both ends, or points, both")
        first, second = (spring_table.point, spring_table.point) if spring_table.points is None else spring_table.points
        return _vector_of_numbers(first), _vector_of_numbers(second)

    def _axis(self, key_path: str, spring_table: SpringTable, points: tuple[Vector, Vector]) -> Vector:
        """Unit vector of a spring's axis: the given direction, else from the second point to the first, else
        upwards."""
        if spring_table.direction is not None:
            return self._unit(f"{key_path}.direction", spring_table.direction)
        apart = np.subtract(*points)
        distance = float(np.linalg.norm(apart))
        return _vector_of_numbers(apart / distance) if distance else (0.0, 0.0, 1.0)

    def _unit(self, key_path: str, direction: Sequence[float]) -> Vector:
        length = float(np.linalg.norm(direction))
        self._require(length, key_path, list(direction), "a direction needs a length")
        return _vector_of_numbers(np.array(direction) / length)

    def _curve(self, key_path: str, curve_table: CurveTable | None) -> Curve | None:
        if curve_table is None:
            return None
        at, force = curve_table.at, curve_table.force
        self._require(len(at) == len(force), f"{key_path}.force", force, f"must hold as many values as at, {len(at)}")
        rises = all(before < after for before, after in pairwise(at))
        self._require(rises, f"{key_path}.at", at, "must rise from value to value")
        curve = Curve(tuple(at), tuple(force))
        still = abs(curve(0.0)) <= 1e-9 * max(map(abs, force))
        self._require(still, f"{key_path}.force", curve(0.0), "must be 0 N at 0: the design position is at rest")
        return curve

    def _mounts(self) -> Iterator[SpringDamper]:
        for mount in self.tables.mounts:
            ends, at = self._two_bodies(_key_path("mounts", mount.name), mount.bodies), _vector_of_numbers(mount.point)
            acts = any(mount.stiffness) or any(mount.damping)
            place = _key_path("mounts", mount.name, "stiffness")
            self._require(acts, place, mount.stiffness, "has neither spring nor damper")
            frame = self._frame(_key_path("mounts", mount.name), mount.frame, ends)
            for name, axis, k, c in zip("xyz", np.eye(3), mount.stiffness, mount.damping, strict=True):
                yield SpringDamper(f"{mount.name}.{name}", *ends, at, at, _vector_of_numbers(axis), k, c, frame=frame)

    def _seat_spring(self, seat_table: SeatTable) -> SpringDamper:
        """Spring of a seat, with the occupant as first and the carrier as second body, so that force is positive in
        compression."""
        carrier = self._body(_key_path("seats", seat_table.name, "body"), seat_table.body)
        at = _vector_of_numbers(seat_table.position)
        law, frame = (seat_table.stiffness, seat_table.damping), self._towed_under(carrier)
        return SpringDamper(seat_table.name, seat_table.name, carrier, at, at, (0.0, 0.0, 1.0), *law, frame=frame)

    def _tyre(self, tyre_table: TyreTable) -> Tyre:
        place, axle = _key_path("tyres", tyre_table.name), self.axles[tyre_table.axle]
        x, y, z = self.bodies[self._body(f"{place}.body", tyre_table.body)].position
        allowed = f"its body lies at x = {x:g} m, its axle {axle.name!r} at {axle.x:g} m: they must agree"
        self._require(abs(x - axle.x) <= 1e-9, f"{place}.axle", tyre_table.axle, allowed)
        at, number = (axle.x, y if tyre_table.y is None else tyre_table.y, z), list(self.axles).index(tyre_table.axle)
        return Tyre(tyre_table.name, tyre_table.body, at, number, tyre_table.stiffness, tyre_table.damping)

    def _bar(self, bar_table: BarTable) -> AntiRollBar:
        place, names = _key_path("anti_roll_bars", bar_table.name), tuple(self.tyres)
        body = self.bodies[self._body(f"{place}.body", bar_table.body)]
        towed = body.name in self.towed
        rolls = towed or ("rx" in body.freedoms and body.parent is None)
        allowed = "needs a body with the freedom rx and without a parent, or a towed one"
        self._require(rolls, f"{place}.body", bar_table.body, allowed)
        left, right = (self.tyres[self._known_name(f"{place}.tyres", name, "tyre", names)] for name in bar_table.tyres)
        pair = left.axle == right.axle and left.point[1] > right.point[1]
        self._require(pair, f"{place}.tyres", bar_table.tyres, "must be the left and the right tyre of one axle")
        ends, frame = (left.body, right.body, left.point, right.point), body.name if towed else None
        return AntiRollBar(bar_table.name, bar_table.body, *ends, bar_table.stiffness, bar_table.damping, frame)

    def _side_forces(self) -> tuple[SideForce, ...]:
        """Side forces of the tyres. They act on the chassis, which guides the wheels laterally."""
        rolling, chassis = [tyre for tyre in self.tables.tyres if tyre.cornering], self.tables.chassis
        for axle in (axle for axle in self.tables.axles if axle.roll_steer):
            place = _key_path("axles", axle.name, "roll_steer")
            self._require(rolling, place, axle.roll_steer, "steers nothing: no tyre has a cornering stiffness")
        if not rolling:
            return ()
        named, forces = chassis is not None, []
        self._require(named, "chassis", None, f"is missing: tyre {rolling[0].name!r} has a side force")
        assert chassis is not None
        self._body("chassis", chassis)
        for tyre in rolling:
            x, y, _ = self.tyres[tyre.name].point
            carrying = self._towed_under(tyre.body) or chassis
            guided = tyre.body == carrying or "y" not in self.bodies[tyre.body].freedoms
            kind = "chassis" if carrying == chassis else "towed body"
            allowed = f"its side force acts on the {kind}: body {tyre.body!r} must not have the freedom y"
            self._require(guided, _key_path("tyres", tyre.name, "cornering"), tyre.cornering, allowed)
            steer = self.axles[tyre.axle].roll_steer
            forces.append(SideForce(tyre.name, carrying, (x, y, 0.0), carrying, tyre.cornering, steer))
        return tuple(forces)

    def _output(self, output_table: OutputTable, part_names: tuple[str, ...]) -> SpatialOutput:
        place, kind = _key_path("outputs", output_table.name), output_table.kind
        needed = "part" if kind in ("travel", "travel rate", "force") else "tyre" if "tyre" in kind else "body"
        foreign = {"part": "body point tyre", "tyre": "body point part", "body": "part tyre"}[needed].split()
        for key in foreign:
            value = getattr(output_table, key)
            self._require(value is None, f"{place}.{key}", value, f"{kind} is read of a {needed}")
        name = getattr(output_table, needed)
        self._require(name is not None, f"{place}.{needed}", None, f"is missing: {kind} is read of a {needed}")
        known = {"part": part_names, "tyre": tuple(self.tyres), "body": tuple(self.bodies)}[needed]
        self._known_name(f"{place}.{needed}", name, needed, known)
        if needed != "body":
            read_of: Any = PartOutput if needed == "part" else TyreOutput
            return read_of(output_table.name, kind, name)
        axis = self._unit(f"{place}.direction", output_table.direction)
        if kind.startswith("ang"):
            return TurnOutput(output_table.name, kind, name, axis)  # type: ignore[arg-type]
        point = self.bodies[name].position if output_table.point is None else _vector_of_numbers(output_table.point)
        return PointOutput(output_table.name, kind, name, point, axis)  # type: ignore[arg-type]


def _vector_of_numbers(components: Any) -> Vector:
    x, y, z = map(float, components)
    return x, y, z
